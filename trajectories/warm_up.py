"""Strokes to and fro at a fraction of top speed, so that the gear is warm before it is measured."""

from __future__ import annotations

import math

from trajectories.checks import TrajectoryError, finite, not_negative, positive
from trajectories.point_to_point import move, move_time_s, peak_speed_for_time
from trajectories.segment import Segment, ramp_times_s
from trajectories.trajectory import Trajectory

MAX_ROUND_TRIPS = 10_000  # days of warming; more is a mistyped duration


def warm_up(
    from_rad: float,
    to_rad: float,
    *,
    duration_s: float,
    top_speed_rad_s: float,
    fraction: float = 0.5,
    acceleration_rad_s2: float,
    jerk_rad_s3: float,
    rest_s: float = 0.2,
) -> Trajectory:
    """Return round trips that last exactly `duration_s` and end where they began.

    As few equal round trips as fill the time at the wanted speed are made, each as far toward
    `to_rad` as the time then allows; the speed is kept and the stroke gives way.

    Parameters
    ----------
    from_rad, to_rad : float
        Motor positions: where the strokes start, and how far they may go.
    duration_s : float
        How long to move, all rests included.
    top_speed_rad_s, fraction : float
        The strokes run at ``fraction * top_speed_rad_s``; 0 < fraction <= 1.
    acceleration_rad_s2, jerk_rad_s3 : float
        Bounds on the magnitudes, above zero.
    rest_s : float
        Standstill after every stroke.

    Raises
    ------
    TrajectoryError
        An argument cannot be used, or the duration does not hold a single round trip.
    """
    start, end = finite("from_rad", from_rad), finite("to_rad", to_rad)
    duration, rest = positive("duration_s", duration_s), not_negative("rest_s", rest_s)
    share = positive("fraction", fraction)
    if share > 1.0:
        raise TrajectoryError(f"fraction must be at most 1, got {share:g}")
    if start == end:
        raise TrajectoryError(f"a warm-up needs two positions, got {start:g} rad twice")
    bounds = (
        share * positive("top_speed_rad_s", top_speed_rad_s),
        positive("acceleration_rad_s2", acceleration_rad_s2),
        positive("jerk_rad_s3", jerk_rad_s3),
    )
    round_trip_s = 2.0 * (move_time_s(abs(end - start), *bounds) + rest)
    # The allowance keeps a duration that is a whole number of round trips from gaining one more.
    trips = max(1, math.ceil(duration / round_trip_s * (1.0 - 1e-12)))
    if trips > MAX_ROUND_TRIPS:
        raise TrajectoryError(
            f"{duration:g} s hold {trips} round trips of {round_trip_s:g} s; at most "
            f"{MAX_ROUND_TRIPS} are made: shorten duration_s or lengthen the stroke"
        )
    stroke_s = duration / (2 * trips) - rest
    if stroke_s <= 0.0:
        raise TrajectoryError(
            f"duration_s must exceed the rests of one round trip, {2.0 * rest:g} s, "
            f"got {duration:g} s"
        )
    distance = min(_distance_in(stroke_s, *bounds), abs(end - start))
    stroke = move(math.copysign(distance, end - start), *bounds, evaluated=True)
    pause = (Segment.rest(rest),) if rest > 0.0 else ()
    back = tuple(segment.reversed() for segment in reversed(stroke))
    return Trajectory(
        "warm-up",
        {
            "from_rad": start,
            "to_rad": end,
            "duration_s": duration,
            "top_speed_rad_s": float(top_speed_rad_s),
            "fraction": share,
            "acceleration_rad_s2": bounds[1],
            "jerk_rad_s3": bounds[2],
            "rest_s": rest,
        },
        start,
        (*stroke, *pause, *back, *pause) * trips,
    )


def _distance_in(
    time_s: float, velocity_rad_s: float, acceleration_rad_s2: float, jerk_rad_s3: float
) -> float:
    """Return how far the fastest move from rest to rest leads in `time_s`."""
    ramp_s, _ = ramp_times_s(velocity_rad_s, acceleration_rad_s2, jerk_rad_s3)
    if time_s >= 2.0 * ramp_s:
        return velocity_rad_s * (time_s - ramp_s)
    return 0.5 * time_s * peak_speed_for_time(time_s, acceleration_rad_s2, jerk_rad_s3)
