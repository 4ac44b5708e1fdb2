"""Torque ripple: amplitude over orders per motor turn, and what stands out of the background."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from agent.identify.result import Floats
from agent.identify.ripple.change import RippleChange
from agent.identify.ripple.identification import Ripple
from agent.identify.ripple.line import RippleLine
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

_KEY_IN = (0.2, 0.45)  # above the first title: on a phone the key stands in a column
_NAMED = 8
_LETTERS_PT = 8.0
_LETTER_PT = 5.2  # a digit's width at that size, with some air
_ABOVE_PT = 3.0
_ASIDE_PT = 2.0
_Box = tuple[float, float, float, float]  # left, bottom, right, top
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
    axes, *more = stacked(panels, narrow=narrow, header_in=_KEY_IN[narrow])
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
    axes.set_xticks(place, [_order(o.order_per_motor_rev) for o in measured])
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
        low, high = _ends(line)
        axes.plot(
            [at, at], [low * scale.factor, high * scale.factor], color=PREDICTED, lw=1.4, zorder=4
        )
        label = "found, 95 % interval" if i == 0 else None
        axes.plot(at, size.value * scale.factor, "o", ms=4, color=PREDICTED, label=label, zorder=5)
    axes.set_ylim(0.0, axes.get_ylim()[1] * 1.05)
    axes.set_xlim(0.0, float(order[-1]))
    _name_orders(axes, found.lines[:_NAMED], scale.factor)
    axes.set_xlabel("order, periods per motor turn")
    axes.set_ylabel(f"amplitude, {scale.unit}")
    axes.set_title("Torque ripple")
    key_in_header(axes, columns=columns)


def _name_orders(axes: Axes, lines: Sequence[RippleLine], factor: float) -> None:
    """Write the orders at the tops of their intervals, the strongest first, where there is room."""
    points = 72.0 / figure_of(axes).dpi
    bars = [_bar(axes, line, factor) * points for line in lines]
    taken = [(x - 1.0, low, x + 1.0, high) for x, low, high in bars]
    for line, own, (x, _, top) in zip(lines, list(taken), bars, strict=True):
        name = _order(line.order_per_motor_rev.value)
        wide, beside = _LETTER_PT * len(name), [box for box in taken if box != own]
        for side, shift, left in (
            ("center", 0.0, x - wide / 2.0),
            ("right", -_ASIDE_PT, x - _ASIDE_PT - wide),
            ("left", _ASIDE_PT, x + _ASIDE_PT),
        ):
            box = (left, top + _ABOVE_PT, left + wide, top + _ABOVE_PT + _LETTERS_PT)
            if not any(_overlap(box, other) for other in beside):
                at = (line.order_per_motor_rev.value, _ends(line)[1] * factor)
                axes.annotate(
                    name,
                    at,
                    xytext=(shift, _ABOVE_PT),
                    textcoords="offset points",
                    ha=side,
                    fontsize=_LETTERS_PT,
                    color=INK,
                )
                taken.append(box)
                break


def _bar(axes: Axes, line: RippleLine, factor: float) -> Floats:
    """Return where a line's interval stands on the figure: x, lower and upper end, in pixels."""
    order = line.order_per_motor_rev.value
    ends = [(order, end * factor) for end in _ends(line)]
    (x, low), (_, high) = axes.transData.transform(ends)
    return np.array([x, low, high])


def _ends(line: RippleLine) -> tuple[float, float]:
    """Return the ends of the amplitude's interval; the amplitude twice where it has none."""
    size = line.amplitude_nm
    return size.ci95 if size.ci95 is not None else (size.value, size.value)


def _overlap(one: _Box, other: _Box) -> bool:
    apart = one[2] < other[0] or other[2] < one[0] or one[3] < other[1] or other[3] < one[1]
    return not apart


def _order(order: float) -> str:
    """Write an order to a tenth, and a whole one as such."""
    return f"{round(order, 1):g}"


def _highest(found: Ripple) -> float:
    """Return the order up to which is drawn: some way beyond the highest one found."""
    last = float(found.order[-1])
    if not found.lines:
        return last
    highest = max(line.order_per_motor_rev.value for line in found.lines)
    return float(np.clip(_MARGIN * highest, min(10.0, last), last))
