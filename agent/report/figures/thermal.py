"""Temperature over time with its law and forecast, and friction over velocity per temperature."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from agent.identify.friction.oil_change import OilComparison
from agent.identify.friction.surface import Surface
from agent.identify.friction.surface_law import SurfacePoints
from agent.identify.result import Floats
from agent.identify.thermal.cooling import Cooling
from agent.numbers import scale_for
from agent.report.figures.canvas import (
    INK,
    MEASURED,
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
from agent.report.figures.thinning import polyline

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HOUR_S = 3600.0
_NAMED = 6  # temperatures in the key
_AHEAD = 1.3  # of the curve: how far the forecast is drawn
_COLD, _WARM = np.array([0.0, 0.447, 0.698]), np.array([0.769, 0.322, 0.0])


@styled
def figure_thermal(
    time_s: Floats,
    temperature_degc: Floats,
    cooling: Cooling,
    surface: Surface,
    points: SurfacePoints | None,
    oils: OilComparison | None = None,
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
    oils : OilComparison, optional
        Drawn as a third panel: each oil's friction curve, and the points of the oil in use.
    narrow : bool
        Draw for a phone's width.

    Raises
    ------
    ValueError
        If there is neither a temperature nor a friction curve to draw.
    """
    drawn: list[Callable[[Axes], None]] = []
    if time_s.size:
        drawn.append(lambda axes: _temperature(axes, time_s, temperature_degc, cooling))
    if points is not None:
        drawn.append(lambda axes: _friction(axes, surface, points))
    if points is not None and oils is not None:
        drawn.append(lambda axes: _oils(axes, oils, points))
    if not drawn:
        raise ValueError("expected temperatures or friction curves, got neither")
    panels = stacked([Panel(2.3, WITH_LABELS_IN)] * len(drawn), narrow=narrow, header_in=0.2)
    for axes, draw in zip(panels, drawn, strict=True):
        draw(axes)
    return figure_of(panels[0])


def _oils(axes: Axes, oils: OilComparison, points: SurfacePoints) -> None:
    """Draw the friction curve of each oil, and what was measured near that temperature."""
    shown = [curve for curve in oils.curves if not curve.reason]
    scale = scale_for("N m", [float(curve.friction_nm.max()) for curve in shown])
    styles: tuple[tuple[str, str], ...] = (
        (MEASURED, "-"),
        (PREDICTED, "--"),
        (INK, ":"),
        (MUTED, "-."),
    )
    for curve, (color, style) in zip(shown, itertools.cycle(styles), strict=False):
        label = f"{curve.name} (in use)" if curve.in_use else curve.name
        low, high = curve.ci95_nm.T * scale.factor
        axes.fill_between(oils.speed_rad_s, low, high, color=color, alpha=0.12, lw=0.0)
        axes.plot(
            oils.speed_rad_s,
            curve.friction_nm * scale.factor,
            color=color,
            ls=style,
            lw=1.2,
            label=label,
        )
    means = points.levels_degc()
    nearest = int(np.argmin(np.abs(means - oils.temperature_degc)))
    groups = points.groups()
    own = points.take(groups == nearest)
    axes.plot(
        own.speed_rad_s,
        own.friction_nm * scale.factor,
        "o",
        ms=3,
        color=MEASURED,
        label=f"measured, {means[nearest]:.0f} °C",
    )
    axes.set_xlabel("motor speed, rad/s")
    axes.set_ylabel(f"friction torque, {scale.unit}")
    axes.set_title(f"Each oil at {oils.temperature_degc:.0f} °C")
    key_in_header(axes, columns=5)
    left_out = [curve.name for curve in oils.curves if curve.reason]
    if left_out:
        axes.annotate(
            f"{', '.join(left_out)}: outside what was measured",
            (0.99, 0.03),
            xycoords="axes fraction",
            ha="right",
            color=MUTED,
        )


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
    axes.set_title("Temperature over time")
    key_in_header(axes, columns=3)


def _friction(axes: Axes, surface: Surface, points: SurfacePoints) -> None:
    scale = scale_for("N m", (float(points.friction_nm.max()),))
    groups, levels = points.groups(), points.levels_degc()
    low, high = float(points.temperature_degc.min()), float(points.temperature_degc.max())
    speeds = np.geomspace(points.speed_rad_s.min(), points.speed_rad_s.max(), 120)
    named = set(np.linspace(0, levels.size - 1, min(levels.size, _NAMED)).round().astype(int))
    for group, temperature in enumerate(levels):
        own = points.take(groups == group)
        share = (temperature - low) / (high - low) if high > low else 0.0
        color = tuple(_COLD + share * (_WARM - _COLD))
        axes.plot(
            own.speed_rad_s,
            own.friction_nm * scale.factor,
            "o",
            ms=3,
            color=color,
            label=f"{temperature:.0f} °C" if surface.law and group in named else None,
        )
        if surface.law:
            friction = surface.friction_nm(speeds, np.full_like(speeds, temperature))
            axes.plot(speeds, friction * scale.factor, color=color, lw=1.0)
    axes.set_xlabel("motor speed, rad/s")
    axes.set_ylabel(f"friction torque, {scale.unit}")
    axes.set_title("Friction at each temperature")
    if surface.law:
        key_in_header(axes, columns=_NAMED)
    else:
        axes.annotate(
            "no temperature law", (0.99, 0.03), xycoords="axes fraction", ha="right", color=MUTED
        )
