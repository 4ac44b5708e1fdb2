"""The offline page of an explanation: one HTML file that needs neither network nor script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agent.explain.answer.names import OWN_EFFECT, effect_name
from agent.explain.answer.result import Explanation, NextExperiment
from agent.numbers import units_unbroken
from agent.record.atomic import publish
from agent.report import provenance
from agent.report.estimate import Picture
from agent.report.explanation import errors, rows
from agent.report.explanation.figure_curve import caption_of
from agent.report.explanation.figure_heard import CAPTION as HEARD
from agent.report.explanation.head import Head, head_of
from agent.report.explanation.map import heat_map
from agent.report.explanation.pictures import (
    finding_picture,
    heard_picture,
    left_over_pictures,
    moved_picture,
    proof_picture,
    spectrum_pictures,
    trace_pictures,
    unshaded,
    varying_picture,
)
from agent.report.explanation.words import (
    briefly,
    decidable,
    found_title,
    heading,
    motion_needed,
    next_command,
    not_judged,
    qualification,
    set_up_beside,
    share,
    tells_apart,
    trajectory_hint,
    unexplained_in_words,
    verdict_words,
    what_to_do,
)
from agent.report.page import render

_IN_NUMBERS = (
    *("tiles", "findings", "errors", "proof_picture", "proof_facts", "opened", "folded"),
    *("spectra", "varies", "left_over", "unshaded", "map", "moved", "moved_picture", "floor"),
)


@dataclass(frozen=True)
class FindingView:
    """One finding: what is written, and its pictures."""

    row: rows.FindingRow
    picture: Picture | None
    caption: str
    heard: Picture | None = None
    heard_caption: str = HEARD


@dataclass(frozen=True)
class NextView:
    """The next experiment: what it is, how long it takes, how it is run."""

    sentence: str
    set_up: str
    brief: str
    tells_apart: str
    lasts: str
    hint: str
    command: str


def write_explanation_page(
    path: Path,
    explanation: Explanation,
    *,
    title: str = "",
    robot: str = "",
    axis: int | str = "",
    next_file: str = "",
    metadata: Mapping[str, object] | None = None,
) -> Path:
    """Write the page, whole or not at all. See `explanation_page`.

    Raises
    ------
    agent.errors.StorageError
        If the file cannot be written.
    """
    html = explanation_page(
        explanation, title=title, robot=robot, axis=axis, next_file=next_file, metadata=metadata
    )
    publish({path: html.encode("utf-8")}, overwrite=True)
    return path


def explanation_page(
    explanation: Explanation,
    *,
    title: str = "",
    robot: str = "",
    axis: int | str = "",
    next_file: str = "",
    metadata: Mapping[str, object] | None = None,
) -> str:
    """Return the page as text; the same input gives the same text.

    Parameters
    ----------
    explanation : Explanation
        What is shown; every text in it is untrusted and escaped.
    title, robot : str
        As the user calls them.
    axis : int or str
        As the cell numbers it.
    next_file : str
        Where the next experiment's trajectory was written, as the user will name it.
    metadata : mapping, optional
        The recordings' metadata (contract section 2).
    """
    names = (*explanation.recordings, *explanation.held_out)
    rivals = _rivals(explanation)
    head = head_of(explanation, listed=bool(rivals))
    return render(
        "explanation.html.j2",
        title=title or "Where simulation and recordings differ",
        robot=robot,
        axis=str(axis),
        explanation=explanation,
        verdict=verdict_words(explanation),
        head=_unbroken(head),
        qualification=qualification(explanation),
        steps=what_to_do(explanation),
        reasons=[units_unbroken(reason) for reason in explanation.reasons],
        rivals=rivals,
        following=_next(explanation.next_experiment, str(axis), next_file),
        further=[
            _next(e, str(axis), "")
            for e in explanation.further_experiments
            if e != explanation.next_experiment
        ],
        found_title=found_title(explanation),
        unexplained=unexplained_in_words(explanation),
        judged_on=errors.judged_on(explanation),
        unexplained_where=rows.places(explanation.unexplained_where, names),
        carried=_carried(explanation),
        extended=_is_extended(explanation),
        not_judged=[(heading("; ".join(labels)), why) for why, labels in not_judged(explanation)],
        aliases=[" / ".join(effect_name(e) for e in group) for group in explanation.aliases],
        recordings=_recordings(explanation),
        about=provenance.metadata_rows(metadata or {}),
        **_in_numbers(explanation, head),
    )


def _in_numbers(explanation: Explanation, head: Head) -> Mapping[str, Any]:
    """Return every picture and table of the page; all empty where nothing could be decided."""
    unit, stages = errors.error_rows(explanation)
    if not decidable(explanation):
        empty: dict[str, Any] = dict.fromkeys(_IN_NUMBERS, ())
        return empty | {"decidable": False, "error_unit": unit, "undrawn": 0}
    opened, folded, undrawn = trace_pictures(explanation)
    return {
        "decidable": True,
        "tiles": errors.tiles(explanation),
        "findings": _findings(explanation, head),
        "errors": stages,
        "error_unit": unit,
        "proof_picture": proof_picture(explanation),
        "proof_facts": errors.proof_facts(explanation),
        "opened": opened,
        "folded": folded,
        "undrawn": undrawn,
        "spectra": spectrum_pictures(explanation),
        "varies": varying_picture(explanation),
        "left_over": left_over_pictures(explanation),
        "unshaded": unshaded(explanation),
        "map": heat_map(explanation.cells),
        "moved": [rows.moved_row(m) for m in explanation.moved],
        "moved_picture": moved_picture(explanation),
        "floor": errors.floor_rows(explanation),
    }


def _unbroken(head: Head) -> Head:
    """Return the head with its units kept on the line of their numbers."""
    return Head(
        units_unbroken(head.first),
        units_unbroken(head.worth),
        tuple(units_unbroken(line) for line in head.further),
        tuple(units_unbroken(line) for line in head.rest),
    )


def _findings(explanation: Explanation, head: Head) -> list[FindingView]:
    """Return the findings; what a picture shows is said beside the first of its kind."""
    out: list[FindingView] = []
    for finding in explanation.told:
        caption = "" if finding.curve is None else caption_of(finding.curve)
        if caption in [view.caption for view in out]:
            caption = ""
        row = rows.finding_row(finding, explanation, head)
        heard = heard_picture(finding)
        out.append(FindingView(row, finding_picture(finding), caption, heard))
    return out


def _next(experiment: NextExperiment | None, axis: str, file: str) -> NextView | None:
    if experiment is None:
        return None
    return NextView(
        sentence=units_unbroken(experiment.sentence),
        set_up=units_unbroken(set_up_beside(experiment)),
        brief=units_unbroken(briefly(experiment)),
        tells_apart=tells_apart(experiment),
        lasts=motion_needed(experiment),
        hint=trajectory_hint(experiment, file),
        command=next_command(experiment, axis, file),
    )


def _rivals(explanation: Explanation) -> list[tuple[str, str]]:
    """Return probability and name of each cause that a tie is between, the likeliest first.

    Where several findings have one, each name stands as the first of them has it.
    """
    if explanation.verdict != "tied":
        return []
    causes: dict[str, float] = {}
    for finding in explanation.told:
        if finding.alternatives:
            causes.setdefault(finding.effect, finding.probability)
            for other in finding.alternatives:
                causes.setdefault(other.effect, other.probability)
    ranked = sorted(causes.items(), key=lambda cause: -cause[1])
    return [(share(probability), effect_name(effect)) for effect, probability in ranked]


def _carried(explanation: Explanation) -> Sequence[str]:
    """Return what the extended twin includes beside rigid body, Coulomb and viscous friction."""
    twin = explanation.twin
    return [] if twin is None else list(dict.fromkeys(effect_name(e.id) for e in twin.effects))


def _is_extended(explanation: Explanation) -> bool:
    """Return whether the twin that is written holds anything that was found."""
    twin = explanation.twin
    told = any(finding.form != OWN_EFFECT for finding in explanation.findings)
    return twin is not None and (bool(twin.effects) or told)


def _recordings(explanation: Explanation) -> list[tuple[str, str, str]]:
    """Return number, name and use of every recording, as regions and pictures count them."""
    used = [(name, "fit") for name in explanation.recordings]
    used += [(name, "hold-out: not seen by the fit") for name in explanation.held_out]
    return [(str(k), name, role) for k, (name, role) in enumerate(used, start=1)]
