"""Effects that repeat with the motor's or the arm's turn and live in motor and gear."""

from __future__ import annotations

import math
from collections.abc import Callable

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
from agent.physics.periodic import KinematicError, TorqueRipple
from agent.physics.seen_arm import SeenArm


def _ripple(order_per_motor_rev: float, p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    law = TorqueRipple(p["cos_nm"], p["sin_nm"], order_per_motor_rev)
    return motion.followed(order_per_motor_rev) * law.torque_nm(motion.need("position_rad"))


def _loaded_ripple(p: Numbers, motion: Motion, torque_nm: Floats) -> Floats:
    """Return what a motor that pulsates the more the harder it pulls reports for a torque."""
    law = TorqueRipple(**p)
    ripple_nm = law.torque_nm(motion.need("position_rad"), torque_nm)
    return np.asarray(torque_nm + motion.followed(p["order_per_motor_rev"]) * ripple_nm)


def _wobble(order_per_motor_rev: float, p: Numbers, motion: Motion, base: Base) -> Floats:
    inertia = p["arm_inertia_kg_m2"]
    law = KinematicError(p["cos_rad"], p["sin_rad"], order_per_motor_rev, inertia)
    load = base.held_nm(motion) + p["arm_coulomb_nm"] * motion.direction
    moved = motion.need("position_rad"), motion.velocity_rad_s, motion.acceleration_rad_s2
    seen = motion.followed(order_per_motor_rev)
    if not p["antiresonance_hz"] or not inertia:
        return law.torque_nm(*moved, load, seen=seen)
    spring = 2.0 * math.pi * p["antiresonance_hz"]
    wobbles = law.shaking(*moved, seen)
    shaken = shaken_nm(motion.need("time_s"), *wobbles, inertia, spring, p["damping_ratio"])
    return law.torque_nm(*moved, load, shaken, seen)


def _seen_wave(p: Numbers, motion: Motion, base: Base) -> Floats:
    """Return what a wave adds behind which an encoder shows the arm, its own motion taken."""
    inertia, order = p["arm_inertia_kg_m2"], p["order_per_motor_rev"]
    arm, motor = motion.need("position_arm_rad"), motion.need("position_rad")
    seen = SeenArm(inertia, p["encoder_late_s"])
    extra = seen.extra_nm(motion.need("time_s"), base.gear_ratio * arm, motor)
    shaft = inertia * motion.acceleration_rad_s2 + extra + base.held_nm(motion)
    slope = p["sin_rad"] * np.cos(order * motor) - p["cos_rad"] * np.sin(order * motor)
    return np.asarray(motion.followed(order) * order * slope * shaft)


def _per_motor_turn(
    law: Callable[[float, Numbers, Motion, Base], Floats],
) -> Callable[[Numbers, Motion, Base], Floats]:
    def added_nm(p: Numbers, motion: Motion, base: Base) -> Floats:
        return law(p["order_per_motor_rev"], p, motion, base)

    return added_nm


def _per_arm_turn(
    law: Callable[[float, Numbers, Motion, Base], Floats],
) -> Callable[[Numbers, Motion, Base], Floats]:
    def added_nm(p: Numbers, motion: Motion, base: Base) -> Floats:
        return law(p["order_per_arm_rev"] / base.gear_ratio, p, motion, base)

    return added_nm


_TORQUE = {"cos_nm": amplitude(), "sin_nm": amplitude()}
_ANGLE = {"cos_rad": free(), "sin_rad": free()}
_WOBBLE = "Ja {(1 + e')[(1 + e') a + e'' v^2] - a} + e' l, e = c cos(n q) + s sin(n q)"
_BY_MOTOR = {"order_per_motor_rev": positive()}
_BY_ARM = {"order_per_arm_rev": positive(meaning="n N, periods per arm turn")}
_ARM = {
    "arm_inertia_kg_m2": not_negative(),
    "arm_coulomb_nm": not_negative(
        0.0, "the arm's part of the twin's Coulomb level, in the load l"
    ),
    "antiresonance_hz": not_negative(
        0.0, "of the arm on the gear's spring, the motor held, as the wobble shakes it (0: stiff)"
    ),
    "damping_ratio": not_negative(0.0, "of that swing"),
}

CARDS = (
    EffectCard(
        "torque-ripple",
        "The motor's torque pulsates with its angle, in the same sense in both directions.",
        (
            Form(
                "per motor turn",
                TorqueRipple.law,
                {**_TORQUE, **_BY_MOTOR},
                _per_motor_turn(_ripple),
                equation="c cos(n q) + s sin(n q)",
            ),
            Form(
                "per arm turn",
                TorqueRipple.law,
                {**_TORQUE, **_BY_ARM},
                _per_arm_turn(_ripple),
                equation="c cos(n q) + s sin(n q)",
            ),
            Form(
                "per motor turn, growing with the torque",
                TorqueRipple.law,
                {**_TORQUE, **_BY_MOTOR, "load_growth_per_nm": not_negative()},
                reported_nm=_loaded_ripple,
                equation="[c cos(n q) + s sin(n q)] (1 + p |tau|)",
            ),
            Form(
                "per motor turn, in part in proportion to the torque",
                TorqueRipple.law,
                {**_TORQUE, **_BY_MOTOR, "cos_share": free(), "sin_share": free()},
                reported_nm=_loaded_ripple,
                equation="c cos(n q) + s sin(n q) + [a cos(n q) + b sin(n q)] tau",
            ),
        ),
        ("order_per_motor_rev", "order_per_arm_rev"),
        ("position_rad",),
    ),
    EffectCard(
        "kinematic-error",
        "The gear's ratio wobbles with its angle, so that the arm is shaken the more the faster"
        " it turns.",
        (
            Form(
                "per motor turn",
                KinematicError.law,
                {**_ANGLE, **_BY_MOTOR, **_ARM},
                _per_motor_turn(_wobble),
                equation=_WOBBLE,
            ),
            Form(
                "per motor turn, the arm followed by its encoder",
                KinematicError.law,
                {
                    **_ANGLE,
                    **_BY_MOTOR,
                    "arm_inertia_kg_m2": positive(),
                    "encoder_late_s": free(
                        meaning="s, by how much the arm's encoder is later than the motor's"
                    ),
                },
                _seen_wave,
                equation="e' (Ja d2(N qa)/dt2 + l), e = c cos(n q) + s sin(n q), qa the encoder's",
            ),
            Form(
                "per arm turn",
                KinematicError.law,
                {**_ANGLE, **_BY_ARM, **_ARM},
                _per_arm_turn(_wobble),
                equation=_WOBBLE,
            ),
        ),
        ("order_per_motor_rev", "order_per_arm_rev", "velocity_rad_s"),
        ("position_rad",),
    ),
)
"""Effects of the position's periods."""
