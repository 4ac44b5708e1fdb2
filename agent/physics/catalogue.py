"""All laws in one table, and the page of the documentation that is written from it.

A test compares `page` with docs/laws.md, so that neither is changed alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType

from agent.physics import friction, phenomena
from agent.physics.backlash import DeadZone, NordinGutman
from agent.physics.balancer import Balancer
from agent.physics.effects import LIBRARY, EffectCard, Form, Parameter
from agent.physics.external import CableForce, LocalFault
from agent.physics.flexibility import ThreeMass, TwoMass
from agent.physics.friction_drift import LinearDrift, RunIn
from agent.physics.friction_dynamic import BlimanSorine, Dahl, LuGre
from agent.physics.friction_extended import ExtendedFriction
from agent.physics.friction_oil import (
    CrossShear,
    EyringShear,
    NonlinearViscous,
    TemperatureCoulomb,
    TemperatureViscous,
)
from agent.physics.friction_place import PositionDependent, TightSpot
from agent.physics.friction_static import DirectionDependent, LoadDependent, StaticFriction
from agent.physics.law import Law
from agent.physics.periodic import KinematicError, ResolverError, TorqueRipple
from agent.physics.presliding import MaxwellSlip, YieldingSpring
from agent.physics.reported import Delay, TorqueConstant, TorqueSaturation
from agent.physics.rigid_body import MEANING
from agent.physics.seen_arm import SeenArm
from agent.physics.thermal import GearboxTemperature, Oil, WindingResistance

_RIGID_BODY = Law(
    "rigid-body",
    "tau = J a + fv v + fc sign(v) + gs sin(q/N) + gc cos(q/N) + offset",
    MEANING,
    "thesis (3.1), (3.4), (4.4)",
    "below the first resonance, one axis moving at a time",
)

_SLIDING = {
    "coulomb_nm": "fc, level that depends on direction only (Feeny-Moon: level at zero speed)",
    "viscous_nm_s_per_rad": "fv, growth with velocity",
    "static_extra_nm": "fs, what the level has more at zero speed",
    "stribeck_velocity_rad_s": "vs, where 1/e of it is left",
    "exponent": "d, how sharply it falls",
    "mu": "level after the fall as a share of fc",
    "beta_s_per_rad": "how soon it falls",
}


def _sliding(law: friction.FrictionLaw) -> Law:
    """Return the identity card of a law that the estimators fit."""
    equation, _, source = reversed(law.source.partition(": "))
    if law.name == "stribeck":
        equation, _, source = law.source.partition("; ")
    return Law(law.name, equation, {n: _SLIDING[n] for n in law.parameters}, source, law.limits)


LAWS: Mapping[str, Law] = MappingProxyType(
    {
        law.id: law
        for law in (
            *(_sliding(fitted) for fitted in friction.LAWS.values()),
            *(
                kind.law
                for kind in (
                    StaticFriction,
                    DirectionDependent,
                    LoadDependent,
                    TemperatureViscous,
                    TemperatureCoulomb,
                    ExtendedFriction,
                    NonlinearViscous,
                    EyringShear,
                    CrossShear,
                    PositionDependent,
                    TightSpot,
                    LinearDrift,
                    RunIn,
                    Dahl,
                    BlimanSorine,
                    LuGre,
                    YieldingSpring,
                    MaxwellSlip,
                )
            ),
            _RIGID_BODY,
            *(
                kind.law
                for kind in (
                    TwoMass,
                    ThreeMass,
                    DeadZone,
                    NordinGutman,
                    SeenArm,
                    TorqueRipple,
                    KinematicError,
                    ResolverError,
                    TorqueConstant,
                    TorqueSaturation,
                    Delay,
                    CableForce,
                    Balancer,
                    LocalFault,
                    GearboxTemperature,
                    WindingResistance,
                    Oil,
                )
            ),
        )
    }
)
"""Every law by its id."""


def page() -> str:
    """Return docs/laws.md: every law, what an effect of a twin takes, and thesis Table 3.2."""
    parts = [
        "# The laws of a joint",
        "Written by `agent.physics.catalogue.page`; a test keeps the two equal. SI, motor side.",
        *(_section(law) for law in LAWS.values()),
        "## Which friction law shows which phenomenon",
        "Thesis Table 3.2. Each cross is the outcome of a simulation in `agent.physics.phenomena`.",
        _crosses(),
        "## Effects that a twin can carry",
        "The ids and numbers of `[[effects]]` in a twin. Where an effect has several forms, its"
        " numbers say which; entries of one id add up.",
        *(_effect(card) for card in LIBRARY.values()),
    ]
    return "\n\n".join(parts) + "\n"


def _section(law: Law) -> str:
    rows = "\n".join(f"| `{name}` | {_cell(meaning)} |" for name, meaning in law.parameters.items())
    return (
        f"## {law.id}\n\n`{law.equation}`\n\n| parameter | meaning |\n|---|---|\n{rows}\n\n"
        f"Source: {law.source}. Limits: {law.limits}."
    )


def _crosses() -> str:
    lines = [
        f"| | {' | '.join(phenomena.LAWS)} |",
        "|---" * (len(phenomena.LAWS) + 1) + "|",
    ]
    for phenomenon, shown in phenomena.table().items():
        marks = " | ".join("X" if cross else " " for cross in shown.values())
        lines.append(f"| {phenomenon} | {marks} |")
    return "\n".join(lines)


def _effect(card: EffectCard) -> str:
    parts = [f"### {card.id}", card.summary, *(_form(form) for form in card.forms)]
    shown = f"Shows along {_codes(card.axes)}."
    if card.needs:
        shown += f" Needs {_codes(card.needs)} in the recording."
    parts.append(shown)
    if card.look_alikes:
        parts.append("Can be mistaken for:")
        parts.append(
            "\n".join(f"- `{x.effect}`: {x.because}. {x.told_apart_by}" for x in card.look_alikes)
        )
    return "\n\n".join(parts)


def _form(form: Form) -> str:
    rows = "\n".join(
        f"| `{name}` | {_cell(form.meaning(name))} | {_allowed(parameter)} |"
        f" {'needed' if parameter.default is None else f'{parameter.default:g}'} |"
        for name, parameter in form.parameters.items()
    )
    return (
        f"{form.name[0].upper()}{form.name[1:]}: `{form.formula}`\n\n"
        f"| number | meaning | allowed | if left out |\n|---|---|---|---|\n{rows}\n\n"
        f"Source: {form.law.source}. Limits: {form.law.limits}."
    )


def _allowed(parameter: Parameter) -> str:
    if parameter.several:
        return f"a list, each {_allowed(replace(parameter, several=False))}"
    if parameter.instant:
        return "date and time with its zone"
    if math.isfinite(parameter.lower):
        most = f" to {parameter.upper:g}" if math.isfinite(parameter.upper) else ""
        return f"{'above' if parameter.above else 'from'} {parameter.lower:g}{most}"
    return "any"


def _codes(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _cell(text: str) -> str:
    """Return a text whose bars do not end the table's cell."""
    return text.replace("|", "\\|")
