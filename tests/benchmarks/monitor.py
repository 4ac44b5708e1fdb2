"""The monitor's figures: ``python -m tests.benchmarks.monitor``, or one ``--part`` of them.

Parts, each a table:

- ``fleet``: false alarms of healthy robots, and how far wear had come when it was found
  (`monitor_fleet`); 15 CPU minutes, ``--kept`` goes on where it was ended.
- ``rate``: false alarms counted against those asked for, where nights are correlated.
- ``delay``: cycles until a step is found, against the optimum at the same false-alarm rate, and
  against the best that knows no more than the product.
- ``worst``: the same in Lorden's sense, after nights that leave the sum at zero, and after the
  worst hundredth of all (`monitor_worst`).
- ``ramps``: the rise at which slow wear is found, what a growing baseline swallows of it, and what
  that same reference does.
- ``early``: the rise at which wear from the first night on is found by who is told more than the
  product (`monitor_early`); two CPU minutes.
- ``change``: error of the change time, coverage of its interval and of the outlook's.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from agent.identify.result import Floats
from agent.monitor.detection.cusum import Cusum
from agent.monitor.detection.detectors import DETECTORS
from agent.monitor.detection.tuning import Target
from tests.benchmarks.monitor_change import CASES, TIED, campaign
from tests.benchmarks.monitor_delay import (
    FIRST,
    LEVEL,
    false_rate,
    first_alarm,
    healthy_years,
    measure,
)
from tests.benchmarks.monitor_early import early
from tests.benchmarks.monitor_fleet import outcomes, table
from tests.benchmarks.monitor_reference import line_for, log_odds
from tests.benchmarks.monitor_worst import measure_worst

# Apart from those that were looked at while designing.
CHANGE_SEED, RAMP_SEED = 700_000, 40_000
PARTS = ("fleet", "rate", "delay", "worst", "ramps", "early", "change")
RISE, NOISES = 0.03, (0.01, 0.02, 0.03)
NIGHTS = (40, 60, 90, 130, 230, 365)
YEAR = tuple(np.random.default_rng(0).permutation(np.arange(FIRST, FIRST + 365)).tolist())
"""Every night of the year after the first baseline, in any order."""
RAMP_NIGHTS, RAMP_ROBOTS = 1200, 120


def rate(robots: int) -> None:
    """Print the false alarms of noise that were counted, one a year being asked for."""
    print("\nrate: false alarms a year from noise alone where 1 is asked for, noise 2 %, nightly")
    print("baseline  independent  neighbours tied 0.3  tied 0.6")
    asked = Cusum(Target(increased_per_year=2.5))  # two fifths of it are left to noise
    for healthy in (15, 30, 60, 120):
        counted = [false_rate(asked, healthy, 0.02, robots, 1.0, m)[0] for m in (0.0, 0.3, 0.6)]
        print(f"{healthy:8d} {counted[0]:12.2f} {counted[1]:20.2f} {counted[2]:9.2f}", flush=True)


def delay(robots: int) -> None:
    """Print the delay table."""
    print("\ndelay: mean nights to find a step of 3 %, first baseline of 30 nights, then growing")
    print("noise  step on night  false/a  found  optimum  ratio   fair  ratio  first baseline kept")
    for noise in NOISES:
        counted, line = _counted(noise, robots)
        for word, nights in (*((f"{n}", (n,)) for n in NIGHTS), ("any of a year", YEAR)):
            d = measure(nights, noise, RISE, counted, line, robots=robots)
            print(
                f"{noise:5.1%} {word:>14s} {counted:8.3f} {d.cycles:6.2f} {d.optimum:8.2f} "
                f"{d.ratio:6.2f} {d.fair:6.2f} {d.cycles / d.fair:6.2f} "
                f"{d.kept / d.optimum:20.2f}",
                flush=True,
            )


def _counted(noise: float, robots: int) -> tuple[float, float]:
    """Return the product's false alarms a year, and the fair reference's threshold at as many."""
    years = 4.0
    detector = Cusum(Target(smallest_rise=RISE))
    counted, alarms = false_rate(detector, FIRST, noise, robots, years, grows=True)
    line = line_for(healthy_years(FIRST, noise, robots, years), alarms, RISE * LEVEL, FIRST)
    return counted if alarms else 0.5 / (years * robots), line


def worst(robots: int, histories: int) -> None:
    """Print the delays in Lorden's sense."""
    print("\nworst: mean nights to find a step of 3 %: from a sum of zero; after the worst 1 %")
    print("noise  step on night  false/a  from zero  optimum  ratio  worst 1 %  fair's  ratio")
    for noise in NOISES:
        counted, line = _counted(noise, robots)
        for night in NIGHTS:
            d = measure_worst(night, noise, RISE, counted, line, histories=histories)
            print(
                f"{noise:5.1%} {night:14d} {counted:8.3f} {d.zero:10.2f} {d.optimum:8.2f} "
                f"{d.zero / d.optimum:6.2f} {d.worst:10.2f} {d.fair_worst:7.2f} "
                f"{d.worst / d.fair_worst:6.2f}",
                flush=True,
            )


def ramps(joints: int) -> None:
    """Print the rise at which slow wear is found: first baseline kept, grown, fair reference."""
    print("\nramps: rise in percent when found, median and 90 % quantile; noise 1 %, nightly")
    rates, noise, years = (0.02, 0.05, 0.1, 0.3, 1.0), 0.01, 4.0
    rise = Target().smallest_rise * LEVEL
    alarms = false_rate(Cusum(), FIRST, noise, RAMP_ROBOTS, years, grows=True)[1]
    line = line_for(healthy_years(FIRST, noise, RAMP_ROBOTS, years), alarms, rise, FIRST)

    def found_at(word: str, values: Floats) -> int | None:
        if word == "fair":
            crossed = np.flatnonzero(log_odds(values, rise, FIRST) >= line)
            return int(crossed[0]) if crossed.size else None
        return first_alarm(Cusum(), values, FIRST, grows=word == "grown")

    print(f"{'wear from night':22s}" + " ".join(f"{100.0 * r:.0f} %/a".rjust(12) for r in rates))
    for onset in (1, 40, 90):
        for word in ("kept", "grown", "fair"):
            cells = []
            for a_year in rates:
                risen = a_year / 365.0 * np.maximum(0, np.arange(RAMP_NIGHTS) - onset)
                found = []
                for seed in range(RAMP_SEED, RAMP_SEED + joints):
                    scatter = noise * np.random.default_rng(seed).standard_normal(RAMP_NIGHTS)
                    at = found_at(word, LEVEL * (1.0 + scatter + risen))
                    found.append(np.inf if at is None else 100.0 * risen[at])
                middle, most = np.quantile(found, (0.5, 0.9), method="higher")
                cells.append(f"{middle:6.2f} {most:5.2f}")
            print(f"{onset:15d} {word:6s}", *cells, flush=True)


def change(seeds: int) -> None:
    """Print the change-time table."""
    print("\nchange: nightly, noise 1 %, outlook to a rise of 30 %")
    print(f"{'':36s} error covers  said nights single undecided outlooks cover")
    scores = []
    for course in CASES + TIED:
        s = campaign(course, range(CHANGE_SEED, CHANGE_SEED + seeds))
        scores.append(s)
        print(
            f"{course.name:36s} {s.median_error:5.1f} {s.coverage:6.1%} {s.stated:5.1%} "
            f"{s.nights:6.1f} {s.single:6.1%} {s.undecided:9.1%} "
            + (f"{s.outlooks:8.1%} {s.outlook_coverage:6.1%}" if s.outlooks else f"{'–':>8s}"),
            flush=True,
        )
    pooled = [float(np.mean([getattr(s, part) for s in scores])) for part in ("coverage", "stated")]
    print(f"{'all, in equal parts':36s} {'':5s} {pooled[0]:6.1%} {pooled[1]:5.1%}")


def main() -> None:
    """Print the tables that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, default=1000)
    parser.add_argument("--baseline", type=int, default=0, help="nights; 0: the product's own")
    parser.add_argument("--kept", type=Path, help="file of the fleet's robots, to go on with")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--product", action="store_true", help="without the other detectors")
    parser.add_argument("--joints", type=int, default=300, help="of each row of the delays")
    parser.add_argument("--histories", type=int, default=800, help="of each row of the worst")
    parser.add_argument("--part", choices=PARTS)
    asked = parser.parse_args()
    if asked.part in (None, "fleet"):
        words = () if asked.product else tuple(DETECTORS)
        found = outcomes(asked.robots, asked.baseline or None, asked.kept, asked.jobs, words)
        print(*table(found, f"baseline {asked.baseline or 'by the rule'}"), sep="\n")
    if asked.part in (None, "rate"):
        rate(200)
    if asked.part in (None, "delay"):
        delay(asked.joints)
    if asked.part in (None, "worst"):
        worst(asked.joints, asked.histories)
    if asked.part in (None, "ramps"):
        ramps(40)
    if asked.part in (None, "early"):
        early(60)
    if asked.part in (None, "change"):
        change(500)


if __name__ == "__main__":
    main()
