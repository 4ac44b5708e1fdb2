"""The friction curve now beside the healthy one at equal temperature, and what lies between."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from agent.monitor.verdict.comparison import Comparison
from agent.numbers import scale_for
from agent.report.figures.canvas import (
    INK,
    KEY_IN,
    MEASURED_PALE,
    MUTED,
    PREDICTED,
    SHADE,
    WITH_LABELS_IN,
    WITHOUT_LABELS_IN,
    Panel,
    figure_of,
    key_in_header,
    plain_ticks,
    stacked,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEALTHY = "healthy"
_NORMAL_975 = 1.959963984540054


@styled
def figure_monitor_curves(
    found: Comparison, low_rad_s: float, before: str = HEALTHY, *, narrow: bool = False
) -> Figure:
    """Draw both curves with their 95 % bands, and their difference below.

    Parameters
    ----------
    found : Comparison
    low_rad_s : float
        Where the low-speed part ends; it is shaded.
    before : str
        What now is compared with.
    narrow : bool
        Draw for a phone's width.
    """
    heights = [Panel(2.3, WITHOUT_LABELS_IN), Panel(1.3, WITH_LABELS_IN)]
    upper, lower = stacked(heights, narrow=narrow, header_in=KEY_IN)
    speed = found.speed_rad_s
    scale = scale_for("N m", found.healthy_nm.tolist())
    bands = (
        # what was is drawn broader, so that it shows where nothing has changed, too
        (found.healthy_nm, found.healthy_deviation_nm, MEASURED_PALE, 4.0, before),
        (found.now_nm, found.now_deviation_nm, PREDICTED, 1.4, "now"),
    )
    for value, deviation, color, width, label in bands:
        reach = _NORMAL_975 * deviation
        upper.fill_between(
            speed,
            scale.factor * (value - reach),
            scale.factor * (value + reach),
            color=color,
            alpha=0.2,
            lw=0,
        )
        upper.plot(
            speed,
            scale.factor * value,
            color=color,
            lw=width,
            marker="o",
            ms=2 + width,
            label=label,
        )
    at = "" if math.isnan(found.temperature_degc) else f" at {found.temperature_degc:.0f} °C"
    upper.set_title(f"Friction curve{at}")
    upper.set_ylabel(scale.unit)
    key_in_header(upper, columns=2, over_title=narrow)
    change = scale_for("N m", found.change_nm.tolist())
    reach = _NORMAL_975 * np.sqrt(np.diag(found.covariance_nm2))
    lower.fill_between(
        speed,
        change.factor * (found.change_nm - reach),
        change.factor * (found.change_nm + reach),
        color=MUTED,
        alpha=0.2,
        lw=0,
    )
    lower.plot(speed, change.factor * found.change_nm, color=INK, marker="o", ms=2.8)
    lower.axhline(0.0, color=MUTED, lw=0.9)
    lower.set_title(f"Now minus {before}, with its 95 % interval")
    lower.set_ylabel(change.unit)
    lower.set_xlabel("motor speed, rad/s")
    for axes in (upper, lower):
        axes.set_xscale("log")
        axes.set_xlim(float(speed[0]) * 0.93, float(speed[-1]) * 1.07)
        axes.axvspan(axes.get_xlim()[0], low_rad_s, color=SHADE, lw=0, zorder=0)
        plain_ticks(axes)
    upper.tick_params(labelbottom=False)
    return figure_of(upper)


def curves_in_words(found: Comparison, before: str = HEALTHY) -> str:
    """Say in words what `figure_monitor_curves` shows."""
    low, high = found.effects["low"], found.effects["high"]
    return (
        f"The friction curve now and that of {before} cycles under the same conditions, from "
        f"{found.speed_rad_s[0]:.3g} to {found.speed_rad_s[-1]:.3g} rad/s. At low speed the change "
        f"is {low.percent:+.1f} % of the friction, at high speed {high.percent:+.1f} %."
    )
