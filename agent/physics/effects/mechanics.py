"""Effects of masses, weights, hoses and places: torques that friction's sign does not turn."""

from __future__ import annotations

import numpy as np

from agent.physics.balancer import Balancer
from agent.physics.effects.card import (
    EffectCard,
    Floats,
    Form,
    Numbers,
    amplitude,
    free,
    not_negative,
    positive,
    share,
)
from agent.physics.effects.motion import Base, Motion
from agent.physics.effects.places import BELL_PARAMETERS
from agent.physics.external import CableForce, Dent, LocalFault
from agent.physics.friction_place import BELL, TightSpot
from agent.physics.law import Law
from agent.physics.rigid_body import gravity_columns

INERTIA_LAW = Law(
    "inertia-error",
    "dJ a",
    {"inertia_extra_kg_m2": "dJ, true less the twin's inertia, seen by the motor"},
    "thesis (3.1)",
    "below the first resonance, one axis moving at a time",
)

IMBALANCE_LAW = Law(
    "gravity-imbalance",
    "gs sin(q) + gc cos(q), q the arm's angle",
    {
        "gravity_sin_nm": "gs, beside the twin's own",
        "gravity_cos_nm": "gc, beside the twin's own",
    },
    "thesis (3.4)",
    "a mass fixed to this arm; other axes and the robot's base stand still",
)

PAYLOAD_LAW = Law(
    "payload",
    "(m - m0)(j a + gs sin(q) + gc cos(q)), m what the recording carries",
    {
        "inertia_kg_m2_per_kg": "j, inertia seen by the motor that a kilogram adds",
        "gravity_sin_nm_per_kg": "gs, gravity's sine part that it adds",
        "gravity_cos_nm_per_kg": "gc, gravity's cosine part that it adds",
        "reference_payload_kg": "m0, the payload for which the twin's own numbers hold",
    },
    "thesis (3.1), (3.4): linear in a mass at one place of the arm",
    "payloads with their centre of mass at one place; what does not say it carries m0",
)


def _payload(p: Numbers, motion: Motion, base: Base) -> Floats:
    more_kg = motion.payload_beyond_kg(p["reference_payload_kg"])
    torque = p["inertia_kg_m2_per_kg"] * motion.acceleration_rad_s2
    gravity = np.array([p["gravity_sin_nm_per_kg"], p["gravity_cos_nm_per_kg"]])
    if np.any(gravity) and more_kg:
        torque = torque + gravity_columns(motion.need("position_rad"), base.gear_ratio) @ gravity
    return np.asarray(more_kg * torque)


def _inertia(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    return p["inertia_extra_kg_m2"] * motion.acceleration_rad_s2


def _gravity(p: Numbers, motion: Motion, base: Base) -> Floats:
    columns = gravity_columns(motion.need("position_rad"), base.gear_ratio)
    return np.asarray(columns @ np.array([p["gravity_sin_nm"], p["gravity_cos_nm"]]))


def _cable(p: Numbers, motion: Motion, base: Base) -> Floats:
    law = CableForce(**p)
    spring = law.spring_nm(base.arm_rad(motion))
    if not law.hysteresis_nm:
        return spring
    arm_velocity_rad_s = motion.velocity_rad_s / base.gear_ratio
    return spring + law.hysteresis_part_nm(motion.need("time_s"), arm_velocity_rad_s)


def _balancer(p: Numbers, motion: Motion, base: Base) -> Floats:
    return Balancer(**p).torque_nm(base.arm_rad(motion))


def _fault(p: Numbers, motion: Motion, base: Base) -> Floats:
    return LocalFault(**p).torque_nm(base.arm_rad(motion))


def _rubbing(p: Numbers, motion: Motion, base: Base) -> Floats:
    law = TightSpot(p["rubbing_nm"], **{name: p[name] for name in BELL})
    return law.torque_nm(base.arm_rad(motion), motion.direction)


def _dent(p: Numbers, motion: Motion, base: Base) -> Floats:
    return Dent(**p).torque_nm(base.arm_rad(motion))


CARDS = (
    EffectCard(
        "inertia-error",
        "The moving mass is larger or smaller than the simulation says.",
        (
            Form(
                "other inertia",
                INERTIA_LAW,
                {"inertia_extra_kg_m2": amplitude()},
                _inertia,
            ),
        ),
        ("acceleration_rad_s2",),
    ),
    EffectCard(
        "gravity-imbalance",
        "The arm carries a payload or an unbalanced mass that the simulation does not know.",
        (
            Form(
                "unknown weight",
                IMBALANCE_LAW,
                {"gravity_sin_nm": amplitude(0.0), "gravity_cos_nm": amplitude(0.0)},
                _gravity,
            ),
            Form(
                "a payload that recordings state",
                PAYLOAD_LAW,
                {
                    "inertia_kg_m2_per_kg": amplitude(0.0),
                    "gravity_sin_nm_per_kg": amplitude(0.0),
                    "gravity_cos_nm_per_kg": amplitude(0.0),
                    "reference_payload_kg": not_negative(),
                },
                _payload,
            ),
        ),
        ("arm_position_rad",),
        ("position_rad",),
    ),
    EffectCard(
        "cable-force",
        "Hoses or cables pull at the arm like a spring, or a spring that carries its weight does.",
        (
            Form(
                "spring",
                CableForce.law,
                {
                    "stiffness_nm_per_arm_rad": not_negative(linear=True),
                    "neutral_arm_rad": free(0.0),
                    "cubic_nm_per_arm_rad3": not_negative(0.0, linear=True),
                    "hysteresis_nm": not_negative(0.0, linear=True),
                    "hysteresis_travel_arm_rad": positive(1.0),
                    "slack_below_arm_rad": not_negative(0.0),
                    "slack_above_arm_rad": not_negative(0.0),
                    "stiffening_arm_rad": not_negative(0.0),
                },
                _cable,
            ),
            Form(
                "a balancer's spring",
                Balancer.law,
                {
                    "balancer_nm": amplitude(),
                    "lever_ratio": share(),
                    "dead_center_arm_rad": free(),
                    "balancer_stiffness_nm": not_negative(0.0, linear=True),
                },
                _balancer,
            ),
        ),
        ("arm_position_rad", "after_reversal_s"),
        ("position_rad",),
    ),
    EffectCard(
        "local-fault",
        "At one place of the travel the joint meets an extra torque, as from a damaged tooth or"
        " something that rubs.",
        (
            Form(
                "bump",
                LocalFault.law,
                {
                    "height_nm": amplitude(),
                    **BELL_PARAMETERS,
                },
                _fault,
            ),
            Form(
                "dent",
                Dent.law,
                {
                    "dent_nm": amplitude(),
                    "center_arm_rad": free(),
                    "width_arm_rad": positive(),
                    "period_arm_rad": not_negative(0.0),
                },
                _dent,
            ),
            Form(
                "rubbing",
                TightSpot.law,
                {
                    "rubbing_nm": amplitude(meaning="h, friction at the place's middle"),
                    **BELL_PARAMETERS,
                },
                _rubbing,
            ),
        ),
        ("arm_position_rad",),
        ("position_rad",),
    ),
)
"""Effects of mass, weight, hoses and damage."""
