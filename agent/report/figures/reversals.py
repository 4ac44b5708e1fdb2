"""Torque over the travel since a reversal: measured, and by the law that was selected."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agent.identify.result import Parameter
from agent.identify.reversals.result import ReversalFit
from agent.identify.reversals.sentence import angle_scale
from agent.numbers import Scale, scale_for, significant
from agent.report.figures.canvas import (
    INK,
    MEASURED_PALE,
    MUTED,
    PREDICTED,
    SHADE,
    WITH_LABELS_IN,
    Panel,
    bins_for,
    figure_of,
    key_in_header,
    stacked,
    styled,
)
from agent.report.figures.thinning import polyline

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_NAMES = {
    "coulomb": "Coulomb",
    "dahl": "Dahl",
    "bliman-sorine": "Bliman-Sorine",
    "lugre": "LuGre",
    "backlash": "clearance",
}
_SEEN = 6.0  # lengths of the law, beside which the rest of the swing is left out
_LENGTHS = {
    "space_constant_rad": "slips over",
    "backlash_rad": "clearance",
    "wind_up_rad": "winds up",
}


@styled
def figure_reversals(found: ReversalFit, *, narrow: bool = False) -> Figure:
    """Draw the torque over the travel since the turn, signed by the new direction.

    Parameters
    ----------
    found : ReversalFit
        A decidable one.
    narrow : bool
        Draw for a phone's width.

    Raises
    ------
    ValueError
        If there is no reversal to draw.
    """
    if not found.traces or found.selected is None:
        raise ValueError("expected reversals, got none")
    axes = stacked([Panel(3.0, WITH_LABELS_IN)], narrow=narrow, header_in=0.2)[0]
    figure = figure_of(axes)
    reach = _reach(found)
    length = _length(found)
    angle = angle_scale(reach if length is None else length[1].value)
    torque = scale_for("N m", (max(float(np.abs(t.torque_nm).max()) for t in found.traces),))
    for i, trace in enumerate(found.traces):
        shown = (trace.travel_rad >= 0.0) & (trace.travel_rad <= reach)
        if not shown.any():
            continue
        x = trace.travel_rad[shown] * angle.factor
        for y, color, width, label in (
            (trace.torque_nm[shown], MEASURED_PALE, 2.6, "measured"),
            (
                trace.fitted_nm[shown],
                PREDICTED,
                0.9,
                _NAMES.get(found.selected.law, found.selected.law),
            ),
        ):
            at, drawn = polyline(x, y * torque.factor, bins_for(figure))
            axes.plot(at, drawn, color=color, lw=width, label=label if i == 0 else None)
    _mark_length(axes, length, angle)
    axes.axhline(0.0, color=MUTED, lw=0.6)
    axes.set_xlim(0.0, reach * angle.factor)
    axes.set_xlabel(f"motor travel since the reversal, {angle.unit}")
    axes.set_ylabel(f"friction in the new direction, {torque.unit}")
    axes.set_title("Torque after reversals")
    key_in_header(axes, columns=1 if narrow else 3)
    return figure


def _length(found: ReversalFit) -> tuple[str, Parameter] | None:
    """Return the travel that the selected law turns friction over, with words, where known."""
    selected = found.selected
    if selected is None:
        return None
    for name, words in _LENGTHS.items():
        parameter = selected.parameters.get(name)
        if parameter is not None and parameter.identified:
            return words, parameter
    return None


def _reach(found: ReversalFit) -> float:
    """Return the travel up to which is drawn: some lengths of the law, or the longest swing."""
    longest = max(float(trace.travel_rad.max(initial=0.0)) for trace in found.traces)
    length = _length(found)
    return longest if length is None else min(_SEEN * length[1].value, longest)


def _mark_length(axes: Axes, length: tuple[str, Parameter] | None, angle: Scale) -> None:
    """Shade the interval of the length, with its value."""
    if length is None:
        return
    words, parameter = length
    if parameter.ci95 is None:
        return
    low, high = (end * angle.factor for end in parameter.ci95)
    at = parameter.value * angle.factor
    axes.axvspan(low, high, color=SHADE, lw=0.0, zorder=0)
    axes.axvline(at, color=MUTED, lw=0.8, ls=(0, (4, 2)))
    axes.annotate(
        f"{words} {significant(at, 3)} {angle.unit}",
        (at, 0.04),
        xycoords=("data", "axes fraction"),
        xytext=(5, 0),
        textcoords="offset points",
        fontsize=8,
        color=INK,
    )
