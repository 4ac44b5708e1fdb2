"""The thesis's two case studies, rebuilt: ``python -m tests.benchmarks.monitor_case_study``.

Sections 6.3.1 and 6.3.2. Prints in how many of many simulated histories each detector does what
the thesis describes, for several courses of wear: no fault throughout the normal variation; H0
before H1, and H1 before the breakdown, which comes after the last cycle. ``--pictures FOLDER``
draws Figures 6.2 and 6.3.

Constant temperature and motion, as there. Normal variation is a few percent, and mostly a tilt of
the curve: Coulomb and viscous friction move against each other, and the integrals hardly. Wear adds
friction that falls off with speed, most of it below 100 rad/s (Figures 5.8 and 5.9), and grows by a
constant factor a cycle until the gearbox breaks.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.identify.result import Floats
from agent.monitor.detection.cusum import Cusum
from agent.monitor.detection.detectors import DETECTORS
from agent.monitor.detection.series import Detector, FeatureSeries, State
from agent.monitor.detection.thesis import Thesis
from tests.science.monitor_fleet import correlated
from tests.science.monitor_joint import SPEEDS, Joint, series_of

CYCLES, HEALTHY, SEEDS = 40, 15, 200
WEAR_SPEED_RAD_S = 100.0


@dataclass(frozen=True)
class Wear:
    """Friction added at standstill, over Coulomb friction: `last` at the last cycle.

    One cycle before, it was less by the factor e^(1 / growth_cycles).
    """

    last: float
    growth_cycles: float

    def over(self, cycles: int) -> Floats:
        """Return the wear at each cycle, shape (cycles,)."""
        left = np.arange(cycles, dtype=np.float64) - cycles + 1.0
        return np.asarray(self.last * np.exp(left / self.growth_cycles))


COURSES = (Wear(4.0, 2.0), Wear(4.0, 3.0), Wear(4.0, 5.0), Wear(2.0, 3.0), Wear(1.0, 3.0))


def curves(seed: int, wear: Wear | None = None, cycles: int = CYCLES) -> Floats:
    """Return the friction curves of one history, shape (cycles, speeds)."""
    rng = np.random.default_rng(seed)
    joint = Joint()
    clean = joint.curves(np.full(cycles, 30.0), np.zeros(cycles), np.zeros(cycles))
    tilt = 0.03 * correlated(cycles, 0.5, rng)[:, None] * np.linspace(1.0, -0.5, SPEEDS.size)
    level = 0.005 * rng.standard_normal((cycles, 1))
    seen = clean * (1.0 + tilt + level + 0.005 * rng.standard_normal(clean.shape))
    if wear is not None:
        shape = np.exp(-SPEEDS / WEAR_SPEED_RAD_S)
        seen = seen + joint.coulomb_nm * wear.over(cycles)[:, None] * shape
    return seen


def history(seed: int, wear: Wear | None = None) -> FeatureSeries:
    """Return the features of one history."""
    return series_of(curves(seed, wear), HEALTHY)


def detectors() -> list[Detector]:
    """Return the thesis's detector in each of its readings, and the others."""
    readings = [
        Thesis(recursive=recursive, reset=reset)
        for recursive in (False, True)
        for reset in (True, False)
    ]
    others = [DETECTORS[w]() for w in ("3-sigma", "likelihood-ratio", "multi-model")]
    return [*readings, *others, Cusum()]


def normal_share(detector: Detector, seeds: Sequence[int]) -> tuple[float, float]:
    """Return the shares without fault throughout, and with Coulomb or viscous crossing in them."""
    quiet = crossing = 0
    for seed in seeds:
        judged = detector.judge(history(seed))
        fine = all(s is State.NO_FAULT for s in judged.states)
        pair = [judged.traces.get(name) for name in ("coulomb_nm", "viscous_nm_s_per_rad")]
        quiet += fine
        crossing += fine and any(
            t is not None and bool(np.any(t.statistic > t.threshold)) for t in pair
        )
    return quiet / len(seeds), crossing / len(seeds)


def breakdown_share(detector: Detector, wear: Wear, seeds: Sequence[int]) -> tuple[float, float]:
    """Return the shares with H0 at all, and with H1 and an H0 at least one cycle before it."""
    warned = ordered = 0
    for seed in seeds:
        judged = detector.judge(history(1000 + seed, wear))
        first, high = judged.first(State.INCREASED), judged.first(State.HIGH)
        warned += first is not None
        ordered += first is not None and high is not None and first < high
    return warned / len(seeds), ordered / len(seeds)


def main() -> None:
    """Print the tables, and draw where asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=Path, help="folder for the pictures")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    asked = parser.parse_args()
    seeds = range(asked.seeds)
    print(f"{asked.seeds} histories of {CYCLES} cycles each, baseline {HEALTHY}")
    print(
        "case 1: no fault (of these with a crossing of fc or fv); case 2, for each course of wear"
    )
    print(
        "(wear at breakdown / growth in cycles): H0 at all, H1 with an H0 at least one cycle before"
    )
    print(
        f"{'':28s} {'case 1':>12s} "
        + " ".join(f"{w.last:g}/{w.growth_cycles:g}".rjust(11) for w in COURSES)
    )
    for detector in detectors():
        quiet, crossing = normal_share(detector, seeds)
        cells = [breakdown_share(detector, wear, seeds) for wear in COURSES]
        print(
            f"{detector.name:28s} {quiet:5.0%} ({crossing:4.0%}) "
            + " ".join(f"{a:5.0%} {b:5.0%}" for a, b in cells),
            flush=True,
        )
    if asked.pictures is not None:
        draw(asked.pictures)


def draw(folder: Path) -> None:
    """Write the pictures of one history of each case, the first seed, in both readings."""
    from tests.benchmarks.monitor_case_figure import figure_case_study

    folder.mkdir(parents=True, exist_ok=True)
    for word, reading in (
        ("printed", Thesis()),
        ("recursive", Thesis(recursive=True, reset=False)),
    ):
        for case, seed, wear in (("normal", 0, None), ("breakdown", 1000, COURSES[1])):
            judged = reading.judge(history(seed, wear))
            figure = figure_case_study(SPEEDS, curves(seed, wear), judged)
            figure.savefig(folder / f"{case}-{word}.png", dpi=120)


if __name__ == "__main__":
    main()
