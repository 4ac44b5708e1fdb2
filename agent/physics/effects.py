"""What each effect of a twin adds to its torque: names and numbers in, one law called.

A number may follow an effect's parameter in the twin's file; what has no default must be there.
Position-like orders count motor turns (`order_per_motor_rev`) or arm turns (`order_per_arm_rev`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.physics.backlash import DeadZone
from agent.physics.flexibility import TwoMass
from agent.physics.friction import STRIBECK
from agent.physics.friction_dynamic import Dahl
from agent.physics.friction_static import (
    DirectionDependent,
    LoadDependent,
    NonlinearViscous,
    PositionDependent,
    TemperatureViscous,
)
from agent.physics.periodic import KinematicError, ResolverError, TorqueRipple

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """What was measured of one run, arrays of shape (n,); None where it was not.

    `direction` is the velocity's sign, thresholded or filtered where the caller wishes.
    """

    velocity_rad_s: Floats
    acceleration_rad_s2: Floats
    direction: Floats
    position_rad: Floats | None = None
    time_s: Floats | None = None
    gearbox_temperature_degc: Floats | None = None
    motor_temperature_degc: Floats | None = None

    def need(self, name: str) -> Floats:
        """Return one column, or refuse by name."""
        values = getattr(self, name)
        if values is None:
            raise ValueError(f"needs {name}, and none was given")
        return np.asarray(values, dtype=np.float64)


@dataclass(frozen=True)
class Base:
    """The twin's own numbers that effects refer to."""

    gear_ratio: float
    inertia_kg_m2: float
    coulomb_nm: float
    gravity_sin_nm: float
    gravity_cos_nm: float


Numbers = Mapping[str, float]
Added = Callable[[Numbers, Motion, Base], Floats]


@dataclass(frozen=True)
class EffectLaw:
    """How one effect is computed, and which numbers it takes (None: no default)."""

    parameters: Mapping[str, float | None]
    added_nm: Added


def _arm(motion: Motion, base: Base) -> Floats:
    return motion.need("position_rad") / base.gear_ratio


def _stribeck(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    columns = STRIBECK.columns(motion.velocity_rad_s, p["stribeck_velocity_rad_s"], p["exponent"])
    fall = np.abs(columns[..., STRIBECK.linear.index("static_extra_nm")])
    return p["static_extra_nm"] * fall * motion.direction


def _viscous_nonlinear(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    return NonlinearViscous(**p).torque_nm(motion.velocity_rad_s, motion.direction)


def _asymmetry(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    return DirectionDependent(**p).torque_nm(motion.velocity_rad_s, motion.direction)


def _load(p: Numbers, motion: Motion, base: Base) -> Floats:
    numbers = dict(p)
    transmitted = numbers.pop("arm_inertia_kg_m2") * motion.acceleration_rad_s2
    if base.gravity_sin_nm or base.gravity_cos_nm:
        arm = _arm(motion, base)
        transmitted = transmitted + base.gravity_sin_nm * np.sin(arm)
        transmitted = transmitted + base.gravity_cos_nm * np.cos(arm)
    law = LoadDependent(**numbers)
    return law.torque_nm(motion.velocity_rad_s, transmitted, motion.direction)


def _temperature(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    law = TemperatureViscous(0.0, **p)
    temperature = motion.need("gearbox_temperature_degc")
    at_reference = law.torque_nm(motion.velocity_rad_s, np.asarray(p["reference_degc"]))
    return law.torque_nm(motion.velocity_rad_s, temperature) - at_reference


def _position_friction(p: Numbers, motion: Motion, base: Base) -> Floats:
    law = PositionDependent(p["cos_nm"], p["sin_nm"], p["order_per_arm_rev"])
    return law.torque_nm(_arm(motion, base), motion.velocity_rad_s, motion.direction)


def _presliding(p: Numbers, motion: Motion, base: Base) -> Floats:
    if base.coulomb_nm == 0.0:
        return np.zeros_like(motion.velocity_rad_s)
    law = Dahl(base.coulomb_nm, p["stiffness_nm_per_rad"])
    hysteresis = law.torque_nm(motion.need("time_s"), motion.velocity_rad_s)
    return hysteresis - base.coulomb_nm * motion.direction


def _ripple(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    return TorqueRipple(**p).torque_nm(motion.need("position_rad"))


def _kinematic(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    position = motion.need("position_rad")
    law = KinematicError(**p)
    return law.torque_nm(position, motion.velocity_rad_s, motion.acceleration_rad_s2)


def _offset(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    return np.full_like(motion.velocity_rad_s, p["torque_offset_nm"])


def _inertia(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    return p["inertia_extra_kg_m2"] * motion.acceleration_rad_s2


def _wrong_number(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    viscous = p["viscous_extra_nm_s_per_rad"] * motion.velocity_rad_s
    return p["coulomb_extra_nm"] * motion.direction + viscous


def _gravity(p: Numbers, motion: Motion, base: Base) -> Floats:
    arm = _arm(motion, base)
    return p["gravity_sin_nm"] * np.sin(arm) + p["gravity_cos_nm"] * np.cos(arm)


def _cable(p: Numbers, motion: Motion, base: Base) -> Floats:
    return p["stiffness_nm_per_arm_rad"] * (_arm(motion, base) - p["neutral_arm_rad"])


def _fault(p: Numbers, motion: Motion, base: Base) -> Floats:
    distance = (_arm(motion, base) - p["center_arm_rad"]) / p["width_arm_rad"]
    return p["height_nm"] * np.exp(-0.5 * distance**2)


def _carried(p: Numbers, motion: Motion, base: Base) -> Floats:
    """Return the shaft's torque less that of a stiff gear; the arm behind it is simulated."""
    from agent.physics.kernels import carried_arm

    law = TwoMass(
        1.0,
        p["arm_inertia_kg_m2"],
        p["stiffness_nm_per_rad"],
        p["damping_nm_s_per_rad"],
        p.get("cubic_stiffness_nm_per_rad3", 0.0),
    )
    gap = DeadZone(p.get("half_gap_rad", 0.0), law.stiffness_nm_per_rad)
    time, position = motion.need("time_s"), motion.need("position_rad")
    columns = (time, position, motion.velocity_rad_s)
    if not all(np.isfinite(c).all() for c in columns) or np.any(np.diff(time) <= 0.0):
        raise ValueError("expected finite time_s, position_rad and velocity_rad_s, time rising")
    rate = 2.0 * np.pi * law.antiresonance_hz()
    rate += law.damping_nm_s_per_rad / law.arm_inertia_kg_m2
    steps = max(1, math.ceil(_STEPS_PER_RAD * rate * float(np.max(np.diff(time), initial=0.0))))
    arm = _arm(motion, base)
    weight = base.gravity_sin_nm * np.sin(arm) + base.gravity_cos_nm * np.cos(arm)
    shaft = carried_arm(
        time,
        position,
        motion.velocity_rad_s,
        law.arm_inertia_kg_m2,
        law.stiffness_nm_per_rad,
        law.cubic_stiffness_nm_per_rad3,
        law.damping_nm_s_per_rad,
        gap.half_gap_rad,
        base.gravity_sin_nm,
        base.gravity_cos_nm,
        base.gear_ratio,
        steps,
    )
    stiff = law.arm_inertia_kg_m2 * motion.acceleration_rad_s2 + weight
    return np.asarray(shaft - stiff)


_STEPS_PER_RAD = 20.0  # of the arm's own swing: the error of its steps is then below a percent

ADDED: Mapping[str, EffectLaw] = MappingProxyType(
    {
        "stribeck": EffectLaw(
            {"static_extra_nm": None, "stribeck_velocity_rad_s": None, "exponent": 1.0}, _stribeck
        ),
        "viscous-nonlinear": EffectLaw(
            {"power_nm": None, "reference_velocity_rad_s": None, "exponent": None},
            _viscous_nonlinear,
        ),
        "direction-asymmetry": EffectLaw(
            {"coulomb_difference_nm": 0.0, "viscous_difference_nm_s_per_rad": 0.0}, _asymmetry
        ),
        "load-dependent-friction": EffectLaw(
            {
                "load_coefficient": None,
                "load_boundary_coefficient": 0.0,
                "load_velocity_rad_s": 1.0,
                "exponent": 1.0,
                "arm_inertia_kg_m2": 0.0,
            },
            _load,
        ),
        "temperature-dependent-friction": EffectLaw(
            {"viscous_thermal_nm_s_per_rad": None, "reference_degc": None, "decay_k": None},
            _temperature,
        ),
        "position-dependent-friction": EffectLaw(
            {"cos_nm": None, "sin_nm": None, "order_per_arm_rev": None}, _position_friction
        ),
        "presliding-hysteresis": EffectLaw({"stiffness_nm_per_rad": None}, _presliding),
        "torque-ripple": EffectLaw(
            {"cos_nm": None, "sin_nm": None, "order_per_motor_rev": None}, _ripple
        ),
        "kinematic-error": EffectLaw(
            {
                "cos_rad": None,
                "sin_rad": None,
                "order_per_motor_rev": None,
                "arm_inertia_kg_m2": None,
            },
            _kinematic,
        ),
        "torque-offset": EffectLaw({"torque_offset_nm": None}, _offset),
        "joint-flexibility": EffectLaw(
            {
                "arm_inertia_kg_m2": None,
                "stiffness_nm_per_rad": None,
                "damping_nm_s_per_rad": 0.0,
                "cubic_stiffness_nm_per_rad3": 0.0,
            },
            _carried,
        ),
        "backlash": EffectLaw(
            {
                "half_gap_rad": None,
                "arm_inertia_kg_m2": None,
                "stiffness_nm_per_rad": None,
                "damping_nm_s_per_rad": 0.0,
            },
            _carried,
        ),
        "inertia-error": EffectLaw({"inertia_extra_kg_m2": None}, _inertia),
        "wrong-number": EffectLaw(
            {"coulomb_extra_nm": 0.0, "viscous_extra_nm_s_per_rad": 0.0}, _wrong_number
        ),
        "gravity-imbalance": EffectLaw({"gravity_sin_nm": 0.0, "gravity_cos_nm": 0.0}, _gravity),
        "cable-force": EffectLaw(
            {"stiffness_nm_per_arm_rad": None, "neutral_arm_rad": 0.0}, _cable
        ),
        "local-fault": EffectLaw(
            {"height_nm": None, "center_arm_rad": None, "width_arm_rad": None}, _fault
        ),
    }
)
"""Effects that add a torque, whatever the others add."""

AROUND: Mapping[str, Mapping[str, float | None]] = MappingProxyType(
    {
        "resolver-error": {"cos_rad": None, "sin_rad": None, "order_per_motor_rev": None},
        "torque-constant-error": {
            "factor": 1.0,
            "factor_per_k": 0.0,
            "reference_degc": 20.0,
        },
        "torque-saturation": {"limit_nm": None},
    }
)
"""Effects on the measurements: of the motion before, of the torque after all the others."""


def numbers_of(effect: str, given: Mapping[str, Any]) -> dict[str, float]:
    """Return an effect's numbers, defaults filled in.

    Raises
    ------
    ValueError
        The effect is none that a twin can predict, or a number is missing, wrong or unknown.
    """
    expected = AROUND.get(effect)
    if effect in ADDED:
        expected = ADDED[effect].parameters
    if expected is None:
        known = ", ".join(sorted((*ADDED, *AROUND)))
        raise ValueError(f"no torque law predicts {effect} from a measured motion; known: {known}")
    unknown = sorted(set(given) - set(expected))
    if unknown:
        raise ValueError(f"{effect}: expected {', '.join(expected)}; got also {unknown}")
    out = {}
    for name, default in expected.items():
        value = given.get(name, default)
        number = not isinstance(value, bool) and isinstance(value, (int, float))
        if not number or not math.isfinite(value):
            raise ValueError(f"{effect}: {name}: expected a finite number, got {value!r}")
        out[name] = float(value)
    return out


def true_motion(effects: Mapping[str, Any] | None, motion: Motion) -> Motion:
    """Return the motion with a resolver's error taken out of it."""
    if effects is None:
        return motion
    numbers = numbers_of("resolver-error", effects)
    law = ResolverError(*((numbers[name],) for name in AROUND["resolver-error"]))
    position, velocity, acceleration = law.true_motion(
        motion.need("position_rad"), motion.velocity_rad_s, motion.acceleration_rad_s2
    )
    return replace(
        motion, position_rad=position, velocity_rad_s=velocity, acceleration_rad_s2=acceleration
    )


def reported_nm(effect: str, given: Mapping[str, Any], motion: Motion, torque_nm: Floats) -> Floats:
    """Return the torque that the drive reports for a true one, shape (n,)."""
    numbers = numbers_of(effect, given)
    if effect == "torque-saturation":
        if numbers["limit_nm"] <= 0.0:
            raise ValueError("torque-saturation: limit_nm: expected a number above 0")
        return np.clip(torque_nm, -numbers["limit_nm"], numbers["limit_nm"])
    factor = np.full_like(torque_nm, numbers["factor"])
    if numbers["factor_per_k"]:
        warmer = motion.need("motor_temperature_degc") - numbers["reference_degc"]
        factor = factor * (1.0 + numbers["factor_per_k"] * warmer)
    if np.any(factor <= 0.0):
        raise ValueError("torque-constant-error: expected a factor above 0")
    return np.asarray(torque_nm / factor)
