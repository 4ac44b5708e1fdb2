"""The best stair for an axis, its limits and a time: optimal experiment design.

Robot downtime is what a check costs. `design_stair` chooses the speeds, how long each is held, in
which order, and in how many strokes, so that the estimates of the friction law and of the rigid
body are as certain as the time allows (criterion: `trajectories.design_search`; what a given
motion is worth: `trajectories.design_information`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from trajectories.checks import (
    ParameterValue,
    TrajectoryError,
    finite,
    not_negative,
    positive,
)
from trajectories.design_information import Belief, Expectation, TorqueNoise, expect
from trajectories.design_layout import Layout, Room
from trajectories.design_search import GRID_RATIO, Problem, fits, search
from trajectories.extrema import TorqueModel
from trajectories.limits import AxisLimits, check, margins
from trajectories.segment import Segment
from trajectories.speeds import crossing
from trajectories.trajectory import Trajectory

NAME = "stair-designed"
_SPARE = 3  # speeds beyond the law's parameters, so that the fit can contradict the law
_SPEEDS_MAX = 16
_SHRINKS = 8
_MORE = 1.05  # a little more than what a stop overran
_LONG_S = 3600.0
_FAR = 1e4


@dataclass(frozen=True)
class DesignRequest:
    """What a stair may use, and what is thought of the joint.

    Parameters
    ----------
    from_rad, to_rad : float
        Ends of the stroke that may be used, motor side.
    duration_s : float
        The time budget, rests included.
    speed_min_rad_s, speed_max_rad_s : float
        Between them the speeds are chosen, the first below the second.
    acceleration_rad_s2, jerk_rad_s3 : float
        Bounds of the ramps.
    limits : AxisLimits
        Never exceeded, stopping distance included.
    belief, noise : Belief, TorqueNoise
        The joint and the torque signal as they are thought to be.
    torque_model : TorqueModel, optional
        For the torque limit.
    dwell_min_s, settle_s, rest_s : float
        No speed is held for less; lost at the start of every dwell, while the drive's loop and a
        soft arm settle; standstill between strokes.
    """

    from_rad: float
    to_rad: float
    duration_s: float
    speed_min_rad_s: float
    speed_max_rad_s: float
    acceleration_rad_s2: float
    jerk_rad_s3: float
    limits: AxisLimits
    belief: Belief
    noise: TorqueNoise
    torque_model: TorqueModel | None = None
    dwell_min_s: float = 0.5
    settle_s: float = 0.2
    rest_s: float = 0.1

    def __post_init__(self) -> None:
        for name in ("from_rad", "to_rad"):
            finite(name, getattr(self, name))
        for name in (
            "duration_s",
            "speed_min_rad_s",
            "speed_max_rad_s",
            "acceleration_rad_s2",
            "jerk_rad_s3",
            "dwell_min_s",
        ):
            positive(name, getattr(self, name))
        for name in ("settle_s", "rest_s"):
            not_negative(name, getattr(self, name))
        if self.from_rad == self.to_rad:
            raise TrajectoryError(f"a stair needs two positions, got {self.from_rad:g} rad twice")
        if self.dwell_min_s <= self.settle_s:
            raise TrajectoryError(
                f"dwell_min_s must be longer than settle_s, got {self.dwell_min_s:g} and "
                f"{self.settle_s:g} s"
            )
        if self.speed_min_rad_s >= self.speed_max_rad_s:
            raise TrajectoryError(
                f"speed_min_rad_s must lie below speed_max_rad_s, got {self.speed_min_rad_s:g} "
                f"and {self.speed_max_rad_s:g}"
            )

    @property
    def speeds_min(self) -> int:
        """The fewest different speeds: three more than the friction law has parameters."""
        return len(self.belief.friction_names) + _SPARE


@dataclass(frozen=True)
class DesignedStair:
    """The stair and what it is expected to tell.

    `criterion` is half the mean log-determinant of the scaled information: one more means that
    the product of all intervals is smaller by the factor e.
    """

    trajectory: Trajectory
    expectation: Expectation
    criterion: float


def design_stair(request: DesignRequest) -> DesignedStair:
    """Return the best stair that was found.

    Raises
    ------
    TrajectoryError
        No stair fits; the message says what would be needed.
    """
    request = _within_limits(request)
    low, high = _window(request)
    sentence = ""
    for _ in range(_SHRINKS):
        trajectory, criterion = _best(request, low, high)
        excesses = check(trajectory, request.limits, request.torque_model)
        if not excesses:
            seen = expect(trajectory, request.belief, request.noise, settle_s=request.settle_s)
            return DesignedStair(trajectory, seen, criterion)
        # Only a stop from speed, which no ramp shows, can still lead out of the position limits.
        sentence = excesses[0].sentence
        for m in margins(trajectory, request.limits):
            over = _MORE * max(-m.remaining, 0.0) if m.quantity == "position" else 0.0
            low, high = (low + over, high) if m.is_lower else (low, high - over)
        if low >= high:
            break
    raise TrajectoryError(f"no stair fits the axis's limits: {sentence}")


def _within_limits(request: DesignRequest) -> DesignRequest:
    """Lower speed, acceleration and jerk to what the axis may do, its torque included."""
    limits, model = request.limits, request.torque_model
    fastest = min(request.speed_max_rad_s, limits.velocity_max_rad_s)
    acceleration = min(request.acceleration_rad_s2, limits.acceleration_max_rad_s2)
    if fastest <= request.speed_min_rad_s:
        raise TrajectoryError(
            f"the slowest speed asked for, {request.speed_min_rad_s:g} rad/s, is not below the "
            f"axis's limit of {fastest:g} rad/s: a stair needs slower speeds"
        )
    if model is not None:
        sliding_nm = model.magnitude_nm(fastest, 0.0)
        left_nm = limits.torque_max_nm - sliding_nm
        if left_nm <= 0.0:
            raise TrajectoryError(
                f"{fastest:g} rad/s alone needs {sliding_nm:.2f} N m, and the axis may use "
                f"{limits.torque_max_nm:g} N m: a lower top speed would be needed"
            )
        if model.inertia_kg_m2 > 0.0:
            acceleration = min(acceleration, left_nm / model.inertia_kg_m2)
    return replace(
        request,
        speed_max_rad_s=fastest,
        acceleration_rad_s2=acceleration,
        jerk_rad_s3=min(request.jerk_rad_s3, limits.jerk_max_rad_s3),
    )


def _window(request: DesignRequest) -> tuple[float, float]:
    """Return the positions that may be used: those asked for, inside the limits."""
    limits = request.limits
    low = max(min(request.from_rad, request.to_rad), limits.position_min_rad)
    high = min(max(request.from_rad, request.to_rad), limits.position_max_rad)
    if low >= high:
        raise TrajectoryError(
            f"the stroke from {request.from_rad:g} to {request.to_rad:g} rad lies outside the "
            f"position limits of {limits.position_min_rad:g} and {limits.position_max_rad:g} rad"
        )
    return low, high


def _best(request: DesignRequest, low: float, high: float) -> tuple[Trajectory, float]:
    """Return the best stair between two positions, and its criterion."""
    problem = _problem(request, high - low, request.duration_s)
    found = None if problem is None else search(problem)
    layout = None if problem is None or found is None else problem.layout(found[0])
    if problem is None or found is None or layout is None:
        raise TrajectoryError(_what_is_needed(request, high - low))
    direction = math.copysign(1.0, request.to_rad - request.from_rad)
    # Centred: where strokes are shorter than the window, they keep clear of both ends.
    middle = 0.5 * (low + high)
    start_rad = middle - 0.5 * direction * max(layout.distances_rad(problem.room))
    trajectory = Trajectory(
        NAME,
        _parameters(request, layout, problem.room),
        start_rad,
        _repeated(layout.segments(problem.room, direction), request),
    )
    return trajectory, found[1]


def _repeated(segments: tuple[Segment, ...], request: DesignRequest) -> tuple[Segment, ...]:
    """Drive a stair again and again where the stroke, not the time, has cut its dwells."""
    pause = segments[:1] if request.rest_s > 0.0 else ()
    rest_s = request.rest_s if pause else 0.0
    once_s = sum(s.duration_s for s in segments) - rest_s
    times = max(1, math.floor((request.duration_s - rest_s) / once_s * (1.0 + 1e-9)))
    return pause + segments[len(pause) :] * times


def _problem(request: DesignRequest, stroke_rad: float, duration_s: float) -> Problem | None:
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
    direction = math.copysign(1.0, request.to_rad - request.from_rad)
    centre = 0.5 * (request.from_rad + request.to_rad)
    return Problem(
        room=room,
        grid_rad_s=np.geomspace(slowest, fastest, count),
        belief=request.belief,
        noise=request.noise,
        start_rad=centre - 0.5 * direction * stroke_rad,
        direction=direction,
        settle_s=request.settle_s,
        speeds_min=request.speeds_min,
        speeds_max=max(_SPEEDS_MAX, request.speeds_min),
    )


def _what_is_needed(request: DesignRequest, stroke_rad: float) -> str:
    """Say which time, or else which stroke, a stair would need."""

    def lacking(stroke_rad: float, duration_s: float) -> float:
        problem = _problem(request, stroke_rad, duration_s)
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
