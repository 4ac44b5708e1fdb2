"""The report's tables, row by row: what is written in which cell."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from agent.identify.result import Estimate, FrictionCurve, FrictionModelFit, Parameter
from agent.identify.rigid.forward import in_words
from agent.identify.sentence import is_method, percent, percent_number
from agent.numbers import (
    Scale,
    fixed,
    parameter_label,
    parameter_unit,
    scale_for,
    scales_for,
    significant,
    units_unbroken,
    written,
)
from agent.report.laws import model_label


@dataclass(frozen=True)
class ParameterRow:
    """One parameter as written; `value` is empty and `reason` says why when not identified."""

    label: str
    value: str
    interval: str
    unit: str
    identified: bool
    reason: str


@dataclass(frozen=True)
class ParameterGroup:
    """Parameters of one fit, under one heading."""

    title: str
    basis: str
    rows: tuple[ParameterRow, ...]


@dataclass(frozen=True)
class ModelRow:
    """One friction law in the table of models."""

    name: str
    selected: bool
    bic: str
    bic_above_best: str
    rmse: str
    fit_percent: str
    reason: str
    parameters: ParameterGroup


@dataclass(frozen=True)
class PointTable:
    """The friction curve's points: velocity, friction, interval, gravity, samples."""

    unit: str
    rows: tuple[tuple[str, str, str, str, str], ...]


@dataclass(frozen=True)
class Tile:
    """One key number above the table."""

    label: str
    value: str
    unit: str
    detail: str


def parameter_groups(estimate: Estimate) -> tuple[ParameterGroup, ...]:
    """Return the selected law's and the rigid body's parameters in common units."""
    selected, rigid = estimate.selected_model, estimate.rigid_body
    scales = _common_scales(estimate)
    groups = []
    if selected is not None:
        groups.append(
            _group(
                f"Friction curve: {model_label(selected.model)}",
                "from the means of the steady windows",
                selected.parameters,
                scales,
            )
        )
    if rigid is not None:
        groups.append(
            _group("Rigid body", "from all moving samples (4.5)", rigid.parameters, scales)
        )
    return tuple(groups)


def tiles(estimate: Estimate) -> tuple[Tile, ...]:
    """Return the few numbers that a technician looks for first."""
    selected, rigid = estimate.selected_model, estimate.rigid_body
    own = dict(rigid.parameters) if rigid else {}
    own |= dict(selected.parameters) if selected else {}
    scales = _common_scales(estimate)
    found = []
    for name in ("coulomb_nm", "viscous_nm_s_per_rad", "inertia_kg_m2"):
        parameter = own.get(name)
        if parameter is not None and parameter.identified:
            row = _row(name, parameter, scales)
            detail = f"95 %: {row.interval}" if row.interval else ""
            found.append(Tile(row.label, row.value, row.unit, detail))
    if rigid is not None and math.isfinite(rigid.fit_percent):
        found.append(
            Tile(
                "Fit of the rigid body",
                percent_number(rigid.fit_percent),
                "%",
                "of the torque in all motion",
            )
        )
    return tuple(found)


def notes_as_sentences(estimate: Estimate) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return what to bear in mind, and how was computed, each note as a sentence."""
    unseen = () if estimate.validation is None else (estimate.validation.recording,)
    names = (*estimate.recordings, *unseen)
    notes = [(note, _as_sentence(note, names)) for note in estimate.notes]
    kept = tuple(sentence for note, sentence in notes if not is_method(note))
    return kept, tuple(sentence for note, sentence in notes if is_method(note))


def _as_sentence(note: str, recordings: Sequence[str]) -> str:
    """Begin with a capital, unless it is a recording's name, and end with a full stop."""
    named = any(note.startswith(f"{name}:") for name in recordings)
    begun = note if named or not note else note[0].upper() + note[1:]
    return units_unbroken(begun if begun.endswith((".", "?", "!")) else f"{begun}.")


def model_rows(models: Sequence[FrictionModelFit]) -> tuple[ModelRow, ...]:
    """Return the friction laws, best (lowest BIC) first, the errors in one unit."""
    scale = model_error_scale(models)
    finite = [m.bic for m in models if math.isfinite(m.bic)]
    best = min(finite, default=math.nan)
    ordered = sorted(models, key=lambda m: m.bic if math.isfinite(m.bic) else math.inf)
    scales = scales_for(item for m in models for item in m.parameters.items())
    return tuple(
        ModelRow(
            name=model_label(m.model),
            selected=m.selected,
            bic=fixed(m.bic, 1),
            bic_above_best=fixed(m.bic - best, 1),
            rmse=significant(m.rmse_nm * scale.factor, 3),
            fit_percent=percent_number(m.fit_percent),
            reason=m.reason,
            parameters=_group(model_label(m.model), "", m.parameters, scales),
        )
        for m in ordered
    )


def model_error_scale(models: Sequence[FrictionModelFit]) -> Scale:
    """Return the unit in which all laws' errors are written."""
    return scale_for("N m", [m.rmse_nm for m in models])


def rigid_rows(estimate: Estimate) -> tuple[tuple[str, str], ...]:
    """Return how well the rigid body fits and predicts, as label and text."""
    rigid, validation = estimate.rigid_body, estimate.validation
    rows: list[tuple[str, str]] = []
    if rigid is not None:
        error = scale_for("N m", [rigid.rmse_nm])
        rows += [
            ("Residual, rms", f"{significant(rigid.rmse_nm * error.factor, 3)} {error.unit}"),
            ("Fit", percent(rigid.fit_percent)),
            ("Condition number (4.11)", significant(rigid.condition_number, 3)),
        ]
    if validation is not None:
        error = scale_for("N m", [validation.rmse_nm])
        rows += [
            ("Validation run", validation.recording),
            (
                "Validation residual, rms",
                f"{significant(validation.rmse_nm * error.factor, 3)} {error.unit}",
            ),
            ("Validation fit", percent(validation.fit_percent)),
            (
                "Validation torque error",
                f"{fixed(validation.relative_torque_error_percent, 2)} %",
            ),
        ]
    if validation is not None and validation.position is not None:
        rows.append(("Validation position", in_words(validation.position)))
    return tuple(rows)


def curve_points(curve: FrictionCurve | None) -> PointTable | None:
    """Return the friction curve's points as a table, each number by the digits rule."""
    if curve is None or curve.velocity_rad_s.size == 0:
        return None
    scale = scale_for("N m", curve.friction_nm.tolist())
    rows = []
    for k, velocity in enumerate(curve.velocity_rad_s.tolist()):
        low, high = curve.ci95_nm[k].tolist()
        friction = Parameter(float(curve.friction_nm[k]), (low, high))
        value, interval, half_width = written(friction, scale.factor)
        places = len(half_width.partition(".")[2]) if half_width else 3
        gravity = fixed(float(curve.gravity_nm[k]) * scale.factor, places)
        rows.append((significant(velocity), value, interval, gravity, str(curve.samples[k])))
    return PointTable(scale.unit, tuple(rows))


def _common_scales(estimate: Estimate) -> dict[str, Scale]:
    """One unit for each kind of parameter in the table, so that its numbers can be compared."""
    selected, rigid = estimate.selected_model, estimate.rigid_body
    items = list(selected.parameters.items()) if selected else []
    items += list(rigid.parameters.items()) if rigid else []
    return scales_for(items)


def _group(
    title: str, basis: str, parameters: Mapping[str, Parameter], scales: Mapping[str, Scale]
) -> ParameterGroup:
    rows = tuple(_row(name, parameter, scales) for name, parameter in parameters.items())
    return ParameterGroup(title, basis, rows)


def _row(name: str, parameter: Parameter, scales: Mapping[str, Scale]) -> ParameterRow:
    unit = parameter_unit(name)
    if not parameter.identified:
        return ParameterRow(
            parameter_label(name), "", "", "", False, parameter.reason or "no reason given"
        )
    scale = scales.get(unit, Scale(1.0, unit))
    value, interval, _ = written(parameter, scale.factor)
    return ParameterRow(parameter_label(name), value, interval, scale.unit, True, "")
