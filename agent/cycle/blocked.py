"""What to look at where the motor pushes hard and the joint does not follow.

The gate says which limit was passed. Whoever stands before the joint wants to know where to look: a
holding brake that stays closed, or closes in motion, shows in nothing else that a drive reports.
But a joint whose position moves stands at no brake, whatever its velocity says.
"""

from __future__ import annotations

from agent.cycle.gate import GateLimits
from drivers.ports import Sample

STANDS_RAD_S = 1.0
HARD = 0.8
"""Share of the torque limit from which on a joint is pushed hard."""


def blocked(
    limits: GateLimits,
    asked_rad_s: float,
    sample: Sample,
    unlike_rad_s: tuple[float, float] | None = None,
) -> str:
    """Return what to look at, in one sentence; "" where nothing seems to hold the joint.

    Parameters
    ----------
    limits : GateLimits
        The axis's limits.
    asked_rad_s : float
        The velocity that was asked for, motor side.
    sample : Sample
        The newest measured sample.
    unlike_rad_s : (float, float), optional
        The latest velocity by positions and by itself, where they have no scale in common.
    """
    if unlike_rad_s is not None:
        shown, told = (f"{speed:.3g} rad/s" for speed in unlike_rad_s)
        return (
            f"By its position the joint moved with {shown}, by its velocity with {told}: see that "
            "velocity_unit and encoder_counts_per_motor_rev are what the drive counts in."
        )
    towards = (asked_rad_s - sample.velocity_rad_s) * sample.torque_nm
    if not (towards > 0.0 and abs(sample.torque_nm) >= HARD * limits.torque_max_nm):
        return ""
    pushed = f"although the motor pushes it with {abs(sample.torque_nm):.1f} N m"
    if abs(sample.velocity_rad_s) <= STANDS_RAD_S:
        return f"The joint stands {pushed}: see whether its holding brake opens, or what blocks it."
    return f"The joint lags {pushed}: see whether its holding brake closes, or what it runs into."
