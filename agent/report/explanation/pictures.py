"""The pictures of an explanation's page, each in both widths and in words."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from agent.explain.answer.result import Explanation, Finding, Trace
from agent.report.estimate import Picture
from agent.report.explanation.figure_curve import figure_finding, finding_in_words
from agent.report.explanation.figure_cycle import (
    SHADED,
    figure_residual,
    reach_of,
    residual_in_words,
)
from agent.report.explanation.figure_heard import figure_ringing, ringing_in_words
from agent.report.explanation.figure_left import (
    figure_left_over,
    left_over,
    left_over_in_words,
)
from agent.report.explanation.figure_moved import figure_moved, moved_in_words
from agent.report.explanation.figure_proof import error_rows, errors_in_words, figure_errors
from agent.report.explanation.figure_spectrum import figure_spectrum, spectrum_in_words
from agent.report.explanation.figure_varying import figure_varying, varying_in_words
from agent.report.explanation.places import variable
from agent.report.figures.canvas import data_uri

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RECORDINGS_OPEN = 3
RECORDINGS_DRAWN = 10


def finding_picture(finding: Finding) -> Picture | None:
    """Return a finding's curve over the data; None where it brings none."""
    curve = finding.curve
    if curve is None or not curve.at.size:
        return None
    return _picture(
        figure_finding(curve, finding.where),
        figure_finding(curve, finding.where, narrow=True),
        finding_in_words(curve),
    )


def heard_picture(finding: Finding) -> Picture | None:
    """Return what of a finding is heard above the compared band; None where nothing is."""
    ringing = finding.ringing
    if ringing is None:
        return None
    return _picture(
        figure_ringing(ringing), figure_ringing(ringing, narrow=True), ringing_in_words(ringing)
    )


def proof_picture(explanation: Explanation) -> Picture | None:
    """Return the errors against the noise floor, and the placebo; None where none was taken."""
    if not error_rows(explanation):
        return None
    return _picture(
        figure_errors(explanation),
        figure_errors(explanation, narrow=True),
        errors_in_words(explanation),
    )


def moved_picture(explanation: Explanation) -> Picture | None:
    """Return how the simulation's numbers moved; None where none is told."""
    moved = explanation.moved
    if not moved:
        return None
    return _picture(figure_moved(moved), figure_moved(moved, narrow=True), moved_in_words(moved))


def trace_pictures(explanation: Explanation) -> tuple[list[Picture], list[Picture], int]:
    """Return the recordings drawn openly, those folded away, and how many are not drawn.

    What the fit had not seen comes first: that is where the proof is. All share one ordinate.
    """
    traces = sorted(_shown(explanation), key=lambda trace: not trace.held_out)
    reach_nm = max((reach_of(trace) for trace in traces), default=0.0)
    pictures = [_trace(t, explanation, reach_nm) for t in traces[:RECORDINGS_DRAWN]]
    undrawn = len(traces) - len(pictures)
    return pictures[:RECORDINGS_OPEN], pictures[RECORDINGS_OPEN:], undrawn


def spectrum_pictures(explanation: Explanation) -> list[Picture]:
    """Return the spectra of what swings at a frequency of its own."""
    where = explanation.unexplained_where
    return [
        _picture(
            figure_spectrum(curve, where),
            figure_spectrum(curve, where, narrow=True),
            spectrum_in_words(curve),
        )
        for curve in explanation.unexplained_curves
    ]


def varying_picture(explanation: Explanation) -> Picture | None:
    """Return which number would have to vary where no law carries a mismatch; None for none."""
    varies = explanation.unexplained_varies
    if varies is None:
        return None
    return _picture(
        figure_varying(varies), figure_varying(varies, narrow=True), varying_in_words(varies)
    )


def left_over_pictures(explanation: Explanation) -> list[Picture]:
    """Return what is left along the axes of regions without an explanation, each in its turn.

    Along the axis of a number that would have to vary its own picture shows more.
    """
    pictures = []
    where, varies = explanation.unexplained_where, explanation.unexplained_varies
    drawn = None if varies is None else varies.variable
    for name in dict.fromkeys(r.variable for r in where if r.variable != drawn):
        left = left_over(_shown(explanation), name)
        if left is not None:
            pictures.append(
                _picture(
                    figure_left_over(left, where),
                    figure_left_over(left, where, narrow=True),
                    left_over_in_words(left),
                )
            )
    return pictures


def unshaded(explanation: Explanation) -> list[str]:
    """Return the axes of located regions that time and velocity do not tell: nothing is shaded."""
    regions = [region for finding in explanation.findings for region in finding.where]
    regions += explanation.unexplained_where
    names = dict.fromkeys(region.variable for region in regions)
    return [variable(name).label for name in names if name not in SHADED]


def _shown(explanation: Explanation) -> list[Trace]:
    """Return the traces that make a line, without the stage that nothing found cannot have."""
    traces = [trace for trace in explanation.traces if trace.time_s.size > 1]
    if explanation.findings:
        return traces
    return [
        dataclasses.replace(trace, extended_nm=np.full(trace.time_s.shape, np.nan))
        for trace in traces
    ]


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


def _picture(wide: Figure, narrow: Figure, alt: str, over: str = "") -> Picture:
    return Picture(data_uri(wide), data_uri(narrow), alt, over)
