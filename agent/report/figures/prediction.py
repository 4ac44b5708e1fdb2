"""How well the identified rigid body (thesis 4.5) predicts the torque that was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agent.identify.result import Floats
from agent.numbers import Scale, scale_for, significant
from agent.report.figures.canvas import (
    INK,
    MEASURED_PALE,
    MUTED,
    NOISE,
    PREDICTED,
    SHADE,
    WITH_LABELS_IN,
    WITHOUT_LABELS_IN,
    Panel,
    bins_for,
    dots,
    figure_of,
    key_in_header,
    stacked,
    styled,
)
from agent.report.figures.thinning import envelope, polyline, time_span_s
from agent.report.views import RecordingView

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARKS = 900
_PEAK_IN_RMS = 8.0
_STRETCHES = 12
_LEAST_SAMPLES = 20


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
    residual_nm, predicted_nm = view.residual_nm, view.drawn_prediction_nm
    if residual_nm is None or predicted_nm is None:
        raise ValueError(f"{view.signals.name}: expected a predicted torque, found none")
    velocity = view.drawn_velocity_rad_s
    panels = [
        Panel(1.75, WITHOUT_LABELS_IN),
        Panel(1.2, WITH_LABELS_IN),
        Panel(1.5, WITH_LABELS_IN),
    ]
    column = stacked(panels if velocity is not None else panels[:2], narrow=narrow)
    figure = figure_of(column[0])
    bins = bins_for(figure)
    _torque(column[0], view, predicted_nm, bins)
    scale = scale_for("N m", [rms(residual_nm)])
    _residual_over_time(column[1], view, residual_nm, scale, bins)
    if velocity is not None:
        _residual_over_velocity(column[2], velocity, residual_nm, scale)
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
    measured_nm = view.compared_torque_nm
    scale = scale_for("N m", [_largest(measured_nm)])
    for values, color, width, label in (
        (measured_nm, MEASURED_PALE, 2.6, "measured"),
        (predicted_nm, PREDICTED, 0.9, "predicted"),
    ):
        line = polyline(view.signals.time_s, values * scale.factor, bins)
        axes.plot(*line, color=color, lw=width, label=label)
    key_in_header(axes, columns=2)
    axes.set_xlim(*time_span_s(view.signals.time_s))
    axes.tick_params(labelbottom=False)
    axes.set_title("Motor torque")
    axes.set_ylabel(scale.unit)


def _residual_over_time(
    axes: Axes, view: RecordingView, residual_nm: Floats, scale: Scale, bins: int
) -> None:
    time_s = view.signals.time_s
    band = rms(residual_nm) * scale.factor
    _band(axes, band, label=f"± rms {significant(band, 3)} {scale.unit}")
    centre_s, low, mean, high = envelope(time_s, residual_nm * scale.factor, bins // 2)
    axes.fill_between(centre_s, low, high, color=NOISE, lw=0)
    axes.plot(centre_s, mean, color=INK, lw=0.9, label="mean")
    axes.set_xlim(*time_span_s(time_s))
    _keep_readable(axes, time_s, residual_nm * scale.factor, band, scale.unit)
    axes.set_title("Residual")
    axes.set_ylabel(scale.unit)
    axes.set_xlabel("time, s")
    key_in_header(axes, columns=2)


def _keep_readable(axes: Axes, time_s: Floats, residual: Floats, band: float, unit: str) -> None:
    """Cut the axis where one peak would flatten all the rest, and say how high the peak is."""
    size = np.abs(np.where(np.isfinite(residual), residual, 0.0))
    at = int(np.argmax(size))
    if not size[at] > _PEAK_IN_RMS * band > 0.0:
        return
    axes.set_ylim(-_PEAK_IN_RMS * band, _PEAK_IN_RMS * band)
    axes.annotate(
        f"beyond the axis: {significant(float(residual[at]), 3)} {unit} at {time_s[at]:.3g} s",
        (0.01, 0.97),
        xycoords="axes fraction",
        va="top",
        color=MUTED,
        fontsize=8.5,
    )


def _band(axes: Axes, band: float, *, label: str = "_band") -> None:
    """Shade plus and minus the root mean square; its edges stay visible above the data."""
    axes.axhspan(-band, band, color=SHADE, lw=0, zorder=0, label=label)
    for edge in (-band, band):
        axes.axhline(edge, color=MUTED, lw=0.7, ls=(0, (4, 3)), zorder=3)


def _residual_over_velocity(
    axes: Axes, velocity_rad_s: Floats, residual_nm: Floats, scale: Scale
) -> None:
    compared = np.flatnonzero(np.isfinite(residual_nm) & np.isfinite(velocity_rad_s))
    residual = residual_nm * scale.factor
    # An even choice in order of velocity shows every velocity, however briefly it was passed.
    ordered = compared[np.argsort(velocity_rad_s[compared], kind="stable")]
    shown = ordered[np.linspace(0, ordered.size - 1, min(_MARKS, ordered.size)).astype(np.intp)]
    dots(axes, velocity_rad_s[shown], residual[shown], color=MUTED, size_pt=1.7, alpha=0.45)
    _band(axes, rms(residual))
    label = "median"
    for direction in (velocity_rad_s < 0, velocity_rad_s > 0):  # friction jumps at zero
        passed = compared[direction[compared]]
        middle, median = medians_by_velocity(velocity_rad_s[passed], residual[passed])
        axes.plot(middle, median, color=PREDICTED, lw=1.6, marker="o", ms=3.4, label=label)
        label = "_median"
    key_in_header(axes, columns=1)
    axes.set_title("Residual by velocity")
    axes.set_xlabel("motor velocity, rad/s")
    axes.set_ylabel(scale.unit)


def medians_by_velocity(velocity_rad_s: Floats, residual: Floats) -> tuple[Floats, Floats]:
    """Return the residual's median over stretches of velocity that hold equally many samples.

    Parameters
    ----------
    velocity_rad_s, residual : ndarray, shape (n,)
        Finite, of one direction of motion.

    Returns
    -------
    tuple of ndarray, shape (m,)
        Each stretch's median velocity and median residual, with rising velocity; fewer stretches
        where there are few samples.
    """
    stretches = min(_STRETCHES, velocity_rad_s.size // _LEAST_SAMPLES)
    if stretches == 0:
        return np.empty(0), np.empty(0)
    parts = np.array_split(np.argsort(velocity_rad_s, kind="stable"), stretches)
    return (
        np.array([np.median(velocity_rad_s[part]) for part in parts]),
        np.array([np.median(residual[part]) for part in parts]),
    )


def _largest(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(np.max(np.abs(finite))) if finite.size else float("nan")
