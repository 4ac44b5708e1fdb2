"""Every effect of contract section 4 by its id, and the numbers of a twin's entry."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from agent.physics.effects import (
    carried,
    drift,
    friction,
    local_friction,
    measurement,
    mechanics,
    periodic,
)
from agent.physics.effects.card import EffectCard, Form

LIBRARY: Mapping[str, EffectCard] = MappingProxyType(
    {
        card.id: card
        for story in (friction, local_friction, drift, periodic, mechanics, carried, measurement)
        for card in story.CARDS
    }
)
"""The cards of all effects."""

CARRIED = ("joint-flexibility", "backlash")
"""Effects that carry the one arm: a twin has at most one of each."""

SLIDING = frozenset(
    {
        "stribeck",
        "viscous-nonlinear",
        "load-dependent-friction",
        "temperature-dependent-friction",
        "position-dependent-friction",
        "friction-drift",
    }
)
"""Effects that friction of lasting motion has beside Coulomb's: before it slips it yields whole."""

HOLDING = frozenset(
    {
        ("cable-force", "spring"),
        ("cable-force", "a balancer's spring"),
        ("local-fault", "bump"),
    }
)
"""Effects, and their forms, that pull at the arm: a load that the gear has to bear."""

YIELDING = "presliding-hysteresis"
"""The effect that makes all of sliding friction yield before it slips."""

CORRECTED = ("measurement-delay", "resolver-error")
"""Effects that correct the measured motion, in this order, before the laws see it."""

REPORTED = (
    "torque-ripple",
    "torque-constant-error",
    "torque-saturation",
    "torque-offset",
    "measurement-delay",
)
"""Effects on the sum of all torques, in this order: a ripple that grows with them, constant, limit,
sensor's zero, late report."""


def card_of(effect: str) -> EffectCard:
    """Return an effect's card.

    Raises
    ------
    ValueError
        The library has no such effect.
    """
    if effect not in LIBRARY:
        raise ValueError(
            f"no torque law predicts {effect} from a measured motion; known: "
            + ", ".join(sorted(LIBRARY))
        )
    return LIBRARY[effect]


def numbers_of(effect: str, given: Mapping[str, Any]) -> tuple[Form, dict[str, float]]:
    """Return the form that an entry's numbers choose, and the numbers, defaults filled in.

    Raises
    ------
    ValueError
        The effect is none that a twin can predict, or a number is missing, wrong or unknown.
    """
    form = card_of(effect).form_of(given)
    try:
        return form, form.numbers(given)
    except ValueError as error:
        raise ValueError(f"{effect}: {error}") from error
