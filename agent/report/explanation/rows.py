"""An explanation's findings and moves, row by row: what is written in which cell."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from agent.explain.answer.names import OWN_EFFECT, OWN_NUMBER, effect_name
from agent.explain.answer.own_effect import finding_name
from agent.explain.answer.result import Explanation, Finding, Moved, Region
from agent.explain.answer.sentences import shared
from agent.explain.answer.small_share import as_large, times_without
from agent.identify.result import Parameter
from agent.numbers import (
    NO_NUMBER,
    Scale,
    parameter_label,
    parameter_unit,
    scale_for,
    significant,
    units_unbroken,
    written,
)
from agent.report.explanation.errors import error_scale, in_scale
from agent.report.explanation.head import Head
from agent.report.explanation.places import regions_in_words
from agent.report.explanation.quantities import quantity_label, quantity_scale
from agent.report.explanation.words import carried, heading, is_biased, share
from agent.report.rows import ParameterRow

_CHOSEN = "chosen, not measured"  # where the law's numbers are said to hold
_TAKEN = frozenset({"half_gap_spread", "arm_yield_rad"})
"""Numbers of a gap's law that are the same for every gear, unless they come with an interval."""
_RESTS_ON = {"driving_excess": "at the simulation's weight"}
_PLACES = frozenset({"neutral_arm_rad", "center_arm_rad"})  # which may be nought as any other


@dataclass(frozen=True)
class AlternativeRow:
    """What it could be instead."""

    label: str
    probability: str
    told_apart_by: str


@dataclass(frozen=True)
class FindingRow:
    """One finding in words; its picture stands beside it."""

    rank: int
    label: str
    energy_share: str
    shared: str
    probability: str
    form: str
    sentence: str
    caveat: str
    where: tuple[str, ...]
    without: str
    parameters: tuple[ParameterRow, ...]
    alternatives: tuple[AlternativeRow, ...]

    @property
    def all_identified(self) -> bool:
        """Tell whether every number was identified, so that the table need not say of which."""
        return all(parameter.identified for parameter in self.parameters)


@dataclass(frozen=True)
class MovedRow:
    """How one number of the simulation moved."""

    label: str
    unit: str
    given: str
    refitted: str
    extended: str
    sigmas: str
    biased: bool


def finding_row(finding: Finding, explanation: Explanation, head: Head) -> FindingRow:
    """Return one finding in words; what the head of the page says already is not said again."""
    names = (*explanation.recordings, *explanation.held_out)
    said = finding.said
    return FindingRow(
        rank=finding.rank,
        label=heading(finding_name(finding)),
        energy_share=carried(finding.energy_share),
        shared=shared(
            finding.form,
            beside_numbers=any(f.form == OWN_NUMBER for f in explanation.findings),
        ),
        probability=share(finding.probability),
        form=finding.form,
        sentence=units_unbroken(said.place or ("" if head.says(said.lead) else said.lead)),
        caveat=units_unbroken(said.caveat),
        where=places(finding.where, names),
        without=_without(finding, explanation),
        parameters=parameter_rows(finding.parameters),
        alternatives=tuple(
            AlternativeRow(
                heading(effect_name(other.effect)), share(other.probability), other.told_apart_by
            )
            for other in finding.alternatives
        ),
    )


def _without(finding: Finding, explanation: Explanation) -> str:
    """Return the error without a finding, and how many times the error with it that is."""
    without = finding.holdout_rmse_without_nm
    if not math.isfinite(without):
        return ""
    times = times_without(finding, explanation.holdout, explanation.floor.value_nm)
    beside = f", {as_large(times)}" if math.isfinite(times) else ""
    instead = "with the simulation's own numbers" if finding.form == OWN_EFFECT else "without it"
    error = in_scale(without, error_scale(explanation))
    return units_unbroken(f"{instead} the error is {error}{beside}")


def places(regions: Sequence[Region], recordings: Sequence[str]) -> tuple[str, ...]:
    """Return where a mismatch lives, as it stands on the page."""
    return tuple(units_unbroken(heading(said)) for said in regions_in_words(regions, recordings))


def parameter_rows(parameters: Mapping[str, Parameter]) -> tuple[ParameterRow, ...]:
    """Return parameters as written, each in the unit that its size asks for.

    A size that a law lacks by its form, as a cable's slope that only stiffens, is no finding.
    """
    rows = []
    for name, parameter in parameters.items():
        label = quantity_label(name)
        if not parameter.identified or not math.isfinite(parameter.value):
            reason = parameter.reason or "the data do not carry it"
            rows.append(ParameterRow(label, "", "", "", False, reason))
            continue
        if parameter.value == 0.0 and parameter.ci95 is None and name not in _PLACES:
            continue
        scale = quantity_scale(name, [parameter.value])
        value, interval, _ = written(parameter, scale.factor)
        taken = name in _TAKEN and parameter.ci95 is None
        how = _CHOSEN if name.startswith("reference_") or taken else _RESTS_ON.get(name, "")
        rows.append(ParameterRow(label, value, interval, scale.unit, True, how))
    return tuple(rows)


def moved_row(moved: Moved) -> MovedRow:
    """Return how one number of the simulation moved, as written."""
    known = [p.value for p in (moved.refitted, moved.extended) if p.identified]
    scale = scale_for(parameter_unit(moved.parameter), [moved.given, *known])
    return MovedRow(
        label=parameter_label(moved.parameter),
        unit=scale.unit,
        given=significant(moved.given * scale.factor),
        refitted=_with_interval(moved.refitted, scale),
        extended=_with_interval(moved.extended, scale),
        sigmas=significant(abs(moved.sigmas), 2),
        biased=is_biased(moved),
    )


def _with_interval(parameter: Parameter, scale: Scale) -> str:
    if not parameter.identified or not math.isfinite(parameter.value):
        return f"not identified{': ' * bool(parameter.reason)}{parameter.reason}"
    value, interval, _ = written(parameter, scale.factor)
    return f"{value} ({interval})" if interval else value or NO_NUMBER
