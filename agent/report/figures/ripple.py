"""Torque ripple: amplitude over orders per motor turn, and what stands out of the background."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from agent.identify.ripple.change import RippleChange
from agent.identify.ripple.identification import Ripple
from agent.numbers import scale_for, significant
from agent.report.figures.canvas import (
    INK,
    MEASURED,
    MUTED,
    PREDICTED,
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

_NAMED = 8
_MARGIN = 1.6  # times the highest order found


@styled
def figure_ripple(
    found: Ripple, changes: Sequence[RippleChange] = (), *, narrow: bool = False
) -> Figure:
    """Draw the amplitude over the order, the threshold, and the orders found with intervals.

    Parameters
    ----------
    found : Ripple
        A decidable one.
    changes : sequence of RippleChange
        What anticogging does, drawn as one more panel for the slowest speed: the position's
        stutter without and with it.
    narrow : bool
        Draw for a phone's width.

    Raises
    ------
    ValueError
        If nothing was scanned.
    """
    if not found.order.size:
        raise ValueError("expected a scan of orders, got none")
    panels = [Panel(2.6, WITH_LABELS_IN)] * (2 if changes else 1)
    axes, *more = stacked(panels, narrow=narrow, header_in=0.2)
    if more:
        _stutter(more[0], changes[0])
    _spectrum(axes, found, columns=1 if narrow else 3)
    return figure_of(axes)


def _stutter(axes: Axes, change: RippleChange) -> None:
    """Draw the stutter at each order, without and with anticogging."""
    measured = [o for o in change.orders if all(p.identified for p in o.stutter_rad)][:_NAMED]
    measured.sort(key=lambda o: o.order_per_motor_rev)
    place = np.arange(len(measured), dtype=np.float64)
    for side, (label, color) in enumerate((("anticogging off", MUTED), ("on", MEASURED))):
        sizes = [o.stutter_rad[side] for o in measured]
        ends = np.array([p.ci95 for p in sizes if p.ci95 is not None]).reshape(-1, 2)
        values = np.array([p.value for p in sizes])
        axes.bar(place + 0.4 * (side - 0.5), 1e3 * values, 0.38, color=color, label=label)
        axes.vlines(place + 0.4 * (side - 0.5), *(1e3 * ends.T), color=INK, lw=0.9)
    axes.set_xticks(place, [significant(o.order_per_motor_rev, 3) for o in measured])
    axes.set_xlabel("order, periods per motor turn")
    axes.set_ylabel("position stutter, mrad")
    axes.set_title(f"Stutter at {significant(change.velocity_rad_s, 2)} rad/s")
    key_in_header(axes, columns=2)


def _spectrum(axes: Axes, found: Ripple, columns: int) -> None:
    """Draw amplitude over order with its threshold and the orders found."""
    figure = figure_of(axes)
    shown = found.order <= _highest(found)
    scale = scale_for("N m", (float(found.amplitude_nm[shown].max()),))
    order = found.order[shown]
    x, y = polyline(order, found.amplitude_nm[shown] * scale.factor, bins_for(figure))
    axes.plot(x, y, color=MEASURED, lw=1.0, label="torque, rms over passes")
    x, y = polyline(order, found.threshold_nm[shown] * scale.factor, bins_for(figure))
    axes.plot(x, y, color=MUTED, lw=0.9, ls=(0, (4, 2)), label="stands out above")
    for i, line in enumerate(found.lines):
        at, size = line.order_per_motor_rev.value, line.amplitude_nm
        low, high = size.ci95 if size.ci95 is not None else (size.value, size.value)
        axes.plot(
            [at, at], [low * scale.factor, high * scale.factor], color=PREDICTED, lw=1.4, zorder=4
        )
        label = "found, 95 % interval" if i == 0 else None
        axes.plot(at, size.value * scale.factor, "o", ms=4, color=PREDICTED, label=label, zorder=5)
        if i < _NAMED:
            axes.annotate(
                significant(at, 3),
                (at, high * scale.factor),
                xytext=(0, 3),
                textcoords="offset points",
                ha="center",
                fontsize=8,
                color=INK,
            )
    axes.set_ylim(0.0, axes.get_ylim()[1] * 1.05)
    axes.set_xlim(0.0, float(order[-1]))
    axes.set_xlabel("order, periods per motor turn")
    axes.set_ylabel(f"amplitude, {scale.unit}")
    axes.set_title("Torque ripple")
    key_in_header(axes, columns=columns)


def _highest(found: Ripple) -> float:
    """Return the order up to which is drawn: some way beyond the highest one found."""
    last = float(found.order[-1])
    if not found.lines:
        return last
    highest = max(line.order_per_motor_rev.value for line in found.lines)
    return float(np.clip(_MARGIN * highest, min(10.0, last), last))
