"""The search for the grey box's minimum: Levenberg and Marquardt's method in a box, from one start.

A lightly damped chain leaves the cost flat but for a narrow valley at its resonance, which a start
elsewhere cannot see. With dampers heavy enough the valley is as wide as the data's band: every
start first finds its frequency there, and is then let go.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.flexible.projection import Point, Problem, evaluate
from agent.identify.flexible.slopes import slopes
from agent.identify.flexible.straight import bend_of, stepped
from agent.identify.result import Floats

CONVERGED = 1e-9
"""Relative fall of the cost at which a minimum is found."""

_ITERATIONS = 60
_LONGEST_DELAY = 0.005  # s
_LONGEST_STEP = 0.7  # of a logarithm: a factor of two
_HEAVY = (1.5, 0.3)  # damping ratios of the approach, one after the other
_FIRST_STEP, _FINER_STEP, _LAST_STEP = 0.7, 0.2, 0.1  # of a frequency's logarithm


@dataclass(frozen=True)
class Bounds:
    """Where the search may go: lower and upper ends, shape (s,)."""

    lower: Floats
    upper: Floats

    def clip(self, search: Floats) -> Floats:
        """Return the nearest point inside."""
        return np.clip(search, self.lower, self.upper)


def bounds_of(problem: Problem, low_hz: float, high_hz: float, fastest_rad_s: float) -> Bounds:
    """Return the box that the searched parameters must stay in.

    Frequencies may leave the range that the data can show by a factor of four, so that a start
    outside finds its way in; the delay is at most 5 ms: what reports its torque later than that
    needs its channels aligned first.
    """
    lower: list[float] = []
    upper: list[float] = []
    for _ in range(problem.shape_size // 2):
        lower += [np.log(2.0 * np.pi * low_hz / 4.0), np.log(1e-4)]
        upper += [np.log(2.0 * np.pi * high_hz * 4.0), np.log(5.0)]
    if problem.shape_size % 2:
        lower.append(-6.0)
        upper.append(6.0)
    for r in problem.law.ranges:
        ends = r.bounds(fastest_rad_s / 300.0, fastest_rad_s)
        lower.append(float(np.log(ends[0])))
        upper.append(float(np.log(ends[1])))
    return Bounds(np.array([*lower, -_LONGEST_DELAY]), np.array([*upper, _LONGEST_DELAY]))


def approach(problem: Problem, start: Floats, bounds: Bounds) -> Floats:
    """Return a start whose frequencies were found with heavy dampers: see the module.

    The dampers' own start values are given up; all others but the frequencies are kept. The search
    compares costs alone: far from the valley the slope says where it is, but not how far.
    """
    search = bounds.clip(start)
    frequencies = 2 * np.arange(problem.shape_size // 2)
    step = _FIRST_STEP
    for ratio in _HEAVY:
        search[frequencies + 1] = np.log(ratio)
        cost = evaluate(problem, search).cost
        while step > _LAST_STEP:
            trials = np.repeat(search[np.newaxis], 2 * frequencies.shape[0], axis=0)
            trials[np.arange(trials.shape[0]), np.repeat(frequencies, 2)] += np.tile(
                [step, -step], frequencies.shape[0]
            )
            costs = [evaluate(problem, bounds.clip(t)).cost for t in trials]
            best = int(np.argmin(costs))
            if costs[best] < cost:
                search, cost = bounds.clip(trials[best]), costs[best]
            else:
                step *= 0.5
        step = _FINER_STEP
    return search


def descend(
    problem: Problem,
    start: Floats,
    bounds: Bounds,
    free: NDArray[np.bool_] | None = None,
    enough: float = CONVERGED,
    rival: float = math.inf,
) -> tuple[Point, bool]:
    """Return the minimum that a start leads to, and whether the descent converged.

    Parameters
    ----------
    problem : Problem
    start : ndarray, shape (s,)
    bounds : Bounds
    free : ndarray of bool, shape (s,), optional
        What is searched; the rest stays where it is.
    enough : float
        Relative fall of the cost at which the search ends.
    rival : float
        Cost of a minimum that is known already. A descent that would stay above it, did it go on
        falling as fast to its last step, is given up.
    """
    free = np.ones(start.shape[0], dtype=np.bool_) if free is None else free
    point, damping = evaluate(problem, bounds.clip(start)), 1e-3
    for left in reversed(range(_ITERATIONS)):
        slope = slopes(problem, point, free) @ bend_of(problem.kind, point.search)
        slope = slope[:, free]
        # Kaufman: what the linear part can take over does not count; what is held at zero cannot.
        columns = point.columns[:, ~problem.held(point.linear)]
        taken = np.linalg.lstsq(columns.T @ columns, columns.T @ slope, rcond=1e-13)[0]
        slope = slope - columns @ taken
        gram, gradient = slope.T @ slope, slope.T @ point.residual
        scale = np.maximum(np.diag(gram), 1e-12 * float(np.max(np.diag(gram))) + 1e-300)
        better: Point | None = None
        while better is None and damping < 1e8:
            step = np.zeros(free.shape[0])
            step[free] = -np.linalg.solve(gram + damping * np.diag(scale), gradient)
            step[:-1] = np.clip(step[:-1], -_LONGEST_STEP, _LONGEST_STEP)
            trial = evaluate(problem, bounds.clip(stepped(problem.kind, point.search, step)))
            if trial.cost < point.cost:
                better = trial
                damping = max(damping / 8.0, 1e-9)
            else:
                damping *= 6.0
        if better is None:
            return point, True
        fall, point = point.cost - better.cost, better
        if fall < enough * (point.cost + fall):
            return point, True
        if point.cost - left * fall > rival:
            return point, False
    return point, False
