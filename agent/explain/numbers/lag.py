"""What a filter takes of a swing: how far a spring's numbers may be off beside a late velocity.

Drives smooth the velocity that they report. A delay shifts all frequencies alike, and takes
nothing; a filter of the first order whose lag is T takes ``(w T)^2 / 2`` of a swing at w. The
recordings' band seldom tells the two apart: an interval reaches over both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from agent.explain.numbers.model import Model
from agent.identify.result import Parameter

_DELAY, _SPRING = "measurement-delay", "joint-flexibility"
_SWING = "antiresonance_hz"
_MOST = 0.5  # of a number: with more, a second-order series says nothing

Numbers = Mapping[str, Parameter]


def reaching_over_a_filter(model: Model, parameters: Sequence[Numbers]) -> tuple[Numbers, ...]:
    """Return the terms' numbers; an arm behind a spring may be smaller by what a filter takes.

    Parameters
    ----------
    model : Model
    parameters : sequence of mapping of str to Parameter
        By term, with intervals for a delay.
    """
    own = dict(zip((t.scored.form.effect for t in model.terms), parameters, strict=True))
    if _DELAY not in own or _SWING not in own.get(_SPRING, {}):
        return tuple(parameters)
    lag_s = max(-own[_DELAY]["torque_delay_s"].value, 0.0)  # of the velocity: its torque is early
    turned = 2.0 * math.pi * own[_SPRING][_SWING].value * lag_s
    arm = own[_SPRING]["arm_inertia_kg_m2"]
    if arm.ci95 is None:
        return tuple(parameters)
    low = arm.ci95[0] - min(0.5 * turned**2, _MOST) * arm.value
    wider = {**own[_SPRING], "arm_inertia_kg_m2": replace(arm, ci95=(low, arm.ci95[1]))}
    return tuple(wider if numbers is own[_SPRING] else numbers for numbers in parameters)
