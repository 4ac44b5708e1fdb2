"""Effects of what is reported: of the motion before the laws, of the torque after all of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from agent.physics.effects.card import (
    EffectCard,
    Floats,
    Form,
    Numbers,
    amplitude,
    free,
    not_negative,
    positive,
)
from agent.physics.effects.motion import Base, Motion
from agent.physics.effects.shaken import shaken_nm
from agent.physics.law import Law
from agent.physics.periodic import ResolverError
from agent.physics.reported import Delay, Smoothing, TorqueConstant, TorqueSaturation

OFFSET_LAW = Law(
    "torque-offset",
    "o",
    {"torque_offset_nm": "o, reported less real torque"},
    "thesis (4.5), with a constant column",
    "constant over the recordings: a current sensor's zero, not its drift with temperature",
)


def _resolver(p: Numbers, motion: Motion) -> Motion:
    """Return the motion with a resolver's error taken out of it."""
    law, seen = _misreading(p, motion)
    position, velocity, acceleration = law.true_motion(
        motion.need("position_rad"), motion.velocity_rad_s, motion.acceleration_rad_s2, seen
    )
    return replace(
        motion,
        position_rad=position,
        velocity_rad_s=velocity,
        acceleration_rad_s2=acceleration,
        velocity_raw_rad_s=_true_velocity(law, motion, seen),
    )


def _misreading(p: Numbers, motion: Motion) -> tuple[ResolverError, Floats]:
    """Return the error's law, and where samples can follow it along a measured motion, (n,)."""
    law = ResolverError((p["cos_rad"],), (p["sin_rad"],), (p["order_per_motor_rev"],))
    return law, motion.followed(p["order_per_motor_rev"])


def _lagging(p: Numbers, motion: Motion, base: Base) -> Floats:
    """Return what the gear's spring spares a motor that follows its misread angle, shape (n,).

    Motor and arm are shaken by the error; only the arm's part passes the spring.
    """
    del base
    inertia, swing = p["arm_inertia_kg_m2"], 2.0 * math.pi * p["antiresonance_hz"]
    if not (inertia and swing):
        return np.zeros_like(motion.velocity_rad_s)
    law, seen = _misreading(p, motion)
    moved = motion.need("position_rad"), motion.velocity_rad_s, motion.acceleration_rad_s2
    error = law.erring(*moved, seen)
    borne = shaken_nm(motion.need("time_s"), *error, inertia, swing, p["damping_ratio"])
    return np.asarray(inertia * error[2] - borne)


def _true_velocity(law: ResolverError, motion: Motion, seen: Floats) -> Floats | None:
    """Return the unfiltered velocity with the error's slope taken out of it, as far as known."""
    raw = motion.velocity_raw_rad_s
    if raw is None:
        return None
    return law.true_motion(motion.need("position_rad"), raw, motion.acceleration_rad_s2, seen)[1]


def _velocity_late(p: Numbers, motion: Motion) -> Motion:
    """Return the motion with its late velocity, and what is derived from it, moved back."""
    law, time = Delay(p["velocity_delay_s"]), motion.need("time_s")
    # The direction is a step: interpolated straight, so that it cannot overshoot.
    direction = np.interp(time + law.delay_s, time, motion.direction, np.nan, np.nan)
    return replace(
        motion,
        velocity_rad_s=law.true(time, motion.velocity_rad_s),
        acceleration_rad_s2=law.true(time, motion.acceleration_rad_s2),
        direction=direction,
        velocity_raw_rad_s=(
            None if motion.velocity_raw_rad_s is None else law.true(time, motion.velocity_raw_rad_s)
        ),
    )


def _torque_late(p: Numbers, motion: Motion, torque_nm: Floats) -> Floats:
    time, lag_s = motion.need("time_s"), p["torque_lag_s"]
    if lag_s:
        torque_nm = Smoothing(lag_s).reported(time, torque_nm)
    return Delay(p["torque_delay_s"]).reported(time, torque_nm)


def _constant(p: Numbers, motion: Motion, torque_nm: Floats) -> Floats:
    return TorqueConstant(**p).reported_nm(torque_nm, motion.motor_temperature_degc)


def _saturation(p: Numbers, motion: Motion, torque_nm: Floats) -> Floats:
    del motion
    return TorqueSaturation(**p).reported_nm(torque_nm)


def _offset(p: Numbers, motion: Motion, torque_nm: Floats) -> Floats:
    del motion
    return torque_nm + p["torque_offset_nm"]


CARDS = (
    EffectCard(
        "torque-constant-error",
        "The motor gives more or less torque than its reported current stands for.",
        (
            Form(
                "other torque constant",
                TorqueConstant.law,
                {
                    "factor": positive(1.0),
                    "factor_per_k": free(0.0),
                    "reference_degc": free(20.0),
                    "tenth_less_nm": not_negative(0.0),
                },
                reported_nm=_constant,
            ),
        ),
        ("load_torque_nm", "motor_temperature_degc"),
    ),
    EffectCard(
        "torque-saturation",
        "The drive cannot give the torque that the motion asks for: its torque has flat tops.",
        (
            Form(
                "limit of the drive",
                TorqueSaturation.law,
                {"limit_nm": positive()},
                reported_nm=_saturation,
            ),
        ),
        ("acceleration_rad_s2", "velocity_rad_s"),
    ),
    EffectCard(
        "torque-offset",
        "The drive reports a constant torque that is not there.",
        (
            Form(
                "constant",
                OFFSET_LAW,
                {"torque_offset_nm": amplitude()},
                reported_nm=_offset,
            ),
        ),
        ("time_s",),
    ),
    EffectCard(
        "measurement-delay",
        "One signal arrives later than the others.",
        (
            Form(
                "torque late",
                Delay.law,
                {
                    "torque_delay_s": free(meaning="d, of the torque against the motion"),
                    "torque_lag_s": not_negative(
                        0.0, "T, of a low-pass that it passes before (0: none)"
                    ),
                },
                reported_nm=_torque_late,
            ),
            Form(
                "velocity late",
                Delay.law,
                {"velocity_delay_s": free(meaning="d, of the velocity against all others")},
                corrected=_velocity_late,
            ),
        ),
        ("acceleration_rad_s2", "after_reversal_s"),
    ),
    EffectCard(
        "resolver-error",
        "The measured motor angle is wrong by a wave that repeats with the motor's turn.",
        (
            Form(
                "wave of the angle",
                ResolverError.law,
                {
                    "cos_rad": free(),
                    "sin_rad": free(),
                    "order_per_motor_rev": positive(),
                    "arm_inertia_kg_m2": not_negative(
                        0.0, "Ja, behind the spring on which the arm lags (0: stiff)"
                    ),
                    "antiresonance_hz": not_negative(
                        0.0, "of the arm on the gear's spring, the motor held (0: stiff)"
                    ),
                    "damping_ratio": not_negative(0.0, "of that swing"),
                },
                added_nm=_lagging,
                corrected=_resolver,
            ),
        ),
        ("order_per_motor_rev", "velocity_rad_s"),
        ("position_rad",),
    ),
)
"""Effects of what is reported."""
