"""How the simulation's own numbers moved when the missing physics was put in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from agent.explain.answer.result import Moved
from agent.identify.result import Parameter
from agent.numbers import parameter_label, parameter_unit, scale_for, significant, written
from agent.report.explanation.words import is_biased
from agent.report.figures.canvas import (
    GRID,
    INK,
    MEASURED,
    MUTED,
    PREDICTED,
    WITH_LABELS_IN,
    Panel,
    figure_of,
    stacked,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HEIGHT_IN = 0.72
_BELOW_IN = 0.34


@styled
def figure_moved(moved: Sequence[Moved], *, narrow: bool = False) -> Figure:
    """Draw each base parameter as given, refitted and extended, with intervals.

    Parameters
    ----------
    moved : sequence of Moved
        At least one.
    narrow : bool
        Draw for a phone's width.

    Raises
    ------
    ValueError
        If there is none.
    """
    if not moved:
        raise ValueError("expected parameters to draw, got none")
    below = WITH_LABELS_IN if narrow else _BELOW_IN
    column = stacked([Panel(_HEIGHT_IN, below)] * len(moved), narrow=narrow)
    for axes, one in zip(column, moved, strict=True):
        _parameter(axes, one)
        _move(axes, one, narrow=narrow)
    return figure_of(column[0])


def moved_in_words(moved: Sequence[Moved]) -> str:
    """Say in words what `figure_moved` shows, for those who do not see it."""
    parts = [
        f"{parameter_label(one.parameter).lower()} by {significant(abs(one.sigmas), 2)} "
        "standard deviations"
        if math.isfinite(one.sigmas)
        else f"{parameter_label(one.parameter).lower()} without an interval"
        for one in moved
    ]
    return (
        "The simulation's numbers as given, refitted, and extended by the findings, with 95 % "
        f"intervals. From refitted to extended they moved: {', '.join(parts)}."
    )


def _parameter(axes: Axes, moved: Moved) -> None:
    numbers = [moved.given] + [p.value for p in (moved.refitted, moved.extended) if p.identified]
    scale = scale_for(parameter_unit(moved.parameter), numbers)
    unit = f", {scale.unit}" if scale.unit else ""
    axes.set_title(f"{parameter_label(moved.parameter)}{unit}")
    rows = (
        (Parameter(moved.given, None, identified=math.isfinite(moved.given)), MUTED, "D"),
        (moved.refitted, PREDICTED, "o"),
        (moved.extended, MEASURED, "o"),
    )
    for k, (parameter, color, marker) in enumerate(rows):
        axes.axhline(k, color=GRID, lw=0.8, zorder=1)
        if not parameter.identified:
            axes.annotate(
                "not identified",
                (0.02, k),
                xycoords=("axes fraction", "data"),
                va="center",
                color=MUTED,
            )
            continue
        _dot(axes, k, parameter, scale.factor, color, marker)
    axes.set_ylim(2.6, -0.6)
    axes.set_yticks(range(3), ["given", "refitted", "extended"])
    axes.tick_params(axis="y", labelcolor=INK)
    axes.grid(axis="y", visible=False)
    axes.margins(x=0.25)
    axes.locator_params(axis="x", nbins=6)


def _move(axes: Axes, moved: Moved, *, narrow: bool) -> None:
    """Write the move beside the title, or below on a phone, where the title needs the line."""
    if not math.isfinite(moved.sigmas):
        return
    text = f"moved by {significant(abs(moved.sigmas), 2)} standard deviations"
    weight = "bold" if is_biased(moved) else "normal"
    color = PREDICTED if is_biased(moved) else MUTED
    if narrow:
        axes.set_xlabel(text, loc="right", fontweight=weight, color=color)
    else:
        axes.set_title(text, loc="right", fontsize=9.0, fontweight=weight, color=color)


def _dot(
    axes: Axes, row: int, parameter: Parameter, factor: float, color: str, marker: str
) -> None:
    at = parameter.value * factor
    end = at
    if parameter.ci95 is not None:
        low, high = (limit * factor for limit in parameter.ci95)
        axes.plot((low, high), (row, row), color=color, lw=3.0, alpha=0.45, zorder=3)
        end = max(at, high)
    axes.plot([at], [row], marker=marker, ms=6.0, mec=color, mfc=color, ls="none", zorder=4)
    axes.annotate(
        written(parameter, factor)[0],
        (end, row),
        xytext=(7, 0),
        textcoords="offset points",
        va="center",
        fontsize=8.5,
        zorder=5,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.85},
    )
