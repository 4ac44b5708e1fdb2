"""The end of `stribeck demo`: physics that the joint's simulation was not told of, and its name."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agent.identify.result import Parameter
from agent.numbers import NO_NUMBER, parameter_unit, scale_for, significant, written
from agent.physics.twin import Twin
from fakes.specification import FakeSpecification


@dataclass(frozen=True)
class Secret:
    """One number of the joint that its simulation lacks.

    Parameters
    ----------
    what : str
        In words.
    effect, parameter : str
        Where an explanation says it (contract sections 4 and 6).
    true : float
        In the parameter's unit.
    """

    what: str
    effect: str
    parameter: str
    true: float


def simulation_of(specification: FakeSpecification, *, robot: str, axis: int) -> Twin:
    """Return the plain simulation of a fake joint: every number that it has is right.

    Parameters
    ----------
    specification : FakeSpecification
        Rigid body, gravity, Coulomb and viscous friction at the first temperature are taken.
    robot, axis : str, int
        As the cell calls them.
    """
    joint = specification.joint
    friction = joint.friction.truth(specification.thermal.initial_degc)
    return Twin(
        robot=robot,
        axis=axis,
        gear_ratio=joint.gear_ratio,
        inertia_kg_m2=joint.inertia_kg_m2,
        coulomb_nm=friction.coulomb_nm,
        viscous_nm_s_per_rad=friction.viscous_nm_s_per_rad,
        gravity_sin_nm=joint.gravity_sin_nm,
        gravity_cos_nm=joint.gravity_cos_nm,
    )


def secrets_of(specification: FakeSpecification) -> tuple[Secret, ...]:
    """Return what the plain simulation of a fake joint lacks: its spring and its Stribeck effect.

    The velocity that the drive reports is late by the filter's time constant.
    """
    joint = specification.joint
    friction = joint.friction.truth(specification.thermal.initial_degc)
    spring, stribeck = "joint-flexibility", "stribeck"
    return (
        Secret("gear as a spring", spring, "stiffness_nm_per_rad", joint.spring_nm_per_rad),
        Secret("arm behind it, motor side", spring, "arm_inertia_kg_m2", joint.arm_inertia_kg_m2),
        Secret("more friction at rest", stribeck, "static_extra_nm", friction.static_extra_nm),
        Secret(
            "... fading with speed",
            stribeck,
            "stribeck_velocity_rad_s",
            friction.stribeck_velocity_rad_s,
        ),
        Secret(
            "velocity that comes late",
            "measurement-delay",
            "velocity_delay_s",
            specification.servo.velocity_filter_s,
        ),
    )


def opened(secrets: tuple[Secret, ...], explanation: Path) -> str:
    """Return a table of what was concealed, what is true and what an explanation says of it.

    Parameters
    ----------
    secrets : tuple of Secret
    explanation : pathlib.Path
        An `explanation.json`.
    """
    document = json.loads(explanation.read_text(encoding="utf-8"))
    findings = {finding["effect"]: finding for finding in document["findings"]}
    lines = [f"{'Concealed':<28}{'true':>18}   found (95 % interval)"]
    for secret in secrets:
        unit = parameter_unit(secret.parameter)
        scale = scale_for(unit, (secret.true,))
        true = f"{significant(scale.factor * secret.true, 3)} {scale.unit}"
        found = _found(findings.get(secret.effect), secret.parameter, scale.factor)
        lines.append(f"  {secret.what:<26}{true:>18}   {found}")
    return "\n".join(lines)


def _found(finding: Mapping[str, Any] | None, name: str, factor: float) -> str:
    """Return what a finding says of a parameter, in the unit of `factor`."""
    if finding is None:
        return "not named"
    content = finding["parameters"].get(name)
    if content is None or not content["identified"]:
        return "named, its size not identified"
    interval = content.get("ci95")
    value = content["value"]
    parameter = Parameter(
        math.nan if value is None else float(value),
        None if interval is None else (float(interval[0]), float(interval[1])),
    )
    text, between, _ = written(parameter, factor)
    return f"{text} ({between or NO_NUMBER})"
