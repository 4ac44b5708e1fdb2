"""The best stair for an axis, its limits and a time: optimal experiment design.

Robot downtime is what a check costs. `design_stair` chooses the speeds, how long each is held, in
which order, and in how many strokes, so that the estimates of the friction law and of the rigid
body are as certain as the time allows (criterion: `trajectories.design_problem`; what a given
motion is worth: `trajectories.design_information`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from trajectories.checks import ParameterValue, TrajectoryError
from trajectories.design_information import Expectation, expect
from trajectories.design_layout import Layout, Room, Strokes
from trajectories.design_needed import plain_stair, problem_of, what_is_needed
from trajectories.design_order import search
from trajectories.design_request import DesignRequest, window, within_limits
from trajectories.limits import check, margins
from trajectories.segment import Segment
from trajectories.trajectory import Trajectory

NAME = "stair-designed"
_SHRINKS = 8
_MORE = 1.05  # a little more than what a stop overran


@dataclass(frozen=True)
class DesignedStair:
    """The stair and what it is expected to tell.

    Parameters
    ----------
    trajectory : Trajectory
    expectation : Expectation
        What one run of it tells.
    criterion : float
        Half the mean log-determinant of the scaled information: one more means that the product
        of all intervals is smaller by the factor e.
    plain_s : float, optional
        Duration of the stair of ten rising speeds (thesis 4.1.1) beside which no number was to be
        worse; None where the axis has none.
    plain : Expectation, optional
        What one run of that stair tells.
    """

    trajectory: Trajectory
    expectation: Expectation
    criterion: float
    plain_s: float | None = None
    plain: Expectation | None = None


def design_stair(request: DesignRequest) -> DesignedStair:
    """Return the best stair that was found.

    Raises
    ------
    TrajectoryError
        No stair fits; the message says what would be needed.
    """
    request = within_limits(request)
    low, high = window(request)
    sentence, order = "", None
    for _ in range(_SHRINKS):
        trajectory, criterion, order = _best(request, low, high, order)
        excesses = check(trajectory, request.limits, request.torque_model)
        if not excesses:
            plain = plain_stair(request, high - low, request.duration_s)
            return DesignedStair(
                trajectory,
                _seen(request, trajectory),
                criterion,
                None if plain is None else plain.duration_s,
                None if plain is None else _seen(request, plain),
            )
        # Only a stop from speed, which no ramp shows, can still lead out of the position limits.
        sentence = excesses[0].sentence
        for m in margins(trajectory, request.limits):
            over = _MORE * max(-m.remaining, 0.0) if m.quantity == "position" else 0.0
            low, high = (low + over, high) if m.is_lower else (low, high - over)
        if low >= high:
            break
    raise TrajectoryError(f"no stair fits the axis's limits: {sentence}")


def _seen(request: DesignRequest, trajectory: Trajectory) -> Expectation:
    return expect(trajectory, request.belief, request.noise, settle_s=request.settle_s)


def _best(
    request: DesignRequest, low: float, high: float, order: Strokes | None
) -> tuple[Trajectory, float, Strokes]:
    """Return the best stair between two positions, its criterion, and the order it stands on.

    An order that is given was the best in a little more room: it is kept where it still fits.
    """
    problem = problem_of(request, high - low, request.duration_s)
    if problem is None:
        raise TrajectoryError(what_is_needed(request, high - low))
    found = order if order is not None and problem.has(order) else search(problem)
    layout = None if found is None else problem.layout(found)
    if found is None or layout is None:
        raise TrajectoryError(what_is_needed(request, high - low))
    direction = math.copysign(1.0, request.to_rad - request.from_rad)
    # Centred: where strokes are shorter than the window, they keep clear of both ends.
    start_rad = layout.start_rad(problem.room, 0.5 * (low + high), direction)
    trajectory = Trajectory(
        NAME,
        _parameters(request, layout, problem.room),
        start_rad,
        _repeated(layout.segments(problem.room, direction), request),
    )
    return trajectory, problem.worth(found), found


def _repeated(segments: tuple[Segment, ...], request: DesignRequest) -> tuple[Segment, ...]:
    """Drive a stair again and again where the stroke, not the time, has cut its dwells."""
    pause = segments[:1] if request.rest_s > 0.0 else ()
    rest_s = request.rest_s if pause else 0.0
    once_s = sum(s.duration_s for s in segments) - rest_s
    times = max(1, math.floor((request.duration_s - rest_s) / once_s * (1.0 + 1e-9)))
    return pause + segments[len(pause) :] * times


def _parameters(request: DesignRequest, layout: Layout, room: Room) -> dict[str, ParameterValue]:
    return {
        "from_rad": request.from_rad,
        "to_rad": request.to_rad,
        "duration_s": request.duration_s,
        "acceleration_rad_s2": room.acceleration_rad_s2,
        "jerk_rad_s3": room.jerk_rad_s3,
        "speeds_rad_s": tuple(layout.speeds_rad_s.tolist()),
        "dwells_s": tuple(layout.dwells_s.tolist()),
        "speeds_a_stroke": tuple(float(len(s.speeds_rad_s)) for s in layout.strokes),
        "rest_s": room.rest_s,
    }
