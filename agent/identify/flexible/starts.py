"""Start values from the frequency response, without a start value of their own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from agent.identify.flexible.chain import Kind
from agent.identify.flexible.descent import CONVERGED, bounds_of, descend
from agent.identify.flexible.modes import second_mode_starts
from agent.identify.flexible.projection import Point, Problem, evaluate
from agent.identify.flexible.spectra import frequency_range_hz, frequency_response, start_shapes
from agent.identify.result import Floats

_ROUGHLY = 1e-4  # relative fall of the cost: where a joint swings, a rigid body is a start alone


def rigid_minimum(problem: Problem, enough: float = CONVERGED) -> Point:
    """Return the rigid body, fitted like the flexible joint, until the cost falls no more."""
    box = bounds_of(problem, 1.0, 1.0, problem.fastest_rad_s)
    start = np.zeros(problem.search_size)
    start[:-1] = _friction_start(problem)
    return descend(problem, start, box, enough=enough)[0]


def _friction_start(problem: Problem) -> Floats:
    """Return a start for friction's searched parameters: the middle of their ranges."""
    fastest = problem.fastest_rad_s
    ends = [r.bounds(fastest / 300.0, fastest) for r in problem.law.ranges]
    return np.array([0.5 * (math.log(a) + math.log(b)) for a, b in ends])


def starts_of(rigid: Problem, kind: Kind) -> list[Floats]:
    """Return starts of the search from the frequency response, friction taken out, best first."""
    point = rigid_minimum(rigid, _ROUGHLY)
    inertia, *others = point.linear
    rest, row = [], 0
    columns = rigid.all_columns(point.search)
    for p in rigid.stretches:
        own = columns[row : row + p.torque_nm.shape[0]]
        row += own.shape[0]
        # About standstill nobody knows friction: a gap there would ring at all frequencies.
        rest.append(np.where(p.usable, p.torque_nm - own[:, 1:] @ others, own[:, 0] * inertia))
    one = replace(rigid, kind="two-mass")
    shapes = start_shapes(*frequency_response(rigid.stretches, rest))
    starts = [np.concatenate((shape, point.search)) for shape in shapes]
    start = min(starts, key=lambda s: evaluate(one, s).cost)
    if kind == "two-mass":
        return [start]
    # One swinging mass first; then second modes that explain most beside it.
    low_hz, high_hz = frequency_range_hz(rigid.stretches)
    box = bounds_of(one, low_hz, high_hz, one.fastest_rad_s)
    known = descend(one, start, box)[0].search
    return second_mode_starts(one, known, low_hz, high_hz)
