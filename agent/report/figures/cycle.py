"""The cycle over time: what was asked, what moved, what it took, how warm it was."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from agent.identify.result import Floats
from agent.numbers import scale_for
from agent.report.figures.canvas import (
    COMMAND_PALE,
    MEASURED,
    POSITION,
    SHADE,
    TEMPERATURE,
    WITH_LABELS_IN,
    WITHOUT_LABELS_IN,
    Panel,
    bins_for,
    figure_of,
    key_in_header,
    stacked,
    styled,
)
from agent.report.figures.thinning import polyline, time_span_s
from agent.report.views import RecordingView
from trajectories import lasting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_Draw = Callable[["Axes", RecordingView, int], None]


@styled
def figure_cycle(view: RecordingView, *, narrow: bool = False) -> Figure:
    """Draw velocity, torque, arm position and gearbox temperature over one time axis.

    A signal that was not recorded has no panel. Steady windows are shaded through all panels.

    Parameters
    ----------
    view : RecordingView
        One recording, SI, motor side.
    narrow : bool
        Draw for a phone's width.
    """
    panels = _panels(view)
    sizes = [Panel(height, WITHOUT_LABELS_IN) for height, _ in panels[:-1]]
    column = stacked([*sizes, Panel(panels[-1][0], WITH_LABELS_IN)], narrow=narrow)
    figure = figure_of(column[0])
    bins = bins_for(figure)
    for axes, (_, draw) in zip(column, panels, strict=True):
        _shade(axes, view)
        draw(axes, view, bins)
        axes.set_xlim(*time_span_s(view.signals.time_s))
        axes.tick_params(labelbottom=axes is column[-1])
    column[-1].set_xlabel("time, s")
    return figure


def cycle_in_words(view: RecordingView) -> str:
    """Say in words what `figure_cycle` shows, for those who do not see it."""
    signals = view.signals
    parts = []
    velocity = view.drawn_velocity_rad_s
    if velocity is not None:
        parts.append(f"motor velocity {_span(velocity)} rad/s")
    parts.append(f"motor torque {_span(signals.torque_nm)} N m")
    if view.arm_position_deg is not None:
        parts.append(f"arm position {_span(view.arm_position_deg)} degrees")
    if _recorded(signals.gearbox_temperature_degc):
        parts.append(f"gearbox temperature {_span(signals.gearbox_temperature_degc)} °C")
    lasted_s = float(np.nanmax(signals.time_s) - np.nanmin(signals.time_s))
    windows = len(view.windows)
    return (
        f"Lines over {lasting(lasted_s)} of {signals.name}: {', '.join(parts)}. "
        f"{windows} steady window{'s are' if windows != 1 else ' is'} shaded."
    )


def _panels(view: RecordingView) -> list[tuple[float, _Draw]]:
    """Return the panels that the recording can fill, with their heights in inches."""
    panels: list[tuple[float, _Draw]] = []
    signals = view.signals
    if view.drawn_velocity_rad_s is not None or _recorded(signals.velocity_command_rad_s):
        panels.append((1.2, _velocity))
    panels.append((1.2, _torque))
    if view.arm_position_deg is not None:
        panels.append((0.85, _position))
    if _recorded(signals.gearbox_temperature_degc):
        panels.append((0.65, _temperature))
    return panels


def _velocity(axes: Axes, view: RecordingView, bins: int) -> None:
    measured, command = view.drawn_velocity_rad_s, view.signals.velocity_command_rad_s
    axes.set_title("Motor velocity")
    if command is not None and _recorded(command):
        # Broad and pale beneath the measured line: a perfect follower still shows both.
        _line(axes, view, command, bins, color=COMMAND_PALE, lw=3.2, label="command")
    if measured is not None:
        _line(axes, view, measured, bins, color=MEASURED, label="measured")
    key_in_header(axes, columns=2)
    axes.set_ylabel("rad/s")


def _torque(axes: Axes, view: RecordingView, bins: int) -> None:
    torque_nm = view.signals.torque_nm
    scale = scale_for(
        "N m", [float(np.max(np.abs(torque_nm), initial=0.0, where=_finite(torque_nm)))]
    )
    axes.set_title("Motor torque")
    _line(axes, view, torque_nm * scale.factor, bins, color=MEASURED, lw=0.9)
    axes.set_ylabel(scale.unit)


def _position(axes: Axes, view: RecordingView, bins: int) -> None:
    position_deg = view.arm_position_deg
    if position_deg is not None:
        _line(axes, view, position_deg, bins, color=POSITION)
    axes.set_title("Arm position")
    axes.set_ylabel("degrees")


def _temperature(axes: Axes, view: RecordingView, bins: int) -> None:
    temperature = view.signals.gearbox_temperature_degc
    if temperature is not None:
        _line(axes, view, temperature, bins, color=TEMPERATURE)
        low, high = np.nanmin(temperature), np.nanmax(temperature)
        # At least two degrees: a sensor's last digit must not look like a fever.
        margin = max(0.1 * (high - low), 1.0 - 0.5 * (high - low))
        axes.set_ylim(low - margin, high + margin)
    axes.set_title("Gearbox temperature")
    axes.set_ylabel("°C")


def _line(
    axes: Axes,
    view: RecordingView,
    values: Floats,
    bins: int,
    *,
    color: str,
    label: str = "",
    lw: float = 1.2,
) -> None:
    axes.plot(*polyline(view.signals.time_s, values, bins), color=color, label=label, lw=lw)


def _shade(axes: Axes, view: RecordingView) -> None:
    time_s = view.signals.time_s
    for window in view.windows:
        axes.axvspan(time_s[window.start], time_s[window.stop - 1], color=SHADE, lw=0, zorder=0)


def _recorded(values: Floats | None) -> bool:
    return values is not None and bool(np.isfinite(values).any())


def _finite(values: Floats) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    return np.isfinite(values)


def _span(values: Floats | None) -> str:
    if values is None or not np.isfinite(values).any():
        return "unknown"
    return f"from {np.nanmin(values):.3g} to {np.nanmax(values):.3g}"
