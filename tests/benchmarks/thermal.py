"""Temperature: coverage and information limit: ``python -m tests.benchmarks.thermal [count]``.

Cooling curves of r = 6.2e-5 1/s under five sensors, then friction surfaces at seven temperatures,
with a Stribeck velocity that stays and one that moves with temperature. Figures to reach: 95 %
intervals that cover 92 to 98 %, errors of at most 1.15 times the Cramer-Rao bound.
"""

from __future__ import annotations

import sys

from fakes.friction import FrictionParameters
from tests.science.information import Score
from tests.science.thermal_campaign import SENSORS, cooling_campaign, surface_campaign

SEEDS = 500
HEADER = f"{'case':<32}{'parameter':<32}{'truth':>10}{'coverage':>10}{'rmse':>11}{'/ bound':>9}"


def row(s: Score) -> str:
    """Return one line of a table."""
    return (
        f"{s.fit:<32}{s.parameter:<32}{s.truth:>10.4g}{100 * s.coverage:>9.1f}%"
        f"{s.rmse:>11.3g}{s.ratio:>9.3f}"
    )


def main() -> None:
    """Print the tables; the first argument is the number of seeds."""
    seeds = range(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS)
    print(f"{len(seeds)} seeds\n{HEADER}")
    for sensor in SENSORS:
        for s in cooling_campaign(seeds, sensor):
            print(row(s), flush=True)
    for per_degc in (0.0, 0.01):
        law = FrictionParameters(stribeck_velocity_per_degc=per_degc)
        scores, chosen = surface_campaign(seeds, law)
        print(f"laws chosen: {dict(chosen)}")
        for s in scores:
            print(row(s), flush=True)


if __name__ == "__main__":
    main()
