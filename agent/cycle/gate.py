"""The gate: the one place through which a set-point passes on its way to a drive.

Default deny: a set-point passes only when every condition is *shown* to hold. A number that is
NaN, stale or unknown shows nothing, so it refuses. The gate never clips: it refuses, and the
interlock stops the joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

from drivers.ports import DriveState, Move, Sample

# Set-points come from closed forms in float64; their rounding must not refuse what is exactly
# at a limit. One part in 1e9 is far below anything that a drive resolves.
ROUNDING = 1e-9


@dataclass(frozen=True)
class GateLimits:
    """What a set-point and the measured state may not exceed; motor side.

    Parameters
    ----------
    velocity_max_rad_s, acceleration_max_rad_s2 : float
        Absolute limit and rate limit of the set-point.
    position_min_rad, position_max_rad : float
        Window that must hold the joint *including its stopping distance*.
    stopping_deceleration_rad_s2, reaction_time_s : float
        How hard the drive brakes, and how long it may take until it does.
    velocity_error_max_rad_s, following_error_max_rad : float
        Distance of the set-points from the measured velocity and position.
    torque_max_nm : float
        Measured motor torque.
    temperature_min_degc, temperature_max_degc : float
        Gearbox temperature.
    temperature_required : bool
        Whether a missing temperature refuses.
    sample_age_max_s : float
        How old the newest sample may be.
    """

    velocity_max_rad_s: float
    acceleration_max_rad_s2: float
    position_min_rad: float
    position_max_rad: float
    stopping_deceleration_rad_s2: float
    reaction_time_s: float
    velocity_error_max_rad_s: float
    following_error_max_rad: float
    torque_max_nm: float
    temperature_min_degc: float
    temperature_max_degc: float
    temperature_required: bool
    sample_age_max_s: float

    def stopping_distance_rad(self, velocity_rad_s: float) -> float:
        """Return how far the joint still goes from `velocity_rad_s`, in radians, at most."""
        speed = abs(velocity_rad_s)
        return speed * self.reaction_time_s + speed * speed / (
            2.0 * self.stopping_deceleration_rad_s2
        )


class Asked(NamedTuple):
    """What had been asked for when a sample was taken; motor side."""

    velocity_rad_s: float
    position_rad: float


@dataclass(frozen=True)
class SetPoint:
    """What the plan asks for in this tick, and what was sent in the tick before.

    `previous_position_rad` is None for a drive that is fed with velocities alone: its position
    set-point is then what the plan reckons with, and nothing that is sent. `answered` is what the
    newest sample is compared with: on a ramp an answer that comes some ticks late is no
    following error. None compares it with what is wanted now.
    """

    velocity_rad_s: float
    position_rad: float
    previous_velocity_rad_s: float
    step_s: float  # since the previous set-point was sent
    previous_position_rad: float | None = None
    answered: Asked | None = None


def refusals(
    limits: GateLimits, wanted: SetPoint, sample: Sample | None, now_s: float
) -> tuple[str, ...]:
    """Return every reason against sending `wanted`; empty means that it may pass.

    Parameters
    ----------
    limits : GateLimits
        The axis's limits.
    wanted : SetPoint
        The set-point, motor side.
    sample : Sample or None
        The newest measured sample; None refuses.
    now_s : float
        The injected clock's present time.
    """
    if sample is None:
        return ("nothing has been measured yet",)
    unknown = _not_finite(wanted, sample, now_s)
    if unknown:
        return unknown
    return (
        *_set_point_refusals(limits, wanted),
        *_position_refusals(limits, wanted),
        *_following_refusals(limits, wanted, sample),
        *_state_refusals(limits, sample, now_s),
    )


def _not_finite(wanted: SetPoint, sample: Sample, now_s: float) -> tuple[str, ...]:
    numbers = {
        "the velocity set-point": wanted.velocity_rad_s,
        "the position set-point": wanted.position_rad,
        "the previous velocity set-point": wanted.previous_velocity_rad_s,
        "the time since the previous set-point": wanted.step_s,
        "the present time": now_s,
        "the sample's time": sample.time_s,
        "the measured position": sample.position_rad,
        "the measured velocity": sample.velocity_rad_s,
        "the measured torque": sample.torque_nm,
    }
    if wanted.previous_position_rad is not None:
        numbers["the previous position set-point"] = wanted.previous_position_rad
    if wanted.answered is not None:
        numbers["the answered velocity set-point"] = wanted.answered.velocity_rad_s
        numbers["the answered position set-point"] = wanted.answered.position_rad
    return tuple(
        f"{name} is not a number ({value})"
        for name, value in numbers.items()
        if not isfinite(value)
    )


def _set_point_refusals(limits: GateLimits, wanted: SetPoint) -> tuple[str, ...]:
    found = []
    velocity = wanted.velocity_rad_s
    if not abs(velocity) <= limits.velocity_max_rad_s * (1.0 + ROUNDING):
        found.append(
            f"the velocity set-point of {velocity:.2f} rad/s exceeds the limit of "
            f"{limits.velocity_max_rad_s:.2f} rad/s"
        )
    step = velocity - wanted.previous_velocity_rad_s
    allowed = limits.acceleration_max_rad_s2 * wanted.step_s
    if not (wanted.step_s >= 0.0 and abs(step) <= allowed * (1.0 + ROUNDING) + ROUNDING):
        found.append(
            f"the velocity set-point would jump by {step:.3f} rad/s in "
            f"{wanted.step_s * 1e3:.1f} ms; the acceleration limit of "
            f"{limits.acceleration_max_rad_s2:.0f} rad/s2 allows {max(allowed, 0.0):.3f} rad/s"
        )
    return tuple(found)


def _position_refusals(limits: GateLimits, wanted: SetPoint) -> tuple[str, ...]:
    """Return what is wrong with a position that is sent: its step, and where it leads."""
    if wanted.previous_position_rad is None:
        return ()
    found = []
    step = wanted.position_rad - wanted.previous_position_rad
    allowed = limits.velocity_max_rad_s * wanted.step_s
    if not abs(step) <= allowed * (1.0 + ROUNDING) + ROUNDING:
        found.append(
            f"the position set-point would jump by {step:.3f} rad in {wanted.step_s * 1e3:.1f} ms; "
            f"the velocity limit of {limits.velocity_max_rad_s:.2f} rad/s allows "
            f"{max(allowed, 0.0):.3f} rad"
        )
    reason = _leaves_window(limits, wanted.position_rad, wanted.velocity_rad_s)
    if not reason and step != 0.0:
        reason = _outside(limits, wanted.position_rad, step)
    return (*found, reason) if reason else tuple(found)


def move_refusals(limits: GateLimits, move: Move) -> tuple[str, ...]:
    """Return every reason against a move that the drive's own profile would make.

    Whatever happens to us then, the joint ends where the move does: inside the window, or it is
    not offered. On its way each tick's set-point is judged as any other.
    """
    if not (isfinite(move.position_rad) and isfinite(move.velocity_rad_s)):
        return (f"a move to {move.position_rad} rad at {move.velocity_rad_s} rad/s is no move",)
    found = []
    if not 0.0 < move.velocity_rad_s <= limits.velocity_max_rad_s * (1.0 + ROUNDING):
        found.append(
            f"the move's speed of {move.velocity_rad_s:.2f} rad/s is not within "
            f"(0, {limits.velocity_max_rad_s:.2f}] rad/s"
        )
    if not limits.position_min_rad <= move.position_rad <= limits.position_max_rad:
        found.append(
            f"the move would end at {move.position_rad:.2f} rad, outside "
            f"[{limits.position_min_rad:.2f}, {limits.position_max_rad:.2f}] rad"
        )
    return tuple(found)


def _outside(limits: GateLimits, position_rad: float, step_rad: float) -> str:
    """Return why a position may not be stepped to: it is outside, and the step leads further."""
    inside = (
        position_rad <= limits.position_max_rad
        if step_rad > 0.0
        else position_rad >= limits.position_min_rad
    )
    if inside:
        return ""
    return (
        f"the position set-point of {position_rad:.2f} rad is outside "
        f"[{limits.position_min_rad:.2f}, {limits.position_max_rad:.2f}] rad"
    )


def _following_refusals(limits: GateLimits, wanted: SetPoint, sample: Sample) -> tuple[str, ...]:
    found = []
    asked = wanted if wanted.answered is None else wanted.answered
    velocity_error = asked.velocity_rad_s - sample.velocity_rad_s
    if not abs(velocity_error) <= limits.velocity_error_max_rad_s:
        found.append(
            f"the measured velocity of {sample.velocity_rad_s:.2f} rad/s is "
            f"{abs(velocity_error):.2f} rad/s from its set-point; the limit is "
            f"{limits.velocity_error_max_rad_s:.2f} rad/s"
        )
    position_error = asked.position_rad - sample.position_rad
    if not abs(position_error) <= limits.following_error_max_rad:
        found.append(
            f"the measured position is {abs(position_error):.2f} rad from its set-point; the limit "
            f"is {limits.following_error_max_rad:.2f} rad"
        )
    # Whichever of command and measurement is faster decides how far the joint still goes.
    for velocity in (wanted.velocity_rad_s, sample.velocity_rad_s):
        reason = _leaves_window(limits, sample.position_rad, velocity)
        if reason:
            return (*found, reason)
    return tuple(found)


def _leaves_window(limits: GateLimits, position_rad: float, velocity_rad_s: float) -> str:
    """Return why a joint with this velocity could not be stopped inside its window, or "".

    Only the end that the joint moves towards counts, so that a joint which stands outside may be
    driven back in, and never further out.
    """
    reach = limits.stopping_distance_rad(velocity_rad_s)
    if velocity_rad_s > 0.0:
        end = position_rad + reach
        inside = end <= limits.position_max_rad
    elif velocity_rad_s < 0.0:
        end = position_rad - reach
        inside = end >= limits.position_min_rad
    else:
        return ""
    if inside:
        return ""
    return (
        f"from {position_rad:.2f} rad at {velocity_rad_s:.2f} rad/s the joint would stop at "
        f"{end:.2f} rad, outside [{limits.position_min_rad:.2f}, {limits.position_max_rad:.2f}] rad"
    )


def _state_refusals(limits: GateLimits, sample: Sample, now_s: float) -> tuple[str, ...]:
    found = []
    age_s = now_s - sample.time_s
    if not -ROUNDING <= age_s <= limits.sample_age_max_s + ROUNDING:
        found.append(
            f"the newest sample is {age_s * 1e3:.0f} ms old; the limit is "
            f"{limits.sample_age_max_s * 1e3:.0f} ms"
        )
    if sample.state is not DriveState.ON:
        found.append(f"the drive is not enabled, it is '{sample.state.value}'")
    if sample.internal_limit_active:
        found.append("the drive says that one of its own limits is active")
    if not abs(sample.torque_nm) <= limits.torque_max_nm:
        found.append(
            f"the measured torque of {sample.torque_nm:.2f} N m exceeds the limit of "
            f"{limits.torque_max_nm:.2f} N m"
        )
    return (*found, *temperature_refusals(limits, sample))


def temperature_refusals(limits: GateLimits, sample: Sample) -> tuple[str, ...]:
    """Return the reason against moving at the sample's gearbox temperature, if there is one."""
    temperature_degc = sample.gearbox_temperature_degc
    if not isfinite(temperature_degc):
        if limits.temperature_required:
            why = sample.gearbox_temperature_reason
            return (f"the gearbox temperature is not known{f': {why}' if why else ''}",)
        return ()
    if not limits.temperature_min_degc <= temperature_degc <= limits.temperature_max_degc:
        return (
            f"the gearbox temperature of {temperature_degc:.1f} degC is outside "
            f"[{limits.temperature_min_degc:.1f}, {limits.temperature_max_degc:.1f}] degC",
        )
    return ()
