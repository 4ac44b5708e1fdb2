"""From one position to another in the least time that velocity, acceleration and jerk allow."""

from __future__ import annotations

import math

from trajectories.checks import finite, not_negative, positive
from trajectories.segment import Segment, ramp_times_s
from trajectories.trajectory import Trajectory


def peak_speed_for_distance(
    distance_rad: float, acceleration_rad_s2: float, jerk_rad_s3: float
) -> float:
    """Return the speed at which ramping up and straight down again covers `distance_rad`.

    With ``T(v)`` the time of a ramp to ``v``, the two ramps cover ``v T(v)``. Solved for ``v``:
    ``(d/2)^(2/3) J^(1/3)`` where the acceleration bound is not reached (``d <= 2 A^3/J^2``), else
    the positive root of ``v^2/A + v A/J = d``.
    """
    full_jerk_time_s = acceleration_rad_s2 / jerk_rad_s3
    if distance_rad <= 2.0 * acceleration_rad_s2 * full_jerk_time_s * full_jerk_time_s:
        return float((0.5 * distance_rad) ** (2.0 / 3.0) * jerk_rad_s3 ** (1.0 / 3.0))
    half_b = 0.5 * acceleration_rad_s2 * full_jerk_time_s
    product = acceleration_rad_s2 * distance_rad
    return product / (half_b + math.sqrt(half_b * half_b + product))


def peak_speed_for_time(time_s: float, acceleration_rad_s2: float, jerk_rad_s3: float) -> float:
    """Return the speed at which ramping up and straight down again takes `time_s`."""
    full_jerk_time_s = acceleration_rad_s2 / jerk_rad_s3
    if time_s <= 4.0 * full_jerk_time_s:
        return jerk_rad_s3 * (0.25 * time_s) ** 2
    return acceleration_rad_s2 * (0.5 * time_s - full_jerk_time_s)


def move_time_s(
    distance_rad: float, velocity_rad_s: float, acceleration_rad_s2: float, jerk_rad_s3: float
) -> float:
    """Return the least time from rest to rest over `distance_rad` (zero or more)."""
    if distance_rad == 0.0:
        return 0.0
    ramp_s, _ = ramp_times_s(velocity_rad_s, acceleration_rad_s2, jerk_rad_s3)
    if distance_rad >= velocity_rad_s * ramp_s:
        return distance_rad / velocity_rad_s + ramp_s
    peak = peak_speed_for_distance(distance_rad, acceleration_rad_s2, jerk_rad_s3)
    return 2.0 * ramp_times_s(peak, acceleration_rad_s2, jerk_rad_s3)[0]


def move(
    displacement_rad: float,
    velocity_rad_s: float,
    acceleration_rad_s2: float,
    jerk_rad_s3: float,
    *,
    evaluated: bool = False,
) -> tuple[Segment, ...]:
    """Return the segments of a minimum-time move from rest to rest; none for no distance.

    The bounds are the same for speeding up and slowing down, so the optimum is symmetric: the
    fastest ramp up, the top speed for as long as needed, the fastest ramp down; a short move lacks
    the middle.

    Parameters
    ----------
    displacement_rad : float
        Either sign.
    velocity_rad_s, acceleration_rad_s2, jerk_rad_s3 : float
        Bounds on the magnitudes, above zero.
    evaluated : bool
        Whether the stretch at top speed is a steady window or only leads somewhere.
    """
    distance = abs(displacement_rad)
    if distance == 0.0:
        return ()
    ramp_s, _ = ramp_times_s(velocity_rad_s, acceleration_rad_s2, jerk_rad_s3)
    hold_s = distance / velocity_rad_s - ramp_s
    if hold_s > 0.0:
        peak = math.copysign(velocity_rad_s, displacement_rad)
        middle = (Segment.steady if evaluated else Segment.transfer)(peak, hold_s)
    else:
        short = peak_speed_for_distance(distance, acceleration_rad_s2, jerk_rad_s3)
        peak = math.copysign(min(short, velocity_rad_s), displacement_rad)
        if peak == 0.0:  # closer than floating point can tell a motion
            return ()
        middle = None
    up = Segment.ramp(0.0, peak, acceleration_rad_s2, jerk_rad_s3)
    down = Segment.ramp(peak, 0.0, acceleration_rad_s2, jerk_rad_s3)
    return (up, down) if middle is None else (up, middle, down)


def point_to_point(
    from_rad: float,
    to_rad: float,
    *,
    velocity_rad_s: float,
    acceleration_rad_s2: float,
    jerk_rad_s3: float,
    rest_s: float = 0.0,
) -> Trajectory:
    """Return the fastest motion from one position to another.

    Parameters
    ----------
    from_rad, to_rad : float
        Motor positions; when they are equal the trajectory stays.
    velocity_rad_s, acceleration_rad_s2, jerk_rad_s3 : float
        Bounds on the magnitudes, above zero.
    rest_s : float
        Standstill before and after.

    Raises
    ------
    TrajectoryError
        An argument is not finite, or a bound is not above zero.
    """
    start, end = finite("from_rad", from_rad), finite("to_rad", to_rad)
    bounds = (
        positive("velocity_rad_s", velocity_rad_s),
        positive("acceleration_rad_s2", acceleration_rad_s2),
        positive("jerk_rad_s3", jerk_rad_s3),
    )
    rest = (Segment.rest(rest_s),) if not_negative("rest_s", rest_s) > 0.0 else ()
    segments = move(end - start, *bounds, evaluated=True)
    return Trajectory(
        "point-to-point",
        {
            "from_rad": start,
            "to_rad": end,
            "velocity_rad_s": bounds[0],
            "acceleration_rad_s2": bounds[1],
            "jerk_rad_s3": bounds[2],
            "rest_s": float(rest_s),
        },
        start,
        (*rest, *segments, *rest),
    )
