"""The residual over the cycle, before and after, with what was located shaded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Region, Trace
from agent.identify.result import Floats
from agent.numbers import Scale, scale_for
from agent.report.explanation.words import torque
from agent.report.figures.canvas import (
    MEASURED,
    MUTED,
    PREDICTED,
    WITH_LABELS_IN,
    WITHOUT_LABELS_IN,
    Panel,
    bins_for,
    figure_of,
    key_in_header,
    stacked,
    styled,
)
from agent.report.figures.thinning import envelope, polyline, time_span_s
from trajectories import lasting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOCATED = "#dcebf5"
NOT_EXPLAINED = "#fbe0cf"
SHADED = frozenset(
    {
        "velocity_rad_s",
        "speed_rad_s",
        "time_s",
        "recording",
        "acceleration_rad_s2",
        "after_reversal_s",
        "after_reversal_rad",
    }
)
"""Axes along which a region can be shaded over time."""
_ALIKE = 0.02
_FAR_OFF = 4.0
_STRETCHES = 240
_CLIP_QUANTILE, _CLIP_FACTOR = 0.998, 1.25


@dataclass(frozen=True)
class Line:
    """One residual that is drawn: its values (n,), what it is called, and its colour."""

    values_nm: Floats
    label: str
    color: str


@styled
def figure_residual(
    trace: Trace,
    located: Sequence[Region],
    unexplained: Sequence[Region] = (),
    *,
    index: int = -1,
    reach_nm: float = 0.0,
    narrow: bool = False,
) -> Figure:
    """Draw velocity, and measured less predicted torque before and after, over time.

    Parameters
    ----------
    trace : Trace
        One recording.
    located, unexplained : sequence of Region
        Shaded where they can be told from time and velocity.
    index : int
        Which recording it is, counted from 0, for regions along `recording`.
    reach_nm : float
        Half of the ordinate; recordings drawn with the same one can be compared. 0: its own.
    narrow : bool
        Draw for a phone's width.
    """
    velocity, residual = stacked(
        [Panel(0.6, WITHOUT_LABELS_IN), Panel(1.5, WITH_LABELS_IN)], narrow=narrow
    )
    figure = figure_of(velocity)
    for regions, color in ((located, LOCATED), (unexplained, NOT_EXPLAINED)):
        _shade(velocity, residual, trace.time_s, located_mask(trace, regions, index), color)
    velocity.plot(
        *polyline(trace.time_s, trace.velocity_rad_s, bins_for(figure) // 2), color=MUTED, lw=1.0
    )
    velocity.set_title("Motor velocity")
    velocity.set_ylabel("rad/s")
    velocity.tick_params(labelbottom=False)
    scale = scale_for("N m", [reach_nm or reach_of(trace)])
    limit = (reach_nm or reach_of(trace)) * scale.factor
    _residual(residual, trace, scale, bins_for(figure) // 3, limit)
    if limit > 0.0:
        residual.set_ylim(-limit, limit)
    if narrow:  # the key needs the line that the title has elsewhere
        residual.set_title("")
        residual.set_ylabel(f"residual, {scale.unit}")
    for axes in (velocity, residual):
        axes.set_xlim(*time_span_s(trace.time_s))
    return figure


def lines_of(trace: Trace) -> list[Line]:
    """Return the residuals that differ: two that are one line to the eye share it."""
    stages = (
        Line(trace.given_nm, "as given", MUTED),
        Line(trace.refitted_nm, "refitted", PREDICTED),
        Line(trace.extended_nm, "extended", MEASURED),
    )
    drawn: list[Line] = []
    for line in stages:
        if not np.isfinite(line.values_nm).any():
            continue
        if drawn and _alike(drawn[-1].values_nm, line.values_nm):
            drawn[-1] = Line(line.values_nm, f"{drawn[-1].label} = {line.label}", line.color)
        else:
            drawn.append(line)
    return drawn


def reach_of(trace: Trace) -> float:
    """Return half of an ordinate, N m, that shows all but single peaks of the residuals drawn.

    A simulation whose numbers are far off leaves the picture rather than flattening the others.
    """
    sizes = [_size(line.values_nm) for line in lines_of(trace)]
    if len(sizes) > 1 and sizes[0] > _FAR_OFF * max(sizes[1:]) > 0.0:
        sizes = sizes[1:]
    return _CLIP_FACTOR * max(sizes, default=0.0)


def residual_in_words(trace: Trace) -> str:
    """Say in words what `figure_residual` shows, for those who do not see it."""
    parts = [f"{line.label} {torque(_rms(line.values_nm))} rms" for line in lines_of(trace)]
    lasted_s = float(trace.time_s[-1] - trace.time_s[0])
    return (
        f"Motor velocity, and measured less predicted torque, over {lasting(lasted_s)} of "
        f"{trace.recording}: {', '.join(parts) or 'nothing was compared'}."
    )


def column_of(trace: Trace, variable: str, index: int = -1) -> Floats | None:
    """Return one of the axes on which regions lie, shape (n,); None where a trace lacks it."""
    if variable == "velocity_rad_s":
        return trace.velocity_rad_s
    if variable == "speed_rad_s":
        return np.abs(trace.velocity_rad_s)
    if variable == "time_s":
        return trace.time_s
    if variable == "recording" and index >= 0:
        return np.full(trace.time_s.shape, float(index))
    if variable == "acceleration_rad_s2":
        return np.asarray(np.gradient(trace.velocity_rad_s, trace.time_s))
    if variable == "after_reversal_s":
        return _since_reversal(trace, trace.time_s)
    if variable == "after_reversal_rad":
        steps = np.diff(trace.time_s, prepend=trace.time_s[:1])
        travel = np.cumsum(np.nan_to_num(np.abs(trace.velocity_rad_s)) * steps)
        return _since_reversal(trace, travel)
    return None


def located_mask(trace: Trace, regions: Sequence[Region], index: int = -1) -> NDArray[np.bool_]:
    """Return which samples, shape (n,), lie in any of the regions that can be told here."""
    mask = np.zeros(trace.time_s.shape, dtype=np.bool_)
    for region in regions:
        values = column_of(trace, region.variable, index)
        if values is not None:
            mask |= (values >= region.lower) & (values <= region.upper)
    return mask


def _since_reversal(trace: Trace, clock: Floats) -> Floats:
    """Return how far a clock, shape (n,), went on since the direction changed; infinite before."""
    direction = np.sign(trace.velocity_rad_s)
    moving = np.flatnonzero(direction)
    out = np.full(trace.time_s.shape, np.inf)
    turned = moving[1:][direction[moving[1:]] != direction[moving[:-1]]]
    if turned.size:
        last = np.searchsorted(turned, np.arange(out.size), side="right") - 1
        known = last >= 0
        out[known] = clock[known] - clock[turned[last[known]]]
    return out


def _shade(upper: Axes, lower: Axes, time_s: Floats, mask: NDArray[np.bool_], color: str) -> None:
    """Shade the stretches of time of which half or more is located; one shape for each panel."""
    if not mask.any():
        return
    edges = np.linspace(*time_span_s(time_s), _STRETCHES + 1)
    stretch = np.clip(np.searchsorted(edges, time_s, side="right") - 1, 0, _STRETCHES - 1)
    count = np.bincount(stretch, minlength=_STRETCHES)
    inside = np.bincount(stretch, weights=mask, minlength=_STRETCHES)
    shaded = (count > 0) & (2.0 * inside >= count)
    steps = np.append(shaded, shaded[-1])
    for axes in (upper, lower):
        axes.fill_between(
            edges,
            0.0,
            1.0,
            where=steps.tolist(),
            step="post",
            color=color,
            lw=0,
            zorder=0,
            transform=axes.get_xaxis_transform(),
        )


def _residual(axes: Axes, trace: Trace, scale: Scale, bins: int, limit: float) -> None:
    axes.axhline(0.0, color=MUTED, lw=0.7, zorder=1.5)
    for line in lines_of(trace):
        centre_s, low, mean, high = envelope(trace.time_s, line.values_nm * scale.factor, bins)
        axes.fill_between(centre_s, low, high, color=line.color, alpha=0.22, lw=0, zorder=2)
        beyond = " (beyond the axis)" * (_size(line.values_nm) * scale.factor > limit > 0.0)
        axes.plot(centre_s, mean, color=line.color, lw=1.2, label=line.label + beyond, zorder=3)
    if not axes.get_legend_handles_labels()[0]:
        axes.annotate(
            "nothing was compared here", (0.5, 0.6), xycoords="axes fraction", ha="center"
        )
    else:
        key_in_header(axes, columns=3)
    axes.set_title("Residual")
    axes.set_ylabel(scale.unit)
    axes.set_xlabel("time, s")


def _size(values: Floats) -> float:
    """Return what all but single peaks stay below; 0 where there is no value."""
    finite = np.abs(values[np.isfinite(values)])
    return float(np.quantile(finite, _CLIP_QUANTILE)) if finite.size else 0.0


def _alike(one: Floats, other: Floats) -> bool:
    """Tell whether two residuals are the same line to the eye."""
    size = max(_rms(one), _rms(other))
    return bool(_rms(one - other) <= _ALIKE * size)


def _rms(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else 0.0
