"""How well the identified rigid body (thesis 4.5) predicts the torque that was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agent.identify.result import Floats
from agent.report.canvas import (
    INK,
    MEASURED,
    MUTED,
    PREDICTED,
    SHADE,
    bins_for,
    extremes,
    key_in_header,
    new_figure,
    styled,
)
from agent.report.numbers import Scale, scale_for, significant
from agent.report.views import RecordingView

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARKS = 1500
_VELOCITY_BINS = 24
_LEAST_PER_BIN = 20


@styled
def figure_prediction(view: RecordingView, *, narrow: bool = False) -> Figure:
    """Draw predicted over measured torque, the residual over time, and over velocity.

    The residual (thesis 4.6) is measured less predicted torque, over the samples compared; the
    band is plus and minus its root mean square.

    Parameters
    ----------
    view : RecordingView
        One recording with a predicted torque.
    narrow : bool
        Draw for a phone's width.

    Raises
    ------
    ValueError
        If the recording has no predicted torque.
    """
    residual_nm, predicted_nm = view.residual_nm, view.torque_predicted_nm
    if residual_nm is None or predicted_nm is None:
        raise ValueError(f"{view.signals.name}: expected a predicted torque, found none")
    velocity = view.drawn_velocity_rad_s
    rows = 2 if velocity is None else 3
    figure = new_figure(1.0 + 1.75 * rows, narrow=narrow)
    grid = figure.subplots(rows, 1, squeeze=False, height_ratios=[1.5, 1.0, 1.3][:rows])
    over_time, residual_axes = grid[0, 0], grid[1, 0]
    residual_axes.sharex(over_time)
    over_time.tick_params(labelbottom=False)
    bins = bins_for(figure)
    _torque(over_time, view, predicted_nm, bins)
    scale = scale_for("N m", [_largest(residual_nm)])
    _residual_over_time(residual_axes, view, residual_nm, scale, bins)
    if velocity is not None:
        _residual_over_velocity(grid[2, 0], velocity, residual_nm, scale)
    figure.align_ylabels(list(grid[:, 0]))
    return figure


def rms(values: Floats) -> float:
    """Return the root mean square of the finite values, NaN when there are none."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def prediction_in_words(view: RecordingView) -> str:
    """Say in words what `figure_prediction` shows, for those who do not see it."""
    residual_nm = view.residual_nm
    if residual_nm is None:
        raise ValueError(f"{view.signals.name}: expected a predicted torque, found none")
    scale = scale_for("N m", [rms(residual_nm)])
    return (
        f"Measured and predicted motor torque of {view.signals.name} over time; below it their "
        f"difference, which is {significant(rms(residual_nm) * scale.factor, 3)} {scale.unit} "
        f"rms and at most {significant(_largest(residual_nm) * scale.factor, 3)} {scale.unit}, "
        "over time and over velocity."
    )


def _torque(axes: Axes, view: RecordingView, predicted_nm: Floats, bins: int) -> None:
    measured_nm = view.signals.torque_nm
    scale = scale_for("N m", [_largest(measured_nm)])
    for values, color, width, label in (
        (measured_nm, MEASURED, 0.9, "measured"),
        (predicted_nm, PREDICTED, 1.1, "predicted"),
    ):
        kept = extremes(values, bins)
        axes.plot(
            view.signals.time_s[kept],
            values[kept] * scale.factor,
            color=color,
            lw=width,
            label=label,
        )
    key_in_header(axes, columns=2)
    axes.set_title("Motor torque")
    axes.set_ylabel(scale.unit)


def _residual_over_time(
    axes: Axes, view: RecordingView, residual_nm: Floats, scale: Scale, bins: int
) -> None:
    time_s = view.signals.time_s
    kept = extremes(residual_nm, bins)
    band = rms(residual_nm) * scale.factor
    axes.axhspan(
        -band, band, color=SHADE, lw=0, zorder=0, label=f"± rms {significant(band, 3)} {scale.unit}"
    )
    axes.plot(time_s[kept], residual_nm[kept] * scale.factor, color=INK, lw=0.6)
    axes.set_xlim(np.nanmin(time_s), np.nanmax(time_s))
    axes.set_title("Measured less predicted")
    axes.set_ylabel(scale.unit)
    axes.set_xlabel("time, s")
    key_in_header(axes, columns=1)


def _residual_over_velocity(
    axes: Axes, velocity_rad_s: Floats, residual_nm: Floats, scale: Scale
) -> None:
    compared = np.flatnonzero(np.isfinite(residual_nm) & np.isfinite(velocity_rad_s))
    residual = residual_nm * scale.factor
    # An even choice in order of velocity shows every velocity, however briefly it was passed.
    ordered = compared[np.argsort(velocity_rad_s[compared], kind="stable")]
    shown = ordered[np.linspace(0, ordered.size - 1, min(_MARKS, ordered.size)).astype(np.intp)]
    axes.plot(
        velocity_rad_s[shown],
        residual[shown],
        ls="",
        marker=".",
        ms=2.2,
        mew=0,
        color=MUTED,
        alpha=0.55,
    )
    band = rms(residual)
    axes.axhspan(-band, band, color=SHADE, lw=0, zorder=0)
    middle, median = medians_by_velocity(velocity_rad_s[compared], residual[compared])
    axes.plot(middle, median, color=PREDICTED, lw=1.6, marker="o", ms=3.2, label="median")
    key_in_header(axes, columns=1)
    axes.set_title("Measured less predicted, by velocity")
    axes.set_xlabel("motor velocity, rad/s")
    axes.set_ylabel(scale.unit)


def medians_by_velocity(velocity_rad_s: Floats, residual: Floats) -> tuple[Floats, Floats]:
    """Return the residual's median in equal steps of velocity.

    Parameters
    ----------
    velocity_rad_s, residual : ndarray, shape (n,)
        Finite.

    Returns
    -------
    tuple of ndarray, shape (m,)
        Each step's mean velocity and median residual; steps with few samples are left out.
    """
    if velocity_rad_s.size == 0:
        return np.empty(0), np.empty(0)
    edges = np.linspace(velocity_rad_s.min(), velocity_rad_s.max(), _VELOCITY_BINS + 1)
    step = np.clip(np.searchsorted(edges, velocity_rad_s, side="right") - 1, 0, _VELOCITY_BINS - 1)
    filled = [k for k in range(_VELOCITY_BINS) if np.count_nonzero(step == k) >= _LEAST_PER_BIN]
    return (
        np.array([velocity_rad_s[step == k].mean() for k in filled]),
        np.array([np.median(residual[step == k]) for k in filled]),
    )


def _largest(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(np.max(np.abs(finite))) if finite.size else float("nan")
