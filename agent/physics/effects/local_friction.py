"""Friction effects of place and reversal."""

from __future__ import annotations

import numpy as np

from agent.physics.beginnings import drawn_at_first
from agent.physics.effects.card import (
    EffectCard,
    Floats,
    Form,
    Numbers,
    Parameter,
    amplitude,
    not_negative,
    positive,
)
from agent.physics.effects.motion import Base, Motion
from agent.physics.effects.places import BELL_PARAMETERS
from agent.physics.friction_place import PositionDependent, TightSpot
from agent.physics.presliding import MaxwellSlip, YieldingSpring, across_gaps

_SHARE = "yielding_share"
_FORGOTTEN = 10.0  # of the travel that draws a spring out: e^-10 of what was before is left


def _wave_along_arm(p: Numbers, motion: Motion, base: Base) -> Floats:
    law = PositionDependent(p["cos_nm"], p["sin_nm"], p["order_per_arm_rev"])
    torque = law.torque_nm(base.arm_rad(motion), motion.velocity_rad_s, motion.direction)
    return motion.followed(law.order / base.gear_ratio) * torque


def _wave_along_motor(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    law = PositionDependent(p["cos_nm"], p["sin_nm"], p["order_per_motor_rev"])
    at = motion.need("position_rad")
    torque = law.torque_nm(at, motion.velocity_rad_s, motion.direction)
    return motion.followed(law.order) * torque


def _tight_spot(p: Numbers, motion: Motion, base: Base) -> Floats:
    return TightSpot(**p).torque_nm(base.arm_rad(motion), motion.direction)


def _hysteresis(
    law: YieldingSpring | MaxwellSlip,
    share: float,
    remembers_rad: float,
    motion: Motion,
    base: Base,
) -> Floats:
    """Return friction with memory less what it replaces: its share of the dry level, signed."""
    own = share * base.level_nm(motion)
    if not np.any(own > 0.0):
        return np.zeros_like(own)  # a joint without dry friction has nothing that could yield
    parts = motion.with_memory(remembers_rad)
    stretches = [(m.need("time_s"), m.velocity_rad_s, m.position_rad) for m in parts]
    time, velocity, where = across_gaps(stretches)
    first = parts[0]
    known = np.isfinite(first.direction) & np.isfinite(first.velocity_rad_s)
    start = drawn_at_first(first.velocity_rad_s[known], first.direction[known])
    level = share * base.dry_level_nm(velocity)
    level[where[-1]] = own
    memory = law.torque_nm(time, velocity, level, start)
    return np.asarray(memory[where[-1]] - own * motion.direction)


def _yielding(p: Numbers, motion: Motion, base: Base) -> Floats:
    law = YieldingSpring(**_without_share(p))
    level_nm = p[_SHARE] * float(np.nanmax(base.dry_level_nm(motion.velocity_rad_s)))
    drawn_rad = level_nm / law.stiffness_nm_per_rad
    return _hysteresis(law, p[_SHARE], _FORGOTTEN * drawn_rad, motion, base)


def _slipping(p: Numbers, motion: Motion, base: Base) -> Floats:
    law = MaxwellSlip(**_without_share(p))
    return _hysteresis(law, p[_SHARE], 2.0 * law.sliding_travel_rad, motion, base)


def _without_share(p: Numbers) -> dict[str, float]:
    return {name: value for name, value in p.items() if name != _SHARE}


def _share() -> Parameter:
    return Parameter(
        1.0,
        lower=0.0,
        upper=1.0,
        meaning="share of the dry friction that yields; the rest turns round at once",
    )


_PLACE_FORMS = (
    Form(
        "wave along the arm",
        PositionDependent.law,
        {
            "cos_nm": amplitude(),
            "sin_nm": amplitude(),
            "order_per_arm_rev": positive(meaning="n, periods per arm turn"),
        },
        _wave_along_arm,
    ),
    Form(
        "wave along the motor's turn",
        PositionDependent.law,
        {
            "cos_nm": amplitude(),
            "sin_nm": amplitude(),
            "order_per_motor_rev": positive(meaning="n, periods per motor turn"),
        },
        _wave_along_motor,
    ),
    Form(
        "tight spot",
        TightSpot.law,
        {
            "height_nm": amplitude(),
            **BELL_PARAMETERS,
        },
        _tight_spot,
    ),
)

CARDS = (
    EffectCard(
        "position-dependent-friction",
        "Friction is higher at some places of the joint's travel than at others.",
        _PLACE_FORMS,
        ("arm_position_rad", "order_per_arm_rev", "order_per_motor_rev"),
        ("position_rad",),
    ),
    EffectCard(
        "presliding-hysteresis",
        "After a reversal friction builds up like a spring before the joint really slides.",
        (
            Form(
                "yielding spring",
                YieldingSpring.law,
                {
                    "stiffness_nm_per_rad": positive(),
                    "shape_exponent": positive(1.0),
                    "damping_nm_s_per_rad": not_negative(0.0),
                    _SHARE: _share(),
                },
                _yielding,
            ),
            Form(
                "Maxwell-slip elements",
                MaxwellSlip.law,
                {
                    "sliding_travel_rad": positive(),
                    "shape_exponent": Parameter(2.0, lower=1.0),
                    _SHARE: _share(),
                },
                _slipping,
            ),
        ),
        ("after_reversal_s", "velocity_rad_s"),
    ),
)
"""Effects of place and reversal."""
