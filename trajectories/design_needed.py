"""What there is to choose from in a stroke and a time, and what is needed where that is nothing."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from trajectories.checks import TrajectoryError
from trajectories.design_layout import Layout, Room, Stroke
from trajectories.design_problem import GRID_RATIO, Problem
from trajectories.design_request import DesignRequest
from trajectories.design_search import fits
from trajectories.speeds import crossing
from trajectories.stair import stair_between
from trajectories.trajectory import Trajectory

PLAIN_LONGER = 2.0
"""A designed stair is held to what a plain one tells in this many times its time."""

_SPEEDS_MAX = 16
_LONG_S = 3600.0
_FAR = 1e4


def problem_of(request: DesignRequest, stroke_rad: float, duration_s: float) -> Problem | None:
    """Return the search's problem; None where there are too few speeds to choose from."""
    room = Room(
        stroke_rad,
        duration_s,
        request.acceleration_rad_s2,
        request.jerk_rad_s3,
        request.dwell_min_s,
        request.rest_s,
    )
    slowest, fastest = request.speed_min_rad_s, request.speed_max_rad_s
    if room.stroke_for_rad(fastest) > stroke_rad:
        fastest = crossing(lambda v: room.stroke_for_rad(v) - stroke_rad, 0.0, fastest)
    if fastest <= slowest:
        return None
    count = 1 + math.floor(math.log(fastest / slowest) / math.log(GRID_RATIO))
    if count < request.speeds_min:
        return None
    return Problem(
        room=room,
        grid_rad_s=np.geomspace(slowest, fastest, count),
        belief=request.belief,
        noise=request.noise,
        centre_rad=0.5 * (request.from_rad + request.to_rad),
        direction=math.copysign(1.0, request.to_rad - request.from_rad),
        settle_s=request.settle_s,
        speeds_min=request.speeds_min,
        speeds_max=max(_SPEEDS_MAX, request.speeds_min),
        plain=_laid_out(plain_stair(request, stroke_rad, duration_s)),
    )


def plain_stair(request: DesignRequest, stroke_rad: float, duration_s: float) -> Trajectory | None:
    """Return the stair of ten rising speeds (thesis 4.1.1) that a designed one is held to.

    None where the stroke has no such stair in `PLAIN_LONGER` times the duration, or the axis no
    such speed.
    """
    direction = math.copysign(1.0, request.to_rad - request.from_rad)
    reach_rad = 0.5 * direction * stroke_rad
    centre = 0.5 * (request.from_rad + request.to_rad)
    try:
        stair = stair_between(
            centre - reach_rad,
            centre + reach_rad,
            duration_s=PLAIN_LONGER * duration_s,
            acceleration_rad_s2=request.acceleration_rad_s2,
            jerk_rad_s3=request.jerk_rad_s3,
        )
    except TrajectoryError:
        return None
    fastest = max(abs(w.velocity_rad_s) for w in stair.steady_windows())
    return stair if fastest <= request.speed_max_rad_s else None


def _laid_out(stair: Trajectory | None) -> Layout | None:
    """Return the stair's way out as a layout."""
    if stair is None:
        return None
    windows = stair.steady_windows()
    way = windows[: len(windows) // 2]
    speeds = tuple(abs(w.velocity_rad_s) for w in way)
    return Layout((Stroke(speeds, tuple(w.end_s - w.start_s for w in way)),))


def what_is_needed(request: DesignRequest, stroke_rad: float) -> str:
    """Say which time, or else which stroke, a stair would need."""

    def lacking(stroke_rad: float, duration_s: float) -> float:
        problem = problem_of(request, stroke_rad, duration_s)
        return -1.0 if problem is None or not fits(problem) else 1.0

    what = (
        f"a stair of {request.speeds_min} speeds from {request.speed_min_rad_s:g} rad/s on, each "
        f"held for at least {request.dwell_min_s:g} s in both directions,"
    )
    if lacking(stroke_rad, _LONG_S) > 0.0:
        needed_s = _just_enough(lambda t: lacking(stroke_rad, t), request.duration_s, _LONG_S)
        enough_s = math.ceil(10.0 * needed_s) / 10.0
        return f"{what} needs at least {enough_s:.1f} s on this axis, got {request.duration_s:g} s"
    far_rad = stroke_rad
    while lacking(far_rad, _LONG_S) < 0.0:
        far_rad *= 2.0
        if far_rad > _FAR * stroke_rad:
            return (
                f"{what} needs speeds of up to {GRID_RATIO ** (request.speeds_min - 1):.2g} times "
                f"the slowest, got up to {request.speed_max_rad_s:g} rad/s"
            )
    needed_rad = _just_enough(lambda x: lacking(x, _LONG_S), stroke_rad, far_rad)
    enough_rad = math.ceil(100.0 * needed_rad) / 100.0
    return f"{what} needs a stroke of at least {enough_rad:.2f} rad (motor), got {stroke_rad:.2f}"


def _just_enough(lacking: Callable[[float], float], low: float, high: float) -> float:
    """Return the least of what suffices, to a hundredth of it."""
    while high > low * 1.01:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if lacking(middle) > 0.0 else (middle, high)
    return high
