"""The offline page of an explanation: one HTML file that needs neither network nor script."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agent.explain.result import Explanation, Finding, NextExperiment, Trace
from agent.numbers import units_unbroken
from agent.record.atomic import publish
from agent.report import explanation_rows as rows
from agent.report import provenance
from agent.report.canvas import data_uri
from agent.report.estimate import Picture
from agent.report.explanation_map import heat_map
from agent.report.explanation_words import (
    decidable,
    duration,
    effect_label,
    heading,
    next_command,
    share,
    tells_apart,
    variable,
    verdict_words,
    what_to_do,
)
from agent.report.figure_explanation_curve import figure_finding, finding_in_words
from agent.report.figure_explanation_cycle import (
    SHADED,
    figure_residual,
    reach_of,
    residual_in_words,
)
from agent.report.figure_explanation_left import (
    figure_left_over,
    left_over,
    left_over_in_words,
)
from agent.report.figure_explanation_moved import figure_moved, moved_in_words
from agent.report.figure_explanation_proof import errors_in_words, figure_errors
from agent.report.page import render

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RECORDINGS_OPEN = 3
RECORDINGS_DRAWN = 10


@dataclass(frozen=True)
class FindingView:
    """One finding: what is written, and its picture."""

    row: rows.FindingRow
    picture: Picture | None


@dataclass(frozen=True)
class NextView:
    """The next experiment: what it is, how long it takes, how it is run."""

    sentence: str
    set_up: str
    tells_apart: str
    lasts: str
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
    decided = decidable(explanation)
    unit, errors = rows.error_rows(explanation)
    opened, folded, undrawn = _traces(explanation) if decided else ([], [], 0)
    names = (*explanation.recordings, *explanation.held_out)
    return render(
        "explanation.html.j2",
        title=title or "Where simulation and recordings differ",
        robot=robot,
        axis=str(axis),
        explanation=explanation,
        decidable=decided,
        verdict=verdict_words(explanation),
        sentence=units_unbroken(explanation.sentence),
        steps=what_to_do(explanation),
        reasons=[units_unbroken(reason) for reason in explanation.reasons],
        rivals=_rivals(explanation),
        following=_next(explanation.next_experiment, str(axis), next_file),
        further=[_next(e, str(axis), "") for e in explanation.further_experiments],
        tiles=rows.tiles(explanation) if decided else (),
        findings=[_finding(f, explanation) for f in explanation.findings] if decided else [],
        errors=errors if decided else (),
        error_unit=unit,
        proof_picture=_proof(explanation) if decided else None,
        proof_facts=rows.proof_facts(explanation) if decided else (),
        opened=opened,
        folded=folded,
        undrawn=undrawn,
        unexplained_share=share(explanation.unexplained_share),
        unexplained_where=rows.places(explanation.unexplained_where, names),
        left_over=_left_over(explanation) if decided else [],
        unshaded=_unshaded(explanation) if decided else [],
        map=heat_map(explanation.cells) if decided else None,
        moved=[rows.moved_row(m) for m in explanation.moved] if decided else [],
        moved_picture=_moved(explanation) if decided else None,
        carried=_carried(explanation),
        not_judged=[(heading(effect_label(e)), why) for e, why in explanation.not_judged.items()],
        aliases=[" / ".join(effect_label(e) for e in group) for group in explanation.aliases],
        floor=rows.floor_rows(explanation) if decided else (),
        recordings=_recordings(explanation),
        about=provenance.metadata_rows(metadata or {}),
    )


def _finding(finding: Finding, explanation: Explanation) -> FindingView:
    curve, picture = finding.curve, None
    if curve is not None and curve.at.size:
        picture = _picture(
            figure_finding(curve, finding.where),
            figure_finding(curve, finding.where, narrow=True),
            finding_in_words(curve),
        )
    return FindingView(rows.finding_row(finding, explanation), picture)


def _next(experiment: NextExperiment | None, axis: str, file: str) -> NextView | None:
    if experiment is None:
        return None
    return NextView(
        sentence=units_unbroken(experiment.sentence),
        set_up=units_unbroken(experiment.set_up),
        tells_apart=tells_apart(experiment),
        lasts=duration(experiment.seconds),
        command=next_command(experiment, axis, file),
    )


def _rivals(explanation: Explanation) -> list[tuple[str, str]]:
    """Return probability and name of each cause that a tie is between, the likeliest first."""
    if explanation.verdict != "tied":
        return []
    causes: dict[str, float] = {}
    for finding in explanation.findings:
        if finding.alternatives:
            causes[finding.effect] = finding.probability
            causes.update((other.effect, other.probability) for other in finding.alternatives)
    ranked = sorted(causes.items(), key=lambda cause: -cause[1])
    return [(share(probability), effect_label(effect)) for effect, probability in ranked]


def _proof(explanation: Explanation) -> Picture:
    return _picture(
        figure_errors(explanation),
        figure_errors(explanation, narrow=True),
        errors_in_words(explanation),
    )


def _moved(explanation: Explanation) -> Picture | None:
    moved = explanation.moved
    if not moved:
        return None
    return _picture(figure_moved(moved), figure_moved(moved, narrow=True), moved_in_words(moved))


def _traces(explanation: Explanation) -> tuple[list[Picture], list[Picture], int]:
    """Return the recordings drawn openly, those folded away, and how many are not drawn.

    What the fit had not seen comes first: that is where the proof is. All share one ordinate.
    """
    traces = sorted(_shown(explanation), key=lambda trace: not trace.held_out)
    reach_nm = max((reach_of(trace) for trace in traces), default=0.0)
    pictures = [_trace(t, explanation, reach_nm) for t in traces[:RECORDINGS_DRAWN]]
    undrawn = len(traces) - len(pictures)
    return pictures[:RECORDINGS_OPEN], pictures[RECORDINGS_OPEN:], undrawn


def _shown(explanation: Explanation) -> list[Trace]:
    """Return the traces without the stage that is not there when nothing was found."""
    if explanation.findings:
        return list(explanation.traces)
    return [
        dataclasses.replace(trace, extended_nm=np.full(trace.time_s.shape, np.nan))
        for trace in explanation.traces
    ]


def _left_over(explanation: Explanation) -> list[Picture]:
    """Return what is left along the axis of every region that has no explanation."""
    pictures = []
    for name in dict.fromkeys(region.variable for region in explanation.unexplained_where):
        left = left_over(_shown(explanation), name)
        if left is not None:
            where = explanation.unexplained_where
            pictures.append(
                _picture(
                    figure_left_over(left, where),
                    figure_left_over(left, where, narrow=True),
                    left_over_in_words(left),
                )
            )
    return pictures


def _trace(trace: Trace, explanation: Explanation, reach_nm: float) -> Picture:
    located = [region for finding in explanation.findings for region in finding.where]
    names = (*explanation.recordings, *explanation.held_out)
    index = names.index(trace.recording) if trace.recording in names else -1

    def drawn(*, narrow: bool) -> Figure:
        return figure_residual(
            trace,
            located,
            explanation.unexplained_where,
            index=index,
            reach_nm=reach_nm,
            narrow=narrow,
        )

    role = " (hold-out: not seen by the fit)" if trace.held_out else ""
    return _picture(
        drawn(narrow=False), drawn(narrow=True), residual_in_words(trace), trace.recording + role
    )


def _unshaded(explanation: Explanation) -> list[str]:
    """Return the axes of located regions that time and velocity do not tell: nothing is shaded."""
    regions = [region for finding in explanation.findings for region in finding.where]
    regions += explanation.unexplained_where
    names = dict.fromkeys(region.variable for region in regions)
    return [variable(name).label for name in names if name not in SHADED]


def _carried(explanation: Explanation) -> Sequence[str]:
    """Return what the extended twin includes beside rigid body, Coulomb and viscous friction."""
    twin = explanation.twin
    return [] if twin is None else [effect_label(effect.id) for effect in twin.effects]


def _recordings(explanation: Explanation) -> list[tuple[str, str, str]]:
    """Return number, name and use of every recording, as regions and pictures count them."""
    used = [(name, "fit") for name in explanation.recordings]
    used += [(name, "hold-out: not seen by the fit") for name in explanation.held_out]
    return [(str(k), name, role) for k, (name, role) in enumerate(used, start=1)]


def _picture(wide: Figure, narrow: Figure, alt: str, over: str = "") -> Picture:
    return Picture(data_uri(wide), data_uri(narrow), alt, over)
