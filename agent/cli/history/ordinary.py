"""`stribeck ordinary`: friction from ordinary work, and how it lies to a dedicated cycle."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

from agent.conclude.comparable import one_axis
from agent.conclude.outcome import conclude, signals_of
from agent.errors import InputError
from agent.identify.signals.preprocess import read_motion
from agent.identify.uncertainty import student_975
from agent.monitor.ordinary.ordinary import Comparison, OrdinaryFriction, compare, ordinary_friction
from agent.numbers import parameter_label, parameter_unit, scale_for, written
from agent.record.reading import read_all
from agent.record.recording import Recording

SCHEMA = "stribeck.ordinary/1"


def run_ordinary(work: Sequence[str], dedicated: Sequence[str], *, as_json: bool) -> None:
    """Estimate friction from recordings of ordinary work and print it.

    Raises
    ------
    agent.errors.InputError
        The recordings cannot be used or are not of one axis.
    """
    recordings = read_all(work)
    reference = read_all(dedicated) if dedicated else ()
    one_axis([*recordings, *reference])
    found = ordinary_friction([read_motion(signals_of(r)) for r in recordings])
    beside = _beside(found, reference) if reference else None
    if as_json:
        typer.echo(json.dumps(_document(recordings, found, beside), indent=2, allow_nan=False))
    else:
        typer.echo(ordinary_text(found, beside))


def _beside(found: OrdinaryFriction, reference: Sequence[Recording]) -> Comparison | None:
    estimate = conclude(reference).estimate
    if estimate.friction_curve is None:
        raise InputError(
            f"The dedicated cycle carries no friction curve: {'; '.join(estimate.reasons)}."
        )
    if not found.decidable:
        return None
    span = estimate.quality.temperature_degc
    warmth = math.nan if span is None else 0.5 * (span[0] + span[1])
    try:
        return compare(found, estimate.friction_curve, warmth)
    except ValueError:
        return None


def _document(
    recordings: Sequence[Recording], found: OrdinaryFriction, beside: Comparison | None
) -> dict[str, Any]:
    seen = found.excitation
    reach = student_975(found.dof) * found.deviation_nm
    return {
        "schema": SCHEMA,
        "recordings": [Path(r.source).name for r in recordings],
        "decidable": found.decidable,
        "reasons": list(found.reasons),
        "excitation": None
        if seen is None
        else {
            "speeds_rad_s": list(seen.speeds_rad_s),
            "forward_share": seen.forward_share,
            "steady_share": seen.steady_share,
            "condition_number": _finite(seen.condition_number),
            "arm_stroke_rad": _finite(seen.arm_stroke_rad),
        },
        "friction": {
            "velocity_rad_s": found.speed_rad_s.tolist(),
            "friction_nm": found.friction_nm.tolist(),
            "ci95_nm": [
                [float(f - r), float(f + r)] for f, r in zip(found.friction_nm, reach, strict=True)
            ],
        },
        "rigid_body": None if found.body is None else found.body.to_json(),
        "comparison": None
        if beside is None
        else {
            "agrees": beside.agrees,
            "velocity_rad_s": beside.speed_rad_s.tolist(),
            "difference_nm": beside.difference_nm.tolist(),
            "deviation_nm": beside.deviation_nm.tolist(),
            "sentence": beside.sentence,
        },
    }


def ordinary_text(found: OrdinaryFriction, beside: Comparison | None) -> str:
    """Return what a technician reads."""
    lines = []
    if found.excitation is not None:
        slow, middle, fast = found.excitation.speeds_rad_s
        lines.append(
            f"The work moves at {slow:.3g} to {fast:.3g} rad/s (half of the time below "
            f"{middle:.3g}), {100.0 * found.excitation.forward_share:.0f} % of it forward, "
            f"{100.0 * found.excitation.steady_share:.0f} % at steady speed; condition number "
            f"{found.excitation.condition_number:.3g}."
        )
    if not found.decidable:
        lines.append("Friction is not decidable from this work, because:")
        return "\n".join([*lines, *(f"  - {reason}" for reason in found.reasons)])
    lines += ["", "Friction by speed (95 % interval):"]
    for v, f, d in zip(found.speed_rad_s, found.friction_nm, found.deviation_nm, strict=True):
        lines.append(f"  {v:8.3g} rad/s  {f:8.4g} N m  ±{student_975(found.dof) * d:.2g}")
    lines += [f"  not known: {reason}" for reason in found.reasons]
    lines += ["", "As one plain law over these speeds:"]
    for name in ("coulomb_nm", "viscous_nm_s_per_rad", "inertia_kg_m2", "gravity_sin_nm"):
        parameter = found.parameter(name)
        if not parameter.identified:
            lines.append(f"  {parameter_label(name):<32} not identified: {parameter.reason}")
            continue
        scale = scale_for(parameter_unit(name), (parameter.value,))
        value, interval, _ = written(parameter, scale.factor)
        lines.append(f"  {parameter_label(name):<32} {value:>9} {scale.unit} ({interval})")
    if beside is not None:
        lines += ["", f"Beside the dedicated cycle {beside.sentence}."]
    return "\n".join(lines)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
