"""Everything that can be concealed, by its id, and which of it looks alike."""

from __future__ import annotations

from collections.abc import Mapping

from fakes.conceal import effects_friction as friction
from fakes.conceal import effects_mechanical as mechanical
from fakes.conceal import effects_reported as reported
from fakes.conceal.concealment import Maker
from fakes.conceal.outsiders import OUTSIDERS

EFFECTS: Mapping[str, Maker] = {
    "stribeck": friction.stribeck,
    "viscous-nonlinear": friction.viscous_nonlinear,
    "direction-asymmetry": friction.direction_asymmetry,
    "load-dependent-friction": friction.load_dependent_friction,
    "temperature-dependent-friction": friction.temperature_dependent_friction,
    "position-dependent-friction": friction.position_dependent_friction,
    "presliding-hysteresis": friction.presliding_hysteresis,
    "friction-drift": friction.friction_drift,
    "torque-ripple": mechanical.torque_ripple,
    "kinematic-error": mechanical.kinematic_error,
    "torque-constant-error": reported.torque_constant_error,
    "torque-offset": reported.torque_offset,
    "torque-saturation": reported.torque_saturation,
    "measurement-delay": reported.measurement_delay,
    "resolver-error": reported.resolver_error,
    "inertia-error": mechanical.inertia_error,
    "wrong-number": mechanical.wrong_number,
    "gravity-imbalance": mechanical.gravity_imbalance,
    "cable-force": mechanical.cable_force,
    "joint-flexibility": mechanical.joint_flexibility,
    "backlash": mechanical.backlash,
    "local-fault": mechanical.local_fault,
}
"""Every effect of contract section 4."""

ABSORBED = frozenset(
    {
        "inertia-error",
        "wrong-number",
        "gravity-imbalance",
        "torque-constant-error",
        "torque-saturation",
    }
)
"""What a refit of the base structure to the measured motion takes in or cannot see, at least in
one of its forms."""

LOOK_ALIKES: tuple[tuple[str, str], ...] = (
    ("temperature-dependent-friction", "friction-drift"),
    ("torque-constant-error", "temperature-dependent-friction"),
    ("stribeck", "viscous-nonlinear"),
    ("load-dependent-friction", "position-dependent-friction"),
    ("position-dependent-friction", "local-fault"),
    ("gravity-imbalance", "torque-offset"),
    ("gravity-imbalance", "cable-force"),
    ("cable-force", "torque-offset"),
    ("direction-asymmetry", "torque-offset"),
    ("presliding-hysteresis", "backlash"),
    ("presliding-hysteresis", "measurement-delay"),
    ("joint-flexibility", "backlash"),
    ("joint-flexibility", "measurement-delay"),
    ("torque-ripple", "kinematic-error"),
    ("torque-ripple", "resolver-error"),
    ("torque-ripple", "inertia-error"),
)
"""Pairs that a cycle can confuse; to test one, conceal either and look for the other's name."""

NUISANCES = (
    "torque-ripple",
    "direction-asymmetry",
    "torque-offset",
    "position-dependent-friction",
    "cable-force",
    "stribeck",
    "viscous-nonlinear",
    "load-dependent-friction",
)
"""What every real joint has a little of."""


def maker(effect: str) -> Maker:
    """Return what draws an effect, or refuse a word that is none."""
    found = EFFECTS.get(effect) or OUTSIDERS.get(effect)
    if found is None:
        known = ", ".join((*EFFECTS, *OUTSIDERS))
        raise ValueError(f"effect: expected one of {known}; got {effect!r}")
    return found
