"""What each effect is called, in sentences, on pages and in terminals, and which of them brake."""

from __future__ import annotations

from collections.abc import Container, Mapping
from types import MappingProxyType

NAMES: Mapping[str, str] = MappingProxyType(
    {
        "stribeck": "friction that falls with speed (Stribeck)",
        "viscous-nonlinear": "friction that bends with speed",
        "direction-asymmetry": "friction that differs between the two directions",
        "load-dependent-friction": "friction that grows with the load on the gear",
        "temperature-dependent-friction": "friction that changes with the gearbox temperature",
        "position-dependent-friction": "friction that changes along the position",
        "presliding-hysteresis": "friction that yields like a spring before it slips (presliding)",
        "friction-drift": "friction that changes with time or use",
        "torque-ripple": "torque ripple that repeats with the motor's angle",
        "kinematic-error": "a gear whose ratio wobbles with the angle (transmission error)",
        "torque-constant-error": "a torque constant that is not what the simulation says",
        "torque-offset": "a constant torque beside the reported one",
        "torque-saturation": "a drive that clips its torque",
        "measurement-delay": "one channel that is late against another",
        "resolver-error": "a motor angle that is measured with a periodic error",
        "inertia-error": "an inertia that is not what the simulation says",
        "wrong-number": "a Coulomb or viscous friction that is not what the simulation says",
        "gravity-imbalance": "a payload or imbalance that the simulation does not know",
        "cable-force": "a spring-like pull of hoses and cables",
        "joint-flexibility": "an arm that swings behind a soft gear",
        "backlash": "backlash in the gear",
        "local-fault": "a bump at one place of the position",
    }
)
"""What each effect of contract section 4 is called, in the middle of a sentence."""


def effect_name(effect: str) -> str:
    """Return what an effect is called; one that is not known keeps its own id's words."""
    return NAMES.get(effect, effect.replace("-", " "))


_BALANCER = "lever_ratio", "a spring on levers that carries the arm (a balancer)"


def law_name(effect: str, numbers: Container[str]) -> str:
    """Return what a law of an effect is called: of some, its numbers say more than the effect."""
    number, name = _BALANCER
    return name if number in numbers else effect_name(effect)


NUMBERS: Mapping[str, str] = MappingProxyType(
    {
        "inertia_kg_m2": "the inertia on the motor side",
        "viscous_nm_s_per_rad": "viscous friction",
        "coulomb_nm": "Coulomb friction",
        "gravity_sin_nm": "gravity's sine part",
        "gravity_cos_nm": "gravity's cosine part",
    }
)
"""What the twin's own numbers are called, in the middle of a sentence."""

FOLLOWS_DIRECTION = frozenset(
    {
        "stribeck",
        "viscous-nonlinear",
        "load-dependent-friction",
        "temperature-dependent-friction",
        "position-dependent-friction",
        "presliding-hysteresis",
        "friction-drift",
        "wrong-number",
    }
)
"""Effects whose torque brakes: told in the direction of motion."""

FOLLOWS_TORQUE = frozenset({"torque-constant-error"})
"""Effects of what the torque is read as: told in the direction of the torque."""

COSTS_NO_TORQUE = frozenset({"torque-saturation"})
"""Effects that keep the motion back: the torque that it takes has no error."""

OWN_NUMBER = "the twin's own number"
"""The form of a finding that is no missing physics."""

OWN_EFFECT = "the twin's own effect"
"""The form of a finding about an effect that the simulation has, with other numbers."""
