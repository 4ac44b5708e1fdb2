"""The search for the lowest minimum: from every start, and then from what that minimum leaves.

Starts that agree may agree on a wrong minimum. What the lowest one leaves of the torque is
therefore asked for a mode of its own (`agent.identify.flexible.rivals`); where it has one, the
search begins again from there, and a minimum that still leaves one is not called a joint.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from agent.identify.flexible.descent import Bounds, approach, bounds_of, descend
from agent.identify.flexible.modes import approach_chain, with_mode
from agent.identify.flexible.projection import Point, Problem
from agent.identify.flexible.result import Start
from agent.identify.flexible.rivals import Lack, lack_of
from agent.identify.flexible.spectra import frequency_range_hz
from agent.identify.result import Floats

_DECADES = 1.0  # to either side of the start values: two decades in all
_SAME = 1e-4  # relative difference of costs that one minimum may have
_AGAIN = 3  # how often what is left may send the search off again

Origin = Literal["frequency-response", "random", "residual"]


@dataclass(frozen=True)
class Found:
    """The lowest minimum.

    Parameters
    ----------
    point : Point
    lack : Lack
        What it lacks.
    starts : tuple of Start
        What came of every start.
    bounds : Bounds
        The box that was searched.
    """

    point: Point
    lack: Lack
    starts: tuple[Start, ...]
    bounds: Bounds


def lowest_minimum(problem: Problem, centres: Sequence[Floats], count: int, seed: int) -> Found:
    """Descend from every start and keep the lowest minimum.

    Parameters
    ----------
    problem : Problem
        With a chain.
    centres : sequence of ndarray
        Starts from the frequency response, the best first.
    count : int
        Starts, with one less than this at random about the first centre.
    seed : int
        Of the random ones.
    """
    box = bounds_of(problem, *frequency_range_hz(problem.stretches), problem.fastest_rad_s)
    toward = approach if problem.kind == "two-mass" else approach_chain
    ends: list[tuple[Origin, Point, bool]] = []

    def follow(origin: Origin, starts: Sequence[Floats]) -> None:
        for start in starts:
            known = min((point.cost for _, point, _ in ends), default=math.inf)
            ends.append((origin, *descend(problem, start, box, rival=known)))

    follow("frequency-response", centres)
    rng = np.random.default_rng(seed)
    reach = math.log(10.0) * _DECADES
    for _ in range(count - 1):
        start = centres[0].copy()
        start[:-1] += rng.uniform(-reach, reach, start.shape[0] - 1)
        follow("random", [toward(problem, start, box)])
    best = min((point for _, point, _ in ends), key=lambda p: p.cost)
    lack = lack_of(problem, best)
    for _ in range(_AGAIN):
        modes = [r.at_rad_s for r in lack.rivals if r.effect == "mode"]
        follow("residual", [s for w in modes for s in with_mode(problem, best.search, w, box)])
        lower = min((point for _, point, _ in ends), key=lambda p: p.cost)
        if lower.cost >= best.cost * (1.0 - _SAME):
            break
        best, lack = lower, lack_of(problem, lower)
    rows = best.residual.shape[0]
    starts = tuple(
        Start(origin, math.sqrt(point.cost / rows), _outcome(point, best, converged))
        for origin, point, converged in ends
    )
    return Found(best, lack, starts, box)


def _outcome(point: Point, best: Point, converged: bool) -> Literal["best", "local", "unfinished"]:
    if point.cost <= best.cost * (1.0 + _SAME):
        return "best"
    return "local" if converged else "unfinished"
