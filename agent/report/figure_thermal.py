"""Temperature over time with its law and forecast, and friction over velocity per temperature."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agent.identify.friction_surface import Surface
from agent.identify.result import Floats
from agent.identify.surface_law import SurfacePoints
from agent.identify.thermal import Cooling
from agent.numbers import scale_for
from agent.report.canvas import (
    MUTED,
    PREDICTED,
    SHADE,
    TEMPERATURE,
    WITH_LABELS_IN,
    Panel,
    bins_for,
    figure_of,
    key_in_header,
    stacked,
    styled,
)
from agent.report.thinning import polyline

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HOUR_S = 3600.0
_AHEAD = 1.3  # of the curve: how far the forecast is drawn
_COLD, _WARM = np.array([0.0, 0.447, 0.698]), np.array([0.769, 0.322, 0.0])


@styled
def figure_thermal(
    time_s: Floats,
    temperature_degc: Floats,
    cooling: Cooling,
    surface: Surface,
    points: SurfacePoints | None,
    *,
    narrow: bool = False,
) -> Figure:
    """Draw the temperature with its law, and the friction curves with theirs.

    Parameters
    ----------
    time_s, temperature_degc : ndarray, shape (n,)
        What was measured.
    cooling : Cooling
        Its law is drawn where it was identified, with the forecast's interval.
    surface : Surface
        Drawn as one line for every temperature of `points`, where there is a law.
    points : SurfacePoints, optional
        Without them there is no second panel.
    narrow : bool
        Draw for a phone's width.

    Raises
    ------
    ValueError
        If there is no temperature to draw.
    """
    if not time_s.size:
        raise ValueError("expected temperatures, got none")
    panel = Panel(2.3, WITH_LABELS_IN)
    panels = stacked([panel] * (1 if points is None else 2), narrow=narrow, header_in=0.2)
    _temperature(panels[0], time_s, temperature_degc, cooling)
    if points is not None:
        _friction(panels[1], surface, points)
    return figure_of(panels[0])


def thermal_in_words(cooling: Cooling, surface: Surface) -> str:
    """Say in words what `figure_thermal` shows, for those who do not see it."""
    first = (
        f"Temperature over time, from {cooling.initial_degc.value:.1f} towards "
        f"{cooling.settled_degc.value:.1f} degrees Celsius, with its law and forecast"
        if cooling.identified
        else "Temperature over time, without a law"
    )
    if not surface.law:
        return f"{first}."
    return f"{first}; friction over speed, one line for each temperature ({surface.law})."


def _temperature(axes: Axes, time_s: Floats, temperature: Floats, cooling: Cooling) -> None:
    start = float(time_s[0])
    x, y = polyline((time_s - start) / _HOUR_S, temperature, bins_for(figure_of(axes)))
    axes.plot(x, y, color=TEMPERATURE, lw=1.0, label="measured")
    if cooling.identified:
        ahead = np.linspace(0.0, _AHEAD * max(cooling.duration_s, 1.0), 80)
        values = [cooling.forecast(float(t)) for t in ahead]
        ends = [p.ci95 if p.ci95 is not None else (p.value, p.value) for p in values]
        low, high = np.array(ends).T
        axes.fill_between(ahead / _HOUR_S, low, high, color=SHADE, label="95 % interval")
        axes.plot(ahead / _HOUR_S, [p.value for p in values], color=PREDICTED, lw=1.2, label="law")
    axes.set_xlabel("time, h")
    axes.set_ylabel("temperature, °C")
    axes.set_title("temperature over time")
    key_in_header(axes, columns=3)


def _friction(axes: Axes, surface: Surface, points: SurfacePoints) -> None:
    scale = scale_for("N m", (float(points.friction_nm.max()),))
    groups = points.groups()
    low, high = float(points.temperature_degc.min()), float(points.temperature_degc.max())
    speeds = np.geomspace(points.speed_rad_s.min(), points.speed_rad_s.max(), 120)
    for group in range(int(groups.max()) + 1):
        own = points.take(groups == group)
        temperature = float(own.temperature_degc.mean())
        share = (temperature - low) / (high - low) if high > low else 0.0
        color = tuple(_COLD + share * (_WARM - _COLD))
        axes.plot(
            own.speed_rad_s,
            own.friction_nm * scale.factor,
            "o",
            ms=3,
            color=color,
            label=f"{temperature:.0f} °C" if surface.law else None,
        )
        if surface.law:
            friction = surface.friction_nm(speeds, np.full_like(speeds, temperature))
            axes.plot(speeds, friction * scale.factor, color=color, lw=1.0)
    axes.set_xlabel("motor speed, rad/s")
    axes.set_ylabel(f"friction torque, {scale.unit}")
    axes.set_title("friction at each temperature")
    if surface.law:
        key_in_header(axes, columns=6)
    else:
        axes.annotate(
            "no temperature law", (0.99, 0.03), xycoords="axes fraction", ha="right", color=MUTED
        )
