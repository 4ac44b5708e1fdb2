"""What has no explanation, over the axis of its region: a shape that somebody may know."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from agent.explain.answer.result import Region, Trace
from agent.identify.result import Floats
from agent.numbers import scale_for, significant
from agent.report.explanation.figure_cycle import NOT_EXPLAINED, column_of
from agent.report.explanation.places import variable
from agent.report.figures.canvas import (
    INK,
    MUTED,
    WITH_LABELS_IN,
    Panel,
    figure_of,
    stacked,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HEIGHT_IN = 2.0
_STRETCHES = 48
_LEAST_SAMPLES = 8


@dataclass(frozen=True)
class LeftOver:
    """Residuals along one axis, in stretches of equal length; arrays of shape (m,).

    `mean_nm` is their mean, `lower_nm` and `upper_nm` their quartiles: half of the samples lie
    between. Intervals are not given: neighbouring samples are not independent.
    """

    variable: str
    at: Floats
    mean_nm: Floats
    lower_nm: Floats
    upper_nm: Floats


def left_over(traces: Sequence[Trace], name: str) -> LeftOver | None:
    """Gather what is left of all recordings along one axis.

    Parameters
    ----------
    traces : sequence of Trace
        The last stage that a trace has is what is left: extended, else refitted.
    name : str
        A word of contract section 6.

    Returns
    -------
    LeftOver or None
        None where the traces do not carry that axis.
    """
    places, residuals = [], []
    for index, trace in enumerate(traces):
        column = column_of(trace, name, index)
        if column is None:
            return None
        known = np.isfinite(trace.extended_nm).any()
        places.append(column)
        residuals.append(trace.extended_nm if known else trace.refitted_nm)
    place, residual = np.concatenate([*places, []]), np.concatenate([*residuals, []])
    finite = np.isfinite(place) & np.isfinite(residual)
    place, residual = place[finite], residual[finite]
    if not place.size:
        return None
    edges = np.linspace(float(place.min()), float(place.max()), _STRETCHES + 1)
    stretch = np.clip(np.searchsorted(edges, place, side="right") - 1, 0, _STRETCHES - 1)
    held = np.flatnonzero(np.bincount(stretch, minlength=_STRETCHES) >= _LEAST_SAMPLES)
    groups = [residual[stretch == one] for one in held]
    return LeftOver(
        name,
        np.array([place[stretch == one].mean() for one in held]),
        np.array([group.mean() for group in groups]),
        np.array([np.quantile(group, 0.25) for group in groups]),
        np.array([np.quantile(group, 0.75) for group in groups]),
    )


@styled
def figure_left_over(
    left: LeftOver, where: Sequence[Region] = (), *, narrow: bool = False
) -> Figure:
    """Draw what is left over its axis, with the regions of that axis shaded."""
    (axes,) = stacked([Panel(_HEIGHT_IN, WITH_LABELS_IN)], narrow=narrow)
    abscissa, scale = variable(left.variable), scale_for("N m", [_largest_nm(left)])
    at = abscissa.shown(left.at)
    axes.axhline(0.0, color=MUTED, lw=0.7)
    axes.vlines(at, left.lower_nm * scale.factor, left.upper_nm * scale.factor, color=INK, lw=0.9)
    axes.plot(at, left.mean_nm * scale.factor, ls="none", marker="o", ms=3.6, color=INK)
    shade(axes, where, left.variable)
    axes.set_title("What is left without explanation")
    axes.set_xlabel(abscissa.title)
    axes.set_ylabel(f"torque, {scale.unit}")
    return figure_of(axes)


def shade(axes: Axes, where: Sequence[Region], name: str) -> None:
    """Shade the regions of an axis as far as they lie in a picture of it."""
    limits = axes.get_xlim()
    for region in where:
        if region.variable == name:
            low, high = variable(name).shown(np.array([region.lower, region.upper]))
            ends = max(low, limits[0]), min(high, limits[1])
            axes.axvspan(*ends, color=NOT_EXPLAINED, lw=0, zorder=0)
    axes.set_xlim(*limits)


def left_over_in_words(left: LeftOver) -> str:
    """Say in words what `figure_left_over` shows, for those who do not see it."""
    scale, at = scale_for("N m", [_largest_nm(left)]), variable(left.variable)
    if not left.mean_nm.size:
        return f"Torque that is left without explanation, over {at.title}: too few samples to draw."
    peak = int(np.argmax(np.abs(left.mean_nm)))
    place = float(at.shown(left.at[peak : peak + 1])[0])
    return (
        f"Torque that is left without explanation, over {at.label}: largest at "
        f"{significant(place, 3)} {at.unit}, where its mean is "
        f"{significant(float(left.mean_nm[peak]) * scale.factor, 3)} {scale.unit}."
    )


def _largest_nm(left: LeftOver) -> float:
    return float(np.max(np.abs(np.concatenate((left.lower_nm, left.upper_nm))), initial=0.0))
