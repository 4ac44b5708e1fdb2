"""Effects of what is reported: of the motion before the laws, of the torque after all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.physics.effects.card import (
    EffectCard,
    Floats,
    Form,
    LookAlike,
    Numbers,
    amplitude,
    free,
    positive,
)
from agent.physics.effects.motion import Motion
from agent.physics.law import Law
from agent.physics.periodic import ResolverError
from agent.physics.reported import Delay, TorqueConstant, TorqueSaturation

OFFSET_LAW = Law(
    "torque-offset",
    "o",
    {"torque_offset_nm": "o, reported less real torque"},
    "thesis (4.5), with a constant column",
    "constant over the recordings: a current sensor's zero, not its drift with temperature",
)


def _resolver(p: Numbers, motion: Motion) -> Motion:
    """Return the motion with a resolver's error taken out of it."""
    law = ResolverError((p["cos_rad"],), (p["sin_rad"],), (p["order_per_motor_rev"],))
    position, velocity, acceleration = law.true_motion(
        motion.need("position_rad"), motion.velocity_rad_s, motion.acceleration_rad_s2
    )
    return replace(
        motion, position_rad=position, velocity_rad_s=velocity, acceleration_rad_s2=acceleration
    )


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
    )


def _torque_late(p: Numbers, motion: Motion, torque_nm: Floats) -> Floats:
    return Delay(p["torque_delay_s"]).reported(motion.need("time_s"), torque_nm)


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
                },
                reported_nm=_constant,
            ),
        ),
        ("load_torque_nm", "motor_temperature_degc"),
        look_alikes=(
            LookAlike(
                "wrong-number",
                "a wrong torque constant scales friction",
                "Compare inertia and gravity with their known values: a wrong constant is off by"
                " the same factor in all of them.",
            ),
            LookAlike(
                "inertia-error",
                "a wrong torque constant scales inertia, too",
                "Compare friction or gravity with what they were: inertia alone must have changed.",
            ),
            LookAlike(
                "temperature-dependent-friction",
                "magnets and oil both lose with temperature",
                "Hold a load against gravity, cold and warm: friction plays no part in the mean of"
                " raising and lowering.",
            ),
        ),
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
        look_alikes=(
            LookAlike(
                "inertia-error",
                "clipped torque at high acceleration looks like a smaller inertia",
                "Repeat with half the acceleration: below the limit the mismatch is gone.",
            ),
            LookAlike(
                "viscous-nonlinear",
                "clipped torque at high speed looks like friction that bends",
                "Repeat with a lower payload or lower speed, and watch for flat tops of the"
                " torque while the velocity falls short of its command.",
            ),
        ),
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
        look_alikes=(
            LookAlike(
                "direction-asymmetry",
                "a Coulomb level that differs by direction and a constant torque are the same"
                " column while the joint slides",
                "No run of this axis tells them apart while it slides: compare the drive's torque"
                " with the power stage off and the brake closed, which shows an offset alone.",
            ),
            LookAlike(
                "gravity-imbalance",
                "on a short stroke gravity is nearly constant",
                "Repeat the cycle over a longer stroke or about another arm angle.",
            ),
        ),
    ),
    EffectCard(
        "measurement-delay",
        "One signal arrives later than the others.",
        (
            Form(
                "torque late",
                Delay.law,
                {"torque_delay_s": free(meaning="d, of the torque against the motion")},
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
        look_alikes=(
            LookAlike(
                "presliding-hysteresis",
                "friction that builds up after a reversal is late as well",
                "Make the same reversal at two accelerations: a delay keeps its seconds, presliding"
                " its travel.",
            ),
            LookAlike(
                "joint-flexibility",
                "a late torque during a ramp looks like the twist of a spring",
                "Change speed sharply: only a flexible joint rings.",
            ),
            LookAlike(
                "backlash",
                "torque that turns over late is lost motion, too",
                "Make the same reversal at two accelerations: a delay keeps its seconds, a gap its"
                " travel.",
            ),
        ),
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
                },
                corrected=_resolver,
            ),
        ),
        ("order_per_motor_rev", "velocity_rad_s"),
        ("position_rad",),
        (
            LookAlike(
                "torque-ripple",
                "the speed controller pushes at the same order",
                "Repeat at several speeds: a wrong angle's acceleration grows with the square of"
                " the speed, ripple stays.",
            ),
            LookAlike(
                "kinematic-error",
                "both are errors of an angle at the same order",
                "Record the arm's own encoder: the gear's wobble is seen there, the resolver's is"
                " not.",
            ),
        ),
    ),
)
"""Effects of what is reported."""
