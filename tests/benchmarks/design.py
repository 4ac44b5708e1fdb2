"""What a stair is worth: ``python -m tests.benchmarks.design [cycles] [first]``.

Simulated cycles of the thesis's two stairs (40 s) and of designed ones (20 s, 10 s, and what a
paired stair's friction takes), estimated by the product; the spread of every parameter about the
truth, how often it was identified, what had been expected, and the generalised variance.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np

from tests.science.design_cycles import (
    BODY,
    LAW,
    Truth,
    belief,
    designed,
    found,
    noise,
    thesis_paired,
    thesis_stair,
)
from trajectories import Trajectory, expect
from trajectories.design_information import NORMAL_975

CYCLES = 200
RISE_NM = 0.02
NAMES = (*LAW, "exponent", *BODY)
_FEWEST = 0.5


def main(cycles: int, first: int) -> None:
    """Run all cycles and print the tables."""
    stairs = {
        "thesis 4.1.1, 40 s": thesis_stair(),
        "thesis 4.4.1, 40 s": thesis_paired(),
        "designed, 28 s": designed(28.0).trajectory,
        "designed, 20 s": designed(20.0).trajectory,
        "designed, 10 s": designed(10.0).trajectory,
    }
    healthy, later = range(first, first + cycles), range(first + cycles, first + 2 * cycles)
    with ProcessPoolExecutor(2) as pool:
        runs = {
            name: list(pool.map(partial(found, stair, Truth()), healthy, chunksize=10))
            for name, stair in stairs.items()
        }
        risen = Truth(coulomb_nm=Truth().coulomb_nm + RISE_NM)
        after = {
            name: list(pool.map(partial(found, stairs[name], risen), later, chunksize=10))
            for name in ("designed, 20 s", "designed, 10 s")
        }
    print(f"{cycles} simulated cycles each, seeds from {first} on\n")
    _spreads(stairs, runs)
    _volumes(runs)
    _each(runs)
    for name, found_later in after.items():
        _rise(name, stairs[name], runs[name], found_later)


def _spreads(stairs: dict[str, Trajectory], runs: dict[str, list[dict[str, float]]]) -> None:
    """Print root mean square errors where identified, how often, and what was expected."""
    print("rms error (times identified; expected standard error)")
    for parameter in NAMES:
        truth = getattr(Truth(), parameter)
        print(f"  {parameter}, true {truth:g}")
        for name, stair in stairs.items():
            given = sum(math.isfinite(run[parameter]) for run in runs[name])
            error = rms(runs[name], parameter)
            hoped = expect(stair, belief(), noise()).half_widths[parameter] / NORMAL_975
            print(f"    {name:<20} {error:10.3g}  ({given:4d}; {hoped:.3g})")


def _volumes(runs: dict[str, list[dict[str, float]]]) -> None:
    """Print the generalised standard deviation: det(covariance about the truth)^(1/2p)."""
    print("\ngeneralised standard deviation against the designed stair of 20 s")
    for what, names in (("friction law", LAW), ("rigid body", BODY), ("both", (*LAW, *BODY))):
        own = _volume(runs["designed, 20 s"], names)
        shares = [f"{name}: {_volume(run, names) / own:.2f}" for name, run in runs.items()]
        print(f"  {what:<13} {'; '.join(shares)}")


def _each(runs: dict[str, list[dict[str, float]]]) -> None:
    """Print every parameter's root mean square error over that of the designed stair of 20 s."""
    print("\neach parameter's rms error over that of the designed stair of 20 s")
    for parameter in (*LAW, *BODY):
        errors = {name: rms(run, parameter) for name, run in runs.items()}
        own = errors["designed, 20 s"]
        shares = [f"{name}: {error / own:.2f}" for name, error in errors.items()]
        print(f"  {parameter:<24} {'; '.join(shares)}")


def rms(run: list[dict[str, float]], parameter: str) -> float:
    """Return a parameter's root mean square error; infinite where it is mostly not identified."""
    error = np.array([one[parameter] for one in run]) - getattr(Truth(), parameter)
    there = np.isfinite(error)
    return float(np.sqrt(np.mean(error[there] ** 2))) if np.mean(there) >= _FEWEST else math.inf


def _volume(run: list[dict[str, float]], names: Sequence[str]) -> float:
    truth = np.array([getattr(Truth(), name) for name in names])
    values = np.array([[one[name] for name in names] for one in run])
    complete = values[np.all(np.isfinite(values), axis=1)]
    if complete.shape[0] < _FEWEST * values.shape[0]:
        return math.inf  # a parameter that is mostly not identified has no finite covariance
    scaled = (complete - truth) / truth
    moment = scaled.T @ scaled / scaled.shape[0]
    return float(math.exp(np.linalg.slogdet(moment)[1] / (2 * len(names))))


def _rise(
    name: str,
    stair: Trajectory,
    before: list[dict[str, float]],
    after: list[dict[str, float]],
) -> None:
    """Print how often a rise is seen, and how often one that is not there."""
    visible_nm = expect(stair, belief(), noise()).visible_rise_nm
    error_nm = visible_nm / ((1.96 + 0.84) * math.sqrt(2.0))
    limit_nm = 1.96 * math.sqrt(2.0) * error_nm
    old = np.array([run["level_nm"] for run in before])
    new = np.array([run["level_nm"] for run in after])
    seen = np.mean(np.abs(new - old) > limit_nm)
    # A rise just visible: the same noise, less of the rise.
    barely = np.mean(np.abs(new - RISE_NM + visible_nm - old) > limit_nm)
    false = np.mean(np.abs(old[1:] - old[:-1]) > limit_nm)
    print(
        f"\n{name}: a rise of {1e3 * RISE_NM:.0f} mN m is seen in {100 * seen:.0f} % of pairs, "
        f"one of {1e3 * visible_nm:.1f} mN m in {100 * barely:.0f} % (80 % expected); "
        f"false alarms {100 * false:.0f} % (5 % expected)"
    )


if __name__ == "__main__":
    given = [int(one) for one in sys.argv[1:]]
    main(*given, *(CYCLES, 0)[len(given) :])
