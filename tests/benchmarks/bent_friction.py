"""The rigid body beside friction that bends: ``python -m tests.benchmarks.bent_friction [cycles]``.

Simulated cycles of the thesis's two stairs (40 s) and of a designed one (20 s), on joints whose
friction falls with speed by 0.15 and 0.5 N m: what `estimate` finds of inertia, gravity and offset
beside the friction law. Errors and half intervals are in units of what `plan` expects.
"""

from __future__ import annotations

import argparse
import math
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np

from agent.identify.estimate import estimate
from tests.science.design_cycles import (
    BODY,
    Truth,
    belief,
    cycle,
    designed,
    noise,
    thesis_paired,
    thesis_stair,
)
from trajectories import Trajectory, expect
from trajectories.design_information import NORMAL_975

CYCLES, FIRST = 500, 620_000
FALLS_NM = (0.15, 0.5)


def found(trajectory: Trajectory, truth: Truth, seed: int) -> list[tuple[float, float]]:
    """Return error and half interval of every number of `BODY`; NaN where it is not identified."""
    body = estimate([cycle(trajectory, truth, seed)]).rigid_body
    out = []
    for name in BODY:
        parameter = None if body is None else body.parameters[name]
        if parameter is None or parameter.ci95 is None:
            out.append((math.nan, math.nan))
            continue
        low, high = parameter.ci95
        true = getattr(truth, name)
        # Intervals need not lie even about their value: the side that has to reach the truth counts
        half = high - parameter.value if parameter.value <= true else parameter.value - low
        out.append((parameter.value - true, half))
    return out


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cycles", type=int, nargs="?", default=CYCLES)
    parser.add_argument("--first", type=int, default=FIRST, help="first seed")
    asked = parser.parse_args()
    stairs = {
        "thesis 4.1.1, 40 s": thesis_stair(),
        "thesis 4.4.1, 40 s": thesis_paired(),
        "designed, 20 s": designed(20.0).trajectory,
    }
    seeds = range(asked.first, asked.first + asked.cycles)
    print(f"{asked.cycles} cycles each, seeds from {asked.first} on; {', '.join(BODY)}")
    with ProcessPoolExecutor(2) as pool:
        for fall_nm in FALLS_NM:
            truth = Truth(static_extra_nm=fall_nm)
            for name, stair in stairs.items():
                rows = list(pool.map(partial(found, stair, truth), seeds, chunksize=10))
                print(f"{fall_nm:g} N m, {name:<20}{_told(stair, truth, np.array(rows))}")


def _told(stair: Trajectory, truth: Truth, rows: np.ndarray) -> str:
    """Return error, bias, coverage and half intervals of ``rows``, shape (cycles, 4, 2)."""
    hoped = expect(stair, belief(truth), noise()).half_widths
    unit = np.array([hoped[name] for name in BODY])
    error, half = rows[..., 0], rows[..., 1]
    given = np.isfinite(error)

    def each(values: np.ndarray, form: str) -> str:
        return ", ".join(f"{value:{form}}" for value in values)

    own = error / (unit / NORMAL_975)
    return (
        f" given {given.mean():.3f}; rmse {each(np.sqrt(np.nanmean(own**2, axis=0)), '.2f')}; "
        f"bias {each(np.nanmean(own, axis=0), '+.2f')}; "
        f"held {each(100.0 * (np.abs(error) <= half)[given.all(axis=1)].mean(axis=0), '.1f')} %; "
        f"half {each(np.nanmean(half, axis=0) / unit, '.2f')}"
    )


if __name__ == "__main__":
    main()
