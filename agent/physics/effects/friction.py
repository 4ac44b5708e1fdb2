"""Effects in the friction itself: what the twin's Coulomb and viscous friction leave out."""

from __future__ import annotations

import numpy as np

from agent.physics.effects.card import (
    EffectCard,
    Floats,
    Form,
    Numbers,
    Parameter,
    amplitude,
    free,
    not_negative,
    positive,
)
from agent.physics.effects.motion import Base, Motion
from agent.physics.friction import STRIBECK
from agent.physics.friction_extended import ExtendedFriction
from agent.physics.friction_oil import (
    CrossShear,
    EyringShear,
    NonlinearViscous,
    TemperatureCoulomb,
    TemperatureViscous,
)
from agent.physics.friction_static import DirectionDependent, LoadDependent
from agent.physics.law import Law

_STRIBECK_LAW = Law(
    "stribeck",
    "fs exp(-|v/vs|^d) sign(v)",
    {
        "static_extra_nm": "fs, what the level has more at zero speed",
        "stribeck_velocity_rad_s": "vs, where 1/e of it is left",
        "exponent": "d, how sharply it falls",
    },
    STRIBECK.source.partition("; ")[2],
    STRIBECK.limits,
)

WRONG_NUMBER_LAW = Law(
    "wrong-number",
    "dfc sign(v) + dfv v",
    {
        "coulomb_extra_nm": "dfc, true less the twin's Coulomb level",
        "viscous_extra_nm_s_per_rad": "dfv, true less the twin's viscous slope",
    },
    "thesis (3.9)",
    "no new physics: the twin's own structure with other numbers",
)


def _stribeck(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    columns = STRIBECK.columns(motion.velocity_rad_s, p["stribeck_velocity_rad_s"], p["exponent"])
    fall = np.abs(columns[..., STRIBECK.linear.index("static_extra_nm")])
    return p["static_extra_nm"] * fall * motion.direction


def _viscous_nonlinear(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    return NonlinearViscous(**p).torque_nm(motion.velocity_rad_s, motion.direction)


def _eyring(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    return EyringShear(**p).torque_nm(motion.velocity_rad_s, motion.direction)


def _cross(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    return CrossShear(**p).torque_nm(motion.velocity_rad_s, motion.direction)


def _asymmetry(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    return DirectionDependent(**p).torque_nm(motion.velocity_rad_s, motion.direction)


def _load(p: Numbers, motion: Motion, base: Base) -> Floats:
    numbers = dict(p)
    inertia = numbers.pop("arm_inertia_kg_m2") + base.payload_inertia_kg_m2
    load = inertia * motion.acceleration_rad_s2 + base.held_nm(motion)
    # Friction behind the gear is a torque that the gear has to transmit, too.
    load = load + numbers.pop("arm_coulomb_nm") * motion.direction
    load = load + numbers.pop("arm_viscous_nm_s_per_rad") * motion.velocity_rad_s
    return LoadDependent(**numbers).torque_nm(motion.velocity_rad_s, load, motion.direction)


def _viscosity(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    reference_degc = p["reference_degc"]
    temperature = motion.need("gearbox_temperature_degc")
    oil = TemperatureViscous(0.0, p["viscous_thermal_nm_s_per_rad"], reference_degc, p["decay_k"])
    at_reference = oil.torque_nm(motion.velocity_rad_s, np.asarray(reference_degc))
    level = TemperatureCoulomb(p["coulomb_nm_per_k"], reference_degc)
    thinner = oil.torque_nm(motion.velocity_rad_s, temperature) - at_reference
    return thinner + level.torque_nm(motion.direction, temperature)


def _coulomb_slope(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    law = TemperatureCoulomb(**p)
    return law.torque_nm(motion.direction, motion.need("gearbox_temperature_degc"))


def _extended(p: Numbers, motion: Motion, base: Base) -> Floats:
    """Return the extended law's thermal parts; level, slope and load belong to other numbers."""
    del base
    law = ExtendedFriction(
        coulomb=0.0,
        coulomb_load=0.0,
        static_load=0.0,
        static=p["static_nm"],
        static_per_k=p["static_nm_per_k"],
        stribeck_velocity_rad_s=p["stribeck_velocity_rad_s"],
        stribeck_velocity_rad_s_per_k=p["stribeck_velocity_rad_s_per_k"],
        viscous_s_per_rad=0.0,
        viscous_thermal_s_per_rad=p["viscous_thermal_nm_s_per_rad"],
        decay_k=p["decay_k"],
        exponent=p["exponent"],
        maximum_torque_nm=1.0,
    )
    speed = np.abs(motion.velocity_rad_s)
    level = law.torque_nm(speed, motion.need("gearbox_temperature_degc"), np.zeros_like(speed))
    return level * motion.direction


def _wrong_number(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    viscous = p["viscous_extra_nm_s_per_rad"] * motion.velocity_rad_s
    return p["coulomb_extra_nm"] * motion.direction + viscous


_PER_K = "coulomb_nm_per_k"

_TEMPERATURE_FORMS = (
    Form(
        "oil that thins",
        TemperatureViscous.law,
        {
            "viscous_thermal_nm_s_per_rad": not_negative(linear=True),
            "reference_degc": free(),
            "decay_k": positive(),
            "coulomb_nm_per_k": amplitude(0.0, TemperatureCoulomb.law.parameters[_PER_K]),
        },
        _viscosity,
        equation="fvt [exp(-(T - Tr)/Tv) - 1] v + fT (T - Tr) sign(v)",
    ),
    Form(
        "Coulomb level over temperature",
        TemperatureCoulomb.law,
        {"coulomb_nm_per_k": amplitude(), "reference_degc": free()},
        _coulomb_slope,
    ),
    Form(
        "extended law",
        ExtendedFriction.law,
        {
            "static_nm": amplitude(meaning="fs0, boundary level at 0 degC"),
            "static_nm_per_k": amplitude(meaning="fsT, its growth per kelvin"),
            "stribeck_velocity_rad_s": free(),
            "stribeck_velocity_rad_s_per_k": free(),
            "exponent": positive(1.36),
            "viscous_thermal_nm_s_per_rad": Parameter(
                0.0, linear=True, lower=0.0, meaning="fvT, viscous slope at 0 degC that falls"
            ),
            "decay_k": positive(20.71),
        },
        _extended,
        equation="{(fs0 + fsT T) exp(-|v/(vs0 + vsT T)|^a) + fvT exp(-T/Tv) |v|} sign(v)",
    ),
)

CARDS = (
    EffectCard(
        "stribeck",
        "Friction is higher near standstill and falls as the joint speeds up.",
        (
            Form(
                "Stribeck curve",
                _STRIBECK_LAW,
                {
                    "static_extra_nm": amplitude(),
                    "stribeck_velocity_rad_s": positive(),
                    "exponent": positive(1.0),
                },
                _stribeck,
            ),
        ),
        ("velocity_rad_s",),
    ),
    EffectCard(
        "viscous-nonlinear",
        "Friction does not grow in proportion to speed: it bends at high speed.",
        (
            Form(
                "power of speed",
                NonlinearViscous.law,
                {
                    "power_nm": amplitude(),
                    "reference_velocity_rad_s": positive(),
                    "exponent": positive(),
                },
                _viscous_nonlinear,
            ),
            Form(
                "shear thinning without a plateau",
                EyringShear.law,
                {"shear_nm": amplitude(), "shear_velocity_rad_s": positive()},
                _eyring,
            ),
            Form(
                "shear thinning with a plateau",
                CrossShear.law,
                {"plateau_nm": amplitude(), "plateau_velocity_rad_s": positive()},
                _cross,
            ),
        ),
        ("velocity_rad_s",),
    ),
    EffectCard(
        "direction-asymmetry",
        "The joint has more friction in one direction than in the other.",
        (
            Form(
                "difference of the directions",
                DirectionDependent.law,
                {
                    "coulomb_difference_nm": amplitude(0.0),
                    "viscous_difference_nm_s_per_rad": amplitude(0.0),
                },
                _asymmetry,
            ),
        ),
        ("velocity_rad_s",),
    ),
    EffectCard(
        "load-dependent-friction",
        "Friction grows with the torque that the gear has to transmit.",
        (
            Form(
                "share of the load",
                LoadDependent.law,
                {
                    "load_coefficient": not_negative(linear=True),
                    "load_boundary_coefficient": not_negative(0.0, linear=True),
                    "load_velocity_rad_s": positive(1.0),
                    "exponent": positive(1.0),
                    "load_power": positive(1.0),
                    "reference_load_nm": positive(1.0),
                    "driving_excess": not_negative(0.0),
                    "arm_inertia_kg_m2": not_negative(
                        0.0, "Ja: the load is Ja a and gravity; Ja seen by the motor"
                    ),
                    "arm_coulomb_nm": not_negative(
                        0.0, "dry friction behind the gear, seen by the motor: part of the load"
                    ),
                    "arm_viscous_nm_s_per_rad": not_negative(
                        0.0, "viscous friction behind the gear: part of the load"
                    ),
                },
                _load,
            ),
        ),
        ("load_torque_nm", "velocity_rad_s"),
        ("position_rad",),
    ),
    EffectCard(
        "temperature-dependent-friction",
        "Friction changes as the gearbox warms, because its oil becomes thinner.",
        _TEMPERATURE_FORMS,
        ("gearbox_temperature_degc", "velocity_rad_s"),
        ("gearbox_temperature_degc",),
    ),
    EffectCard(
        "wrong-number",
        "The simulation's friction law is right, but its numbers are not.",
        (
            Form(
                "other Coulomb and viscous numbers",
                WRONG_NUMBER_LAW,
                {
                    "coulomb_extra_nm": amplitude(0.0),
                    "viscous_extra_nm_s_per_rad": amplitude(0.0),
                },
                _wrong_number,
            ),
        ),
        ("velocity_rad_s",),
    ),
)
"""Effects of speed, direction, load and temperature."""
