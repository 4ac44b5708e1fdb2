"""The flexible joint: its frequency response, and the torque that it explains (thesis 4.2, 4.3)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from agent.identify.flexible.result import FlexibleFit
from agent.identify.result import Floats
from agent.numbers import scale_for, significant
from agent.report.figures.canvas import (
    MEASURED,
    MEASURED_PALE,
    MUTED,
    NOISE,
    POSITION,
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
from agent.report.figures.flexible_view import Response, Stretch, model_response

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_POINTS = 1200
_SIGMAS = 1.96
_ROOM, _HEADROOM = 1.25, 3.0  # below and above the lines, on the logarithmic axis


@styled
def figure_flexible(
    fit: FlexibleFit,
    response: Response,
    stretch: Stretch,
    *,
    unseen: bool,
    narrow: bool = False,
) -> Figure:
    """Draw the frequency response, measured and fitted, and the torque over some seconds.

    Parameters
    ----------
    fit : FlexibleFit
        A decidable one.
    response : Response
        The motor's acceleration per torque, as measured.
    stretch : Stretch
        Torque over time, measured and from both models.
    unseen : bool
        Whether the fit has not seen that recording.
    narrow : bool
        Draw for a phone's width.

    Raises
    ------
    ValueError
        If the fit has no joint.
    """
    if fit.joint is None or fit.rigid is None:
        raise ValueError(f"expected a flexible joint, got none: {'; '.join(fit.reasons)}")
    panels = [
        Panel(2.3, WITHOUT_LABELS_IN),
        Panel(1.25, WITH_LABELS_IN),
        Panel(1.75, WITHOUT_LABELS_IN),
        Panel(1.15, WITH_LABELS_IN),
    ]
    magnitude, phase, torque, residual = stacked(panels, narrow=narrow, header_in=0.2)
    _magnitude(magnitude, fit, response, narrow=narrow)
    _phase(phase, fit, response)
    _torque(torque, stretch, unseen=unseen, narrow=narrow)
    _residual(residual, stretch, narrow=narrow)
    return figure_of(magnitude)


def _marks(fit: FlexibleFit) -> list[tuple[str, float]]:
    """Return the antiresonances and resonances of the fitted joint, in Hz, by their names."""
    assert fit.joint is not None
    assert fit.joint.chain is not None
    chain, turn = fit.joint.chain, 2.0 * math.pi
    stopped = chain.antiresonances_rad_s() / turn
    free = chain.resonances_rad_s(fit.joint.motor_inertia_kg_m2) / turn
    pairs = zip(stopped.tolist(), free.tolist(), strict=True)
    return [m for a, r in pairs for m in (("antiresonance", a), ("resonance", r))]


def _frequencies(response: Response) -> Floats:
    known = response.frequency_hz
    return np.geomspace(float(known[0]), float(known[-1]), _POINTS)


def _magnitude(axes: Axes, fit: FlexibleFit, response: Response, *, narrow: bool) -> None:
    assert fit.joint is not None
    assert fit.rigid is not None
    clear, at = response.clear, response.frequency_hz
    size = np.abs(response.acceleration_per_nm)
    grid = _frequencies(response)
    model = np.abs(model_response(fit.joint, grid))
    rigid = np.abs(model_response(fit.rigid, grid))
    axes.set_xscale("log")
    axes.set_yscale("log")
    _band(axes, response)
    _measured(axes, at[clear], size[clear], _SIGMAS * (size * response.relative_error)[clear])
    axes.plot(grid, rigid, color=MUTED, lw=1.0, ls=(0, (4, 2)), label="rigid")
    axes.plot(grid, model, color=PREDICTED, lw=1.5, label="flexible, fitted")
    shown = np.concatenate((size[clear], model[(grid >= at[0]) & (grid <= at[-1])]))
    low, high = float(shown.min()), float(shown.max())
    axes.set_ylim(low / _ROOM, high * _HEADROOM)
    for i, (word, hz) in enumerate(_marks(fit)):
        axes.axvline(hz, color=POSITION, lw=0.8, ls=(0, (1, 2)), zorder=1)
        label = f"{word}\n{significant(hz, 3)} Hz"
        side = -1 if i % 2 == 0 else 1
        axes.annotate(
            label,
            (hz, high * _HEADROOM),
            xytext=(4 * side, -2),
            textcoords="offset points",
            ha="right" if side < 0 else "left",
            va="top",
            fontsize=7.5 if narrow else 8.5,
            color=POSITION,
        )
    _frequency_axis(axes, at)
    _plain_ordinates(axes)
    axes.tick_params(labelbottom=False)
    axes.set_title("Acceleration per torque")
    axes.set_ylabel("rad/s² per N m")
    key_in_header(axes, columns=2 if narrow else 4)


def _phase(axes: Axes, fit: FlexibleFit, response: Response) -> None:
    assert fit.joint is not None
    clear, at = response.clear, response.frequency_hz
    grid = _frequencies(response)
    # From -90 to 270 degrees: a passive joint has 0 to 180, and noise must not wrap around.
    turns = (np.degrees(np.angle(response.acceleration_per_nm)) + 90.0) % 360.0 - 90.0
    axes.set_xscale("log")
    _band(axes, response)
    error = np.degrees(_SIGMAS * response.relative_error)
    _measured(axes, at[clear], turns[clear], error[clear])
    axes.axhline(0.0, color=MUTED, lw=1.0, ls=(0, (4, 2)))
    axes.plot(grid, np.degrees(np.angle(model_response(fit.joint, grid))), color=PREDICTED, lw=1.5)
    for _, hz in _marks(fit):
        axes.axvline(hz, color=POSITION, lw=0.8, ls=(0, (1, 2)), zorder=1)
    axes.set_ylim(-100.0, 280.0)
    axes.set_yticks([-90.0, 0.0, 90.0, 180.0, 270.0])
    _frequency_axis(axes, at)
    axes.set_title("Phase")
    axes.set_ylabel("degrees")
    axes.set_xlabel("frequency, Hz (logarithmic)")


def _band(axes: Axes, response: Response) -> None:
    low, high = response.excited_hz()
    if math.isfinite(low):
        axes.axvspan(low, high, color=SHADE, lw=0, zorder=0, label="excited")


def _measured(axes: Axes, at: Floats, values: Floats, error: Floats) -> None:
    axes.vlines(at, values - error, values + error, color=MEASURED_PALE, lw=1.2, zorder=2)
    axes.plot(at, values, "o", ms=3.0, color=MEASURED, label="measured, 95 % interval", zorder=3)


def _frequency_axis(axes: Axes, at: Floats) -> None:
    axes.set_xlim(float(at[0]) * 0.95, float(at[-1]) * 1.05)
    plain_ticks(axes)


def _plain_ordinates(axes: Axes) -> None:
    """Write 20, 50, 100 on the logarithmic ordinate."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    low, high = axes.get_ylim()
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    axes.yaxis.set_minor_locator(NullLocator())


def _torque(axes: Axes, stretch: Stretch, *, unseen: bool, narrow: bool) -> None:
    scale = scale_for("N m", (float(np.nanmax(np.abs(stretch.measured_nm))),))
    time = stretch.time_s
    axes.plot(
        time, stretch.measured_nm * scale.factor, color=MEASURED_PALE, lw=3.2, label="measured"
    )
    axes.plot(
        time, stretch.rigid_nm * scale.factor, color=MUTED, lw=1.0, ls=(0, (4, 2)), label="rigid"
    )
    axes.plot(time, stretch.flexible_nm * scale.factor, color=PREDICTED, lw=1.2, label="flexible")
    seen = "a run that the fit has not seen" if unseen else "some seconds of what was fitted"
    axes.set_title("Motor torque" if narrow else f"Motor torque, {seen}")
    axes.set_xlim(float(time[0]), float(time[-1]))
    axes.set_ylabel(scale.unit)
    axes.tick_params(labelbottom=False)
    key_in_header(axes, columns=3)


def _residual(axes: Axes, stretch: Stretch, *, narrow: bool) -> None:
    flexible, rigid = _left(stretch)
    scale = scale_for("N m", (rigid,))
    time, measured = stretch.time_s, stretch.measured_nm
    axes.axhline(0.0, color=NOISE, lw=0.8)
    for values, size, color, name in (
        (stretch.rigid_nm, rigid, MUTED, "rigid"),
        (stretch.flexible_nm, flexible, PREDICTED, "flexible"),
    ):
        label = f"{name}: {significant(size * scale.factor, 3)} {scale.unit} rms"
        axes.plot(time, (measured - values) * scale.factor, color=color, lw=1.1, label=label)
    axes.set_xlim(float(time[0]), float(time[-1]))
    axes.set_title("Left" if narrow else "What is left of it")
    axes.set_ylabel(scale.unit)
    axes.set_xlabel("time, s" if narrow else f"time, s, of {stretch.recording}")
    key_in_header(axes, columns=2)


def _left(stretch: Stretch) -> tuple[float, float]:
    """Return the root mean squares that both models leave of a stretch, N m."""
    left = (stretch.measured_nm - model for model in (stretch.flexible_nm, stretch.rigid_nm))
    flexible, rigid = (float(np.sqrt(np.nanmean(values**2))) for values in left)
    return flexible, rigid
