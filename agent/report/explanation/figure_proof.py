"""The proof as dots: errors on data not seen against the noise floor, and the placebo."""

from __future__ import annotations

import dataclasses
import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from agent.explain.answer.names import OWN_EFFECT, effect_name
from agent.explain.answer.own_effect import finding_name
from agent.explain.answer.result import Explanation, Finding, Floor, Holdout
from agent.numbers import Scale
from agent.report.explanation.errors import error_scale, in_scale, stages
from agent.report.explanation.words import percent, torque
from agent.report.figures.canvas import (
    GRID,
    INK,
    MEASURED,
    MUTED,
    NOISE,
    PREDICTED,
    WITH_LABELS_IN,
    Panel,
    figure_of,
    plain_ticks,
    stacked,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROW_IN = 0.34
_LEFT_IN, _NARROW_LEFT_IN = 3.2, 1.62
_LABEL_CHARS = 50  # that fit there
_BESIDE_IN, _CHARACTER_IN = 0.12, 0.08  # a number begins beside its dot; in page fonts, not in one
_LOGARITHMIC_FROM = 25.0
_AGREE_POINTS = 0.5


@dataclass(frozen=True)
class Row:
    """One dot: what it is, where it lies, its interval, and how it is drawn."""

    label: str
    value: float
    color: str
    interval: tuple[float, float] | None = None
    hollow: bool = False
    short: str = ""
    marker: str = "o"


@styled
def figure_errors(explanation: Explanation, *, narrow: bool = False) -> Figure:
    """Draw the error of each stage against the noise floor, and what the placebo reaches.

    Parameters
    ----------
    explanation : Explanation
        With something compared.
    narrow : bool
        Draw for a phone's width.

    Raises
    ------
    ValueError
        If nothing was compared.
    """
    rows = error_rows(explanation)
    if not rows:
        raise ValueError("expected errors to draw, got none")
    gains = gain_rows(explanation)
    panels = [Panel(_ROW_IN * (len(rows) + 0.3), WITH_LABELS_IN)]
    if gains:
        panels.append(Panel(_ROW_IN * (len(gains) + 0.3), WITH_LABELS_IN))
    errors, *others = stacked(panels, narrow=narrow)
    _errors(errors, rows, explanation.floor, error_scale(explanation), narrow=narrow)
    source = "on data not seen by the fit" if explanation.holdout else "on the data fitted"
    errors.set_title(f"Error {source}")
    for axes in others:
        _gains(axes, gains, narrow=narrow)
    return figure_of(errors)


def errors_in_words(explanation: Explanation) -> str:
    """Say in words what `figure_errors` shows, for those who do not see it."""
    parts = [f"{row.label} {torque(row.value)}" for row in error_rows(explanation)]
    gains = [f"{row.label} {percent(row.value, 1)}" for row in gain_rows(explanation)]
    removed = f" Error removed: {', '.join(gains)}." if gains else ""
    return f"Root mean square errors: {', '.join(parts)}.{removed}"


def error_rows(explanation: Explanation) -> list[Row]:
    """Return the errors of the hold-out, or of the training data where there is none; N m rms."""
    given, refitted, extended = stages(explanation)
    rows = [
        Row("simulation as given", given.rmse_nm, MUTED),
        Row("its numbers refitted", refitted.rmse_nm, PREDICTED),
    ]
    if len(explanation.findings) > 1:
        rows += [
            Row(
                _without(finding),
                finding.holdout_rmse_without_nm,
                MEASURED,
                hollow=True,
                short=f"without finding {finding.rank}",
            )
            for finding in explanation.findings
        ]
    if explanation.findings:
        interval = extended_interval(explanation.holdout)
        extension = Row("extended by the findings", extended.rmse_nm, MEASURED, interval)
        rows.append(dataclasses.replace(extension, short="with the findings"))
    if any(math.isfinite(row.value) for row in rows):
        rows.append(Row("noise floor", explanation.floor.value_nm, INK, hollow=True, marker="D"))
    return [row for row in rows if math.isfinite(row.value)]


def extended_interval(holdout: Holdout | None) -> tuple[float, float] | None:
    """Return the interval of the error that is left, N m, from that of the improvement.

    ``rmse = (1 - improvement / 100) rmse_before``, with the error before taken as it is; None
    where neither stage before is the one that the improvement is measured from.
    """
    if holdout is None or holdout.improvement_ci95_percent is None:
        return None
    low, high = holdout.improvement_ci95_percent
    for before in (holdout.refitted, holdout.baseline):
        if not before.rmse_nm > 0.0:
            continue
        implied = 100.0 * (1.0 - holdout.extended.rmse_nm / before.rmse_nm)
        if abs(implied - holdout.improvement_percent) <= _AGREE_POINTS:
            return (1.0 - high / 100.0) * before.rmse_nm, (1.0 - low / 100.0) * before.rmse_nm
    return None


def gain_rows(explanation: Explanation) -> list[Row]:
    """Return how much of the error is removed: by what was found, and by the placebo; percent."""
    holdout = explanation.holdout
    if holdout is None or not explanation.findings:
        return []
    rows = [
        Row("findings", holdout.improvement_percent, MEASURED, holdout.improvement_ci95_percent),
        Row("placebo", holdout.placebo_percent, MUTED, hollow=True),
    ]
    return [row for row in rows if math.isfinite(row.value)]


def _without(finding: Finding) -> str:
    """Return what a row is called that lacks a finding."""
    if finding.form == OWN_EFFECT:
        return f"with the {finding_name(finding)}"
    return f"without {effect_name(finding.effect)}"


def _errors(axes: Axes, rows: Sequence[Row], floor: Floor, scale: Scale, *, narrow: bool) -> None:
    values = [row.value for row in rows]
    floors = [
        route
        for route in (floor.value_nm, floor.repeats_nm, floor.neighbours_nm, floor.standstill_nm)
        if math.isfinite(route) and route > 0.0
    ]
    _range(axes, [value * scale.factor for value in (*values, *floors)], narrow=narrow)
    if floors:
        axes.axvspan(
            min(floors) * scale.factor, max(floors) * scale.factor, color=NOISE, alpha=0.5, lw=0
        )
    if math.isfinite(floor.value_nm):
        at = floor.value_nm * scale.factor
        axes.axvline(at, color=INK, lw=1.0, ls=(0, (4, 3)), zorder=2)
    shown = [_scaled(row, scale.factor) for row in rows]
    _dots(axes, shown, [in_scale(value, scale) for value in values], narrow=narrow)
    axes.set_xlabel(f"rms error, {scale.unit}")


def _range(axes: Axes, values: Sequence[float], *, narrow: bool) -> None:
    """Set the abscissa, logarithmic for errors far apart; the numbers need room at the right."""
    most = max(values)
    least = min((value for value in values if value > 0.0), default=most)
    if most > _LOGARITHMIC_FROM * least > 0.0:
        axes.set_xscale("log")
        axes.set_xlim(least / 1.6, most * (most / least) ** (0.35 if narrow else 0.15))
        plain_ticks(axes)
    else:
        axes.set_xlim(0.0, max(most, 1e-12) * (1.45 if narrow else 1.2))


def _scaled(row: Row, factor: float) -> Row:
    interval = None
    if row.interval is not None:
        interval = (row.interval[0] * factor, row.interval[1] * factor)
    return dataclasses.replace(row, value=row.value * factor, interval=interval)


def _gains(axes: Axes, rows: Sequence[Row], *, narrow: bool) -> None:
    least = min(
        0.0, *(row.value for row in rows), *(row.interval[0] for row in rows if row.interval)
    )
    axes.set_xlim(min(1.1 * least, -4.0), 125.0 if narrow else 112.0)
    axes.set_xticks([tick for tick in (0, 25, 50, 75, 100) if tick >= least])
    axes.set_title("Error removed")
    axes.set_xlabel("% of the error before")
    axes.axvline(0.0, color=MUTED, lw=0.8)
    _dots(axes, rows, [percent(row.value, 1) for row in rows], narrow=narrow)


def _dots(axes: Axes, rows: Sequence[Row], texts: Sequence[str], *, narrow: bool) -> None:
    """Draw one dot below the other, from the top, each with its number beside it."""
    for k, (row, text) in enumerate(zip(rows, texts, strict=True)):
        axes.axhline(k, color=GRID, lw=0.8, zorder=1)
        end = row.value
        if row.interval is not None:
            axes.plot(row.interval, (k, k), color=row.color, lw=3.0, alpha=0.45, zorder=3)
            end = max(end, row.interval[1])
        face = "white" if row.hollow else row.color
        axes.plot(
            [row.value],
            [k],
            marker=row.marker,
            ms=7.0 if row.marker == "o" else 5.5,
            mec=row.color,
            mfc=face,
            mew=1.6,
            zorder=4,
        )
        axes.annotate(
            text,
            (end, k),
            xytext=(7, 0),
            textcoords="offset points",
            va="center",
            zorder=5,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.85},
        )
    axes.set_ylim(len(rows) - 0.35, -0.65)
    labels = [
        row.short or row.label if narrow else textwrap.fill(row.label, _LABEL_CHARS) for row in rows
    ]
    axes.set_yticks(range(len(rows)), labels)
    axes.tick_params(axis="y", labelcolor=INK)
    axes.grid(axis="y", visible=False)
    _indent(axes, _NARROW_LEFT_IN if narrow else _LEFT_IN)
    _make_room(axes, rows, texts)


def _make_room(axes: Axes, rows: Sequence[Row], texts: Sequence[str]) -> None:
    """Move the abscissa's end until each number beside its dot is within the panel."""
    width_in = axes.get_position().width * figure_of(axes).get_figwidth()
    along = axes.transScale.transform
    low, high = axes.get_xlim()
    start, end = (float(along((x, 0.0))[0]) for x in (low, high))
    for row, text in zip(rows, texts, strict=True):
        reach = max([row.value, *(row.interval or ())])
        share = 1.0 - (_BESIDE_IN + _CHARACTER_IN * len(text)) / width_in
        end = max(end, start + (float(along((reach, 0.0))[0]) - start) / max(share, 0.2))
    axes.set_xlim(low, float(axes.transScale.inverted().transform((end, 0.0))[0]))


def _indent(axes: Axes, left_in: float) -> None:
    """Make room at the left for labels that are words rather than numbers."""
    width_in = figure_of(axes).get_figwidth()
    place = axes.get_position()
    left = left_in / width_in
    axes.set_position((left, place.y0, place.x1 - left, place.height))
