"""The words for what a simulation can leave out, as other tools know them."""

from __future__ import annotations

# Contract section 4, letter by letter.
CONTRACT = (
    "stribeck",
    "viscous-nonlinear",
    "direction-asymmetry",
    "load-dependent-friction",
    "temperature-dependent-friction",
    "position-dependent-friction",
    "presliding-hysteresis",
    "friction-drift",
    "torque-ripple",
    "kinematic-error",
    "torque-constant-error",
    "torque-offset",
    "torque-saturation",
    "measurement-delay",
    "resolver-error",
    "inertia-error",
    "wrong-number",
    "gravity-imbalance",
    "cable-force",
    "joint-flexibility",
    "backlash",
    "local-fault",
)
