"""The stair between two positions (thesis 4.1.1): climb through rising speeds, come back mirrored.

One stroke leads out through rising steady speeds. The stroke back is the stroke out run backward in
time, so that each speed is passed in both directions over the very same positions, and gravity,
which depends on position alone, cancels in half the difference of the two torques (4.21).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from trajectories.checks import (
    ParameterValue,
    TrajectoryError,
    distinct_speeds,
    finite,
    not_negative,
    positive,
    whole,
)
from trajectories.segment import Segment, ramp_times_s
from trajectories.speeds import crossing
from trajectories.trajectory import Trajectory

RESTS = 3  # before, at the turn, after


@dataclass(frozen=True)
class _Climb:
    """The ramps of one stroke: from rest through every speed, upward, and back to rest."""

    acceleration_rad_s2: float
    jerk_rad_s3: float
    dwell_min_s: float

    def ramps(self, speeds: Sequence[float]) -> tuple[float, float]:
        """Return the time and the distance that the ramps take."""
        time_s, distance_rad, before = 0.0, 0.0, 0.0
        for speed in (*speeds, 0.0):
            ramp_s, _ = ramp_times_s(speed - before, self.acceleration_rad_s2, self.jerk_rad_s3)
            time_s += ramp_s
            distance_rad += 0.5 * (before + speed) * ramp_s
            before = speed
        return time_s, distance_rad

    def segments(self, speeds: Sequence[float], dwells_s: Sequence[float]) -> list[Segment]:
        """Return the stroke; speeds may be all positive or all negative."""
        out: list[Segment] = []
        before = 0.0
        for speed, dwell_s in zip(speeds, dwells_s, strict=True):
            out.append(Segment.ramp(before, speed, self.acceleration_rad_s2, self.jerk_rad_s3))
            out.append(Segment.steady(speed, dwell_s))
            before = speed
        out.append(Segment.ramp(before, 0.0, self.acceleration_rad_s2, self.jerk_rad_s3))
        return out


@dataclass(frozen=True)
class _Stroke:
    """What one stroke must meet, and the rest that its stair adds."""

    distance_rad: float
    time_s: float
    rest_s: float

    def whole_s(self, stroke_s: float) -> float:
        """Return the duration of a stair whose strokes take `stroke_s`."""
        return 2.0 * stroke_s + RESTS * self.rest_s


def stair_between(
    from_rad: float,
    to_rad: float,
    *,
    duration_s: float,
    acceleration_rad_s2: float,
    jerk_rad_s3: float,
    speeds_rad_s: Sequence[float] | None = None,
    steps: int = 10,
    scale_speeds: bool = False,
    dwell_min_s: float = 0.2,
    rest_s: float = 0.5,
) -> Trajectory:
    """Return a stair that meets both its stroke and its duration.

    Two conditions need two freedoms. Without `speeds_rad_s` the speeds are ``k/steps`` of a top
    speed, each held equally long: top speed and dwell are the freedoms. With `speeds_rad_s` the
    speeds are kept and each is held for ``dwell_min_s + c v^-p``: ``c`` and ``p`` are the freedoms,
    so that slow speeds are held longer just as far as the mean speed asks for it. `scale_speeds`
    takes given speeds as a pattern and treats them like the first case.

    Parameters
    ----------
    from_rad, to_rad : float
        Motor positions of the two ends; it starts and ends at the first.
    duration_s : float
        The whole duration, rests included.
    acceleration_rad_s2, jerk_rad_s3 : float
        Bounds of the ramps, above zero.
    speeds_rad_s : sequence of float, optional
        Speeds above zero, no two alike; they are climbed in rising order.
    steps : int
        How many speeds when none are given: a stair of ``2 * steps`` steady velocities.
    scale_speeds : bool
        Take `speeds_rad_s` as a pattern only.
    dwell_min_s : float
        No speed is held for less.
    rest_s : float
        Standstill before, at the turn and after.

    Raises
    ------
    TrajectoryError
        An argument cannot be used, or the two conditions cannot be met; the message says what
        would be needed.
    """
    start, end = finite("from_rad", from_rad), finite("to_rad", to_rad)
    if start == end:
        raise TrajectoryError(f"a stair needs two positions, got {start:g} rad twice")
    duration, rest = positive("duration_s", duration_s), not_negative("rest_s", rest_s)
    climb = _Climb(
        positive("acceleration_rad_s2", acceleration_rad_s2),
        positive("jerk_rad_s3", jerk_rad_s3),
        positive("dwell_min_s", dwell_min_s),
    )
    number = whole("steps", steps, 1)
    pattern = (
        tuple(k / number for k in range(1, number + 1))
        if speeds_rad_s is None
        else tuple(sorted(distinct_speeds("speeds_rad_s", speeds_rad_s)))
    )
    fit = _scaled if speeds_rad_s is None or scale_speeds else _kept
    stroke = _Stroke(abs(end - start), 0.5 * (duration - RESTS * rest), rest)
    speeds, dwells_s = fit(climb, pattern, stroke)
    out = climb.segments([math.copysign(v, end - start) for v in speeds], dwells_s)
    pause = [Segment.rest(rest)] if rest > 0.0 else []
    parameters: dict[str, ParameterValue] = {
        "from_rad": start,
        "to_rad": end,
        "duration_s": duration,
        "acceleration_rad_s2": climb.acceleration_rad_s2,
        "jerk_rad_s3": climb.jerk_rad_s3,
        "speeds_rad_s": speeds,
        "dwell_min_s": climb.dwell_min_s,
        "rest_s": rest,
    }
    back = [segment.reversed() for segment in reversed(out)]
    segments = (*pause, *out, *pause, *back, *pause)
    return Trajectory("stair-between", parameters, start, segments)


def _scaled(
    climb: _Climb, pattern: Sequence[float], stroke: _Stroke
) -> tuple[tuple[float, ...], list[float]]:
    """Find the top speed at which equal dwells meet distance and time."""
    shape = [v / pattern[-1] for v in pattern]
    count, dwell_min_s = len(shape), climb.dwell_min_s

    def at(top: float) -> list[float]:
        return [top * v for v in shape]

    def distance(top: float) -> float:
        ramps_s, ramps_rad = climb.ramps(at(top))
        return ramps_rad + (stroke.time_s - ramps_s) / count * sum(at(top))

    spare_s = stroke.time_s - count * dwell_min_s
    top = 0.0
    if spare_s > 0.0:
        # A top speed beyond a T cannot be reached in T, whatever the jerk.
        beyond = climb.acceleration_rad_s2 * spare_s
        top = crossing(lambda v: climb.ramps(at(v))[0] - spare_s, 0.0, beyond)
    if top == 0.0 or distance(top) < stroke.distance_rad:
        # The last ramp alone covers v^2 / 2a or more: a bracket for the shortest stair.
        beyond = math.sqrt(2.0 * climb.acceleration_rad_s2 * stroke.distance_rad)
        shortest = crossing(
            lambda v: climb.ramps(at(v))[1] + dwell_min_s * sum(at(v)) - stroke.distance_rad,
            0.0,
            beyond,
        )
        needed_s = climb.ramps(at(shortest))[0] + count * dwell_min_s
        raise TrajectoryError(
            f"a stair of {count} speeds over {stroke.distance_rad:g} rad, each held for at least "
            f"{dwell_min_s:g} s, needs a duration of at least {stroke.whole_s(needed_s):.3f} s, "
            f"got {stroke.whole_s(stroke.time_s):g} s"
        )
    top = crossing(lambda v: distance(v) - stroke.distance_rad, 0.0, top)
    speeds = tuple(at(top))
    return speeds, [(stroke.time_s - climb.ramps(speeds)[0]) / count] * count


def _kept(
    climb: _Climb, pattern: Sequence[float], stroke: _Stroke
) -> tuple[tuple[float, ...], list[float]]:
    """Find dwells ``dwell_min + c v^-p`` that meet distance and time at the given speeds."""
    speeds = tuple(pattern)
    ramps_s, ramps_rad = climb.ramps(speeds)
    least_s = ramps_s + len(speeds) * climb.dwell_min_s
    least_rad = ramps_rad + climb.dwell_min_s * sum(speeds)
    spare_rad = stroke.distance_rad - least_rad
    spare_s = stroke.time_s - least_s
    if spare_rad <= 0.0:
        raise TrajectoryError(
            f"a stair up to {speeds[-1]:g} rad/s with each of {len(speeds)} speeds held for at "
            f"least {climb.dwell_min_s:g} s needs a stroke of more than {least_rad:.2f} rad, "
            f"got {stroke.distance_rad:g} rad"
        )
    shortest_s, longest_s = (least_s + spare_rad / v for v in (speeds[-1], speeds[0]))
    if not shortest_s < stroke.time_s < longest_s:
        raise TrajectoryError(
            f"at speeds from {speeds[0]:g} to {speeds[-1]:g} rad/s, a stair over "
            f"{stroke.distance_rad:g} rad lasts between {stroke.whole_s(shortest_s):.3f} s and "
            f"{stroke.whole_s(longest_s):.3f} s (both excluded), "
            f"got {stroke.whole_s(stroke.time_s):g} s; "
            f"change the duration or the speeds, or let scale_speeds fit them"
        )
    mean = spare_rad / spare_s
    bound = 1.0  # doubled until it brackets; speeds alike to the last digits never are
    while bound < 1e15 and (
        _mean_speed(speeds, bound) > mean or _mean_speed(speeds, -bound) < mean
    ):
        bound *= 2.0
    power = crossing(lambda p: mean - _mean_speed(speeds, p), -bound, bound)
    weights = _weights(speeds, power)
    return speeds, [climb.dwell_min_s + spare_s * w for w in weights]


def _weights(speeds: Sequence[float], power: float) -> list[float]:
    """Return ``v^-p``, normed to a sum of one; the largest is factored out against overflow."""
    exponents = [-power * math.log(v) for v in speeds]
    largest = max(exponents)
    raw = [math.exp(e - largest) for e in exponents]
    return [w / sum(raw) for w in raw]


def _mean_speed(speeds: Sequence[float], power: float) -> float:
    return sum(w * v for w, v in zip(_weights(speeds, power), speeds, strict=True))
