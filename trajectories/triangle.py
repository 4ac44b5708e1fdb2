"""A periodic triangle wave of velocity: the excitation for a flexible joint (thesis 4.2.1).

Between its corners the acceleration is constant, so the spring is loaded and let go at every
corner: a broad, repeatable excitation that crosses standstill only twice a period, where dry
friction would blur it. Because all periods are alike they can be averaged, which leaves the motion
and divides the noise by the root of their number.
"""

from __future__ import annotations

from collections.abc import Iterator

from trajectories.checks import TrajectoryError, finite, not_negative, positive, whole
from trajectories.segment import Segment, ramp_times_s
from trajectories.trajectory import Trajectory

MAX_PERIODS = 10_000


def triangle(
    start_rad: float,
    *,
    peak_velocity_rad_s: float,
    acceleration_rad_s2: float,
    jerk_rad_s3: float,
    periods: int = 10,
    offset_velocity_rad_s: float = 0.0,
    rest_s: float = 0.5,
) -> Trajectory:
    """Return a triangle wave of velocity between ``offset - peak`` and ``offset + peak``.

    A lead-in ramp goes from rest to the lower corner, `periods` equal periods follow, and a
    lead-out ramp returns to rest. A period is one ramp up and one ramp down; its mean velocity is
    the offset, so that without an offset the motor ends every period where it began.

    Parameters
    ----------
    start_rad : float
        Motor position before the motion.
    peak_velocity_rad_s : float
        Amplitude of the triangle, above zero.
    acceleration_rad_s2, jerk_rad_s3 : float
        Slope of the triangle, and how fast it turns at a corner; above zero. A high jerk is what
        excites the spring.
    periods : int
        How many periods are repeated; at least 1.
    offset_velocity_rad_s : float
        Mean velocity. Its magnitude above `peak_velocity_rad_s` avoids standstill altogether, and
        costs stroke.
    rest_s : float
        Standstill before and after.

    Raises
    ------
    TrajectoryError
        An argument cannot be used.
    """
    start, offset = finite("start_rad", start_rad), finite("offset", offset_velocity_rad_s)
    peak = positive("peak_velocity_rad_s", peak_velocity_rad_s)
    bounds = (
        positive("acceleration_rad_s2", acceleration_rad_s2),
        positive("jerk_rad_s3", jerk_rad_s3),
    )
    rest = not_negative("rest_s", rest_s)
    count = whole("periods", periods, 1)
    if count > MAX_PERIODS:
        raise TrajectoryError(f"periods must be at most {MAX_PERIODS}, got {count}")
    low, high = offset - peak, offset + peak
    if low == high:
        raise TrajectoryError(f"a peak of {peak:g} rad/s is lost beside an offset of {offset:g}")
    pause = (Segment.rest(rest),) if rest > 0.0 else ()
    period = (Segment.ramp(low, high, *bounds), Segment.ramp(high, low, *bounds))
    return Trajectory(
        "triangle",
        {
            "start_rad": start,
            "peak_velocity_rad_s": peak,
            "acceleration_rad_s2": bounds[0],
            "jerk_rad_s3": bounds[1],
            "periods": count,
            "offset_velocity_rad_s": offset,
            "rest_s": rest,
            "period_s": triangle_period_s(peak, *bounds),
            "first_period_s": rest + sum(s.duration_s for s in _lead(0.0, low, bounds)),
        },
        start,
        (*pause, *_lead(0.0, low, bounds), *period * count, *_lead(low, 0.0, bounds), *pause),
    )


def triangle_period_s(
    peak_velocity_rad_s: float, acceleration_rad_s2: float, jerk_rad_s3: float
) -> float:
    """Return how long one period of the wave lasts."""
    return 2.0 * ramp_times_s(2.0 * peak_velocity_rad_s, acceleration_rad_s2, jerk_rad_s3)[0]


def _lead(start: float, end: float, bounds: tuple[float, float]) -> Iterator[Segment]:
    """Yield the ramp between rest and the lower corner; none where the corner is at rest."""
    if start != end:
        yield Segment.ramp(start, end, *bounds)
