"""Intervals as they are told: none reaches into what no joint can have.

An interval is made of the data alone, which may leave room below zero for a number that has none:
friction that pushes, less than no mass. Whoever reads it knows better, and so it ends at zero. It
is cut last, after everything that asks how wide it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from agent.identify.result import FrictionModelFit, Parameter, RigidBodyFit
from agent.identify.rigid.body import NOT_NEGATIVE
from agent.physics.friction import LAWS

_NEVER_NEGATIVE = frozenset(NOT_NEGATIVE) | {n for law in LAWS.values() for n in law.parameters}


def possible_models(models: Sequence[FrictionModelFit]) -> tuple[FrictionModelFit, ...]:
    """Return the laws with intervals that end at zero where they would reach below."""
    return tuple(replace(m, parameters=_possible(m.parameters)) for m in models)


def possible_body(body: RigidBodyFit | None) -> RigidBodyFit | None:
    """Return the rigid body so; gravity and offset have either sign."""
    return None if body is None else replace(body, parameters=_possible(body.parameters))


def _possible(parameters: Mapping[str, Parameter]) -> dict[str, Parameter]:
    return {
        name: _cut(parameter) if name in _NEVER_NEGATIVE else parameter
        for name, parameter in parameters.items()
    }


def _cut(parameter: Parameter) -> Parameter:
    """Return the number with its interval from zero on.

    Where the number itself came out below zero, its interval is left: cut, it would not hold it,
    and how far below is what tells chance from a wrong sign.
    """
    if parameter.ci95 is None or parameter.value < 0.0:
        return parameter
    low, high = parameter.ci95
    return replace(parameter, ci95=(max(low, 0.0), high))
