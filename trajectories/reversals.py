"""Reversals of halving amplitude: what shows presliding, hysteresis and backlash.

The joint swings to and fro about a centre, each pair of turns half as far as the one before, from
far beyond the gear's slack down to a fraction of it. Outside it, friction and gravity are those of
sliding; within it, the torque after a turn tells the spring of the contacts (presliding) and the
lost motion of the gear (backlash). Because the amplitudes halve, some pair of turns always lies
within a factor of two of the slack, however large that is.
"""

from __future__ import annotations

import math

from trajectories.checks import TrajectoryError, finite, not_negative, positive, whole
from trajectories.point_to_point import move
from trajectories.segment import Segment
from trajectories.trajectory import Trajectory


def reversals(
    centre_rad: float,
    amplitude_rad: float,
    *,
    halvings: int,
    velocity_rad_s: float,
    acceleration_rad_s2: float,
    jerk_rad_s3: float,
    swings: int = 1,
    rest_s: float = 0.0,
) -> Trajectory:
    """Return swings ``centre +- amplitude / 2^k``, ``k = 0 .. halvings``, and back to the centre.

    Parameters
    ----------
    centre_rad : float
        Motor position in the middle, where it starts and ends.
    amplitude_rad : float
        Of the first and largest swing, above zero.
    halvings : int
        How often the amplitude halves; zero or more.
    velocity_rad_s, acceleration_rad_s2, jerk_rad_s3 : float
        Bounds, above zero. A slow swing is driven at constant velocity between its turns; a short
        one turns before it reaches it.
    swings : int
        How often each amplitude is swung through.
    rest_s : float
        Standstill at the start, at every turn and at the end.

    Raises
    ------
    TrajectoryError
        An argument cannot be used, or the smallest swing is lost in floating point.
    """
    centre, largest = finite("centre_rad", centre_rad), positive("amplitude_rad", amplitude_rad)
    count, each = whole("halvings", halvings, 0), whole("swings", swings, 1)
    bounds = (
        positive("velocity_rad_s", velocity_rad_s),
        positive("acceleration_rad_s2", acceleration_rad_s2),
        positive("jerk_rad_s3", jerk_rad_s3),
    )
    rest = not_negative("rest_s", rest_s)
    smallest = math.ldexp(largest, -count)
    if centre + smallest == centre or not math.isfinite(centre + largest):
        raise TrajectoryError(
            f"{count} halvings lead from {largest:g} to {smallest:g} rad, which cannot be told "
            f"apart about a centre of {centre:g} rad"
        )
    pause = (Segment.rest(rest),) if rest > 0.0 else ()
    turns = [
        side * math.ldexp(largest, -k)
        for k in range(count + 1)
        for _ in range(each)
        for side in (1.0, -1.0)
    ]
    segments, here = [*pause], 0.0
    for turn in (*turns, 0.0):
        segments += [*move(turn - here, *bounds, evaluated=True), *pause]
        here = turn
    return Trajectory(
        "reversals",
        {
            "centre_rad": centre,
            "amplitude_rad": largest,
            "halvings": count,
            "swings": each,
            "velocity_rad_s": bounds[0],
            "acceleration_rad_s2": bounds[1],
            "jerk_rad_s3": bounds[2],
            "rest_s": rest,
        },
        centre,
        tuple(segments),
    )
