"""All laws in one table, and the page of the documentation that is written from it.

A test compares `page` with docs/laws.md, so that neither is changed alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from agent.physics import friction, phenomena
from agent.physics.backlash import DeadZone, NordinGutman
from agent.physics.effects import ADDED, AROUND
from agent.physics.flexibility import ThreeMass, TwoMass
from agent.physics.friction_dynamic import BlimanSorine, Dahl, LuGre
from agent.physics.friction_extended import ExtendedFriction
from agent.physics.friction_static import (
    DirectionDependent,
    LoadDependent,
    NonlinearViscous,
    PositionDependent,
    StaticFriction,
    TemperatureViscous,
)
from agent.physics.law import Law
from agent.physics.periodic import KinematicError, ResolverError, TorqueRipple
from agent.physics.rigid_body import MEANING
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
                    ExtendedFriction,
                    NonlinearViscous,
                    PositionDependent,
                    Dahl,
                    BlimanSorine,
                    LuGre,
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
                    TorqueRipple,
                    KinematicError,
                    ResolverError,
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
        "The numbers of `[[effects]]` in a twin; one with a value may be left out.",
        _effects(),
    ]
    return "\n\n".join(parts) + "\n"


def _section(law: Law) -> str:
    rows = "\n".join(
        f"| `{name}` | {meaning.replace('|', chr(92) + '|')} |"
        for name, meaning in law.parameters.items()
    )
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


def _effects() -> str:
    lines = ["| effect | numbers |", "|---|---|"]
    known = {name: law.parameters for name, law in ADDED.items()} | dict(AROUND)
    for effect, numbers in known.items():
        written = ", ".join(
            f"`{name}`" if value is None else f"`{name}` = {value:g}"
            for name, value in numbers.items()
        )
        lines.append(f"| `{effect}` | {written} |")
    return "\n".join(lines)
