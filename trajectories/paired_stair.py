"""The paired stair (thesis 4.4.1): each speed passed to and fro over one window of positions.

Every speed is a point-to-point move out and the same move back, both centred on the validation
position, where forward and backward torque are later compared at equal gravity. A fast pass is
short because the stroke ends, a slow one because time does: one common dwell, cut for each speed
to what the stroke allows, is chosen so that the whole lasts as long as was asked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from trajectories.checks import (
    ParameterValue,
    TrajectoryError,
    distinct_speeds,
    finite,
    not_negative,
    positive,
)
from trajectories.point_to_point import move, move_time_s
from trajectories.segment import Segment, ramp_times_s
from trajectories.speeds import crossing
from trajectories.trajectory import Trajectory


@dataclass(frozen=True)
class _Plan:
    """Everything but the common dwell."""

    speeds_rad_s: tuple[float, ...]
    acceleration_rad_s2: float
    jerk_rad_s3: float
    room_rad: float  # from the validation position to the nearer end
    rest_s: float

    def ramp_s(self, speed: float) -> float:
        return ramp_times_s(speed, self.acceleration_rad_s2, self.jerk_rad_s3)[0]

    def longest_dwell_s(self, speed: float) -> float:
        """Return how long the room allows the speed to be held; negative when it is not reached."""
        return 2.0 * self.room_rad / speed - self.ramp_s(speed)

    def dwell_s(self, speed: float, common_s: float) -> float:
        return min(common_s, self.longest_dwell_s(speed))

    def half_stroke_rad(self, speed: float, dwell_s: float) -> float:
        """Return how far from the validation position a pass starts: half a dwell and a ramp."""
        return 0.5 * speed * (dwell_s + self.ramp_s(speed))

    def half_strokes_rad(self, common_s: float) -> list[float]:
        # Passes cut by the stroke all start at its end, bit for bit: no transfer between them.
        return [
            self.room_rad
            if common_s >= self.longest_dwell_s(v)
            else self.half_stroke_rad(v, common_s)
            for v in self.speeds_rad_s
        ]

    def transfer(self, displacement_rad: float) -> tuple[Segment, ...]:
        """Return the move to where the next speed's pass starts."""
        top = max(self.speeds_rad_s)
        return move(displacement_rad, top, self.acceleration_rad_s2, self.jerk_rad_s3)

    def duration_s(self, common_s: float) -> float:
        """Return how long the whole lasts with a common dwell."""
        halves = self.half_strokes_rad(common_s)
        top = max(self.speeds_rad_s)
        passes = sum(
            2.0 * (self.dwell_s(v, common_s) + 2.0 * self.ramp_s(v)) for v in self.speeds_rad_s
        )
        transfers = sum(
            move_time_s(abs(b - a), top, self.acceleration_rad_s2, self.jerk_rad_s3)
            for a, b in pairwise(halves)
        )
        return passes + transfers + (2 * len(halves) + 1) * self.rest_s

    def segments(self, common_s: float, direction: float) -> tuple[Segment, ...]:
        """Return rest, then for each speed: out, rest, back, transfer to the next, rest."""
        pause = (Segment.rest(self.rest_s),) if self.rest_s > 0.0 else ()
        halves = self.half_strokes_rad(common_s)
        nexts = (*halves[1:], halves[-1])
        out: list[Segment] = [*pause]
        for speed, here, there in zip(self.speeds_rad_s, halves, nexts, strict=True):
            forward = _pass(self, direction * speed, self.dwell_s(speed, common_s))
            backward = tuple(segment.reversed() for segment in reversed(forward))
            out += [*forward, *pause, *backward, *self.transfer(direction * (here - there)), *pause]
        return tuple(out)


def stair_paired(
    from_rad: float,
    to_rad: float,
    *,
    speeds_rad_s: Sequence[float],
    duration_s: float,
    acceleration_rad_s2: float,
    jerk_rad_s3: float,
    validation_position_rad: float | None = None,
    dwell_min_s: float = 0.2,
    rest_s: float = 0.1,
) -> Trajectory:
    """Return a stair that passes every speed forward and backward over the same positions.

    Parameters
    ----------
    from_rad, to_rad : float
        Ends of the stroke that may be used; forward is from the first to the second.
    speeds_rad_s : sequence of float
        Speeds above zero, no two alike, in the order in which to visit them (see
        `spaced_speeds`); n speeds make 2 n steady velocities.
    duration_s : float
        The whole duration, rests included. The dwells are as long as it allows; where the stroke
        ends every dwell before the time is used up, the stair is shorter.
    acceleration_rad_s2, jerk_rad_s3 : float
        Bounds of the ramps, above zero.
    validation_position_rad : float, optional
        Centre of every window; the middle of the stroke unless given.
    dwell_min_s : float
        No speed is held for less.
    rest_s : float
        Standstill at the start and after every pass.

    Raises
    ------
    TrajectoryError
        An argument cannot be used; a speed cannot be reached and held within the stroke; or the
        duration is too short. The message says what would be needed.
    """
    start, end = finite("from_rad", from_rad), finite("to_rad", to_rad)
    low, high = min(start, end), max(start, end)
    centre = (
        0.5 * (low + high)
        if validation_position_rad is None
        else finite("validation_position_rad", validation_position_rad)
    )
    if not low < centre < high:
        raise TrajectoryError(
            f"validation_position_rad must lie between {low:g} and {high:g} rad, got {centre:g}"
        )
    plan = _Plan(
        distinct_speeds("speeds_rad_s", speeds_rad_s),
        positive("acceleration_rad_s2", acceleration_rad_s2),
        positive("jerk_rad_s3", jerk_rad_s3),
        min(centre - low, high - centre),
        not_negative("rest_s", rest_s),
    )
    duration, shortest_s = positive("duration_s", duration_s), positive("dwell_min_s", dwell_min_s)
    common_s = _common_dwell_s(plan, duration, shortest_s)
    direction = math.copysign(1.0, end - start)
    parameters: dict[str, ParameterValue] = {
        "from_rad": start,
        "to_rad": end,
        "speeds_rad_s": plan.speeds_rad_s,
        "duration_s": duration,
        "acceleration_rad_s2": plan.acceleration_rad_s2,
        "jerk_rad_s3": plan.jerk_rad_s3,
        "validation_position_rad": centre,
        "dwell_min_s": shortest_s,
        "rest_s": plan.rest_s,
    }
    first = centre - direction * plan.half_strokes_rad(common_s)[0]
    return Trajectory("stair-paired", parameters, first, plan.segments(common_s, direction))


def _common_dwell_s(plan: _Plan, duration_s: float, dwell_min_s: float) -> float:
    """Return the common dwell that meets the duration, or say why there is none."""
    for speed in plan.speeds_rad_s:
        if plan.longest_dwell_s(speed) < dwell_min_s:
            needed = 2.0 * plan.half_stroke_rad(speed, dwell_min_s)
            reachable = crossing(
                lambda v: plan.half_stroke_rad(v, dwell_min_s) - plan.room_rad, 0.0, speed
            )
            raise TrajectoryError(
                f"to reach {speed:g} rad/s and hold it for {dwell_min_s:g} s a pass needs "
                f"{needed:.2f} rad about the validation position, and there are "
                f"{2.0 * plan.room_rad:.2f} rad; at most {reachable:.2f} rad/s can be held there"
            )
    least_s = plan.duration_s(dwell_min_s)
    if least_s > duration_s:
        raise TrajectoryError(
            f"{len(plan.speeds_rad_s)} speeds, each passed twice and held for at least "
            f"{dwell_min_s:g} s, need a duration of at least {least_s:.3f} s, got {duration_s:g} s"
        )
    longest_s = max(plan.longest_dwell_s(v) for v in plan.speeds_rad_s)
    if plan.duration_s(longest_s) <= duration_s:
        return longest_s
    return crossing(lambda d: plan.duration_s(d) - duration_s, dwell_min_s, longest_s)


def _pass(plan: _Plan, velocity_rad_s: float, dwell_s: float) -> tuple[Segment, ...]:
    bounds = plan.acceleration_rad_s2, plan.jerk_rad_s3
    return (
        Segment.ramp(0.0, velocity_rad_s, *bounds),
        Segment.steady(velocity_rad_s, dwell_s),
        Segment.ramp(velocity_rad_s, 0.0, *bounds),
    )
