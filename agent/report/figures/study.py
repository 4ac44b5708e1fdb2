"""Pictures of the regression's study: threshold sweep, speeds, correlations (thesis 4.1)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agent.identify.result import Floats
from agent.identify.rigid.course import Course
from agent.identify.rigid.residuals import Correlation
from agent.identify.rigid.thresholding import AccelerationSweep, SpeedStudy
from agent.numbers import parameter_label, parameter_unit, scale_for, significant
from agent.report.figures.canvas import (
    MEASURED,
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
from trajectories import lasting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_IN = 1.15
_LAGS_IN = 1.6
_BAND_LABEL = "99 % of chance"


@styled
def figure_threshold_sweep(sweep: AccelerationSweep, *, narrow: bool = False) -> Figure:
    """Draw parameters, their standard deviations and the condition number (Figure 4.4).

    Parameters
    ----------
    sweep : AccelerationSweep
        One regression for every threshold.
    narrow : bool
        Draw for a phone's width.
    """
    return _parameters_against(
        sweep.threshold_rad_s2,
        sweep,
        "acceleration threshold, rad/s²",
        logarithmic=True,
        narrow=narrow,
    )


@styled
def figure_speed_study(study: SpeedStudy, *, narrow: bool = False) -> Figure:
    """Draw the same against the fastest speed of each point-to-point run (Figure 4.5)."""
    return _parameters_against(
        study.speed_rad_s, study, "fastest motor speed, rad/s", logarithmic=False, narrow=narrow
    )


@styled
def figure_course(course: Course, *, narrow: bool = False) -> Figure:
    """Draw the same against how much motion had been recorded, rows folded in as they came."""
    return _parameters_against(
        course.time_s, course, "motion so far, s", logarithmic=False, narrow=narrow
    )


@styled
def figure_correlation(correlation: Correlation, *, narrow: bool = False) -> Figure:
    """Draw the residual's auto- and cross-correlation with their bands (Figure 4.3).

    Parameters
    ----------
    correlation : Correlation
        Of one fit's residual.
    narrow : bool
        Draw for a phone's width.
    """
    upper, lower = stacked([Panel(_LAGS_IN, WITH_LABELS_IN)] * 2, narrow=narrow)
    _lags(upper, correlation.lag_s, correlation.auto, correlation.auto_band)
    upper.set_title("Residual with itself")
    upper.set_xlim(0.0, float(correlation.lag_s[-1]))
    _lags(lower, correlation.cross_lag_s, correlation.cross, correlation.cross_band)
    lower.set_title("Residual with the velocity")
    lower.set_xlim(float(correlation.cross_lag_s[0]), float(correlation.cross_lag_s[-1]))
    key_in_header(upper, columns=1)
    return figure_of(upper)


def threshold_sweep_in_words(sweep: AccelerationSweep) -> str:
    """Say in words what `figure_threshold_sweep` shows, for those who do not see it."""
    best = sweep.best
    return (
        "Parameters with one standard deviation to either side, and the condition number, over "
        f"the acceleration threshold. With every row the condition number is "
        f"{significant(float(sweep.condition_number[0]), 3)}; it is least, "
        f"{significant(float(sweep.condition_number[best]), 3)}, without accelerations above "
        f"{significant(float(sweep.threshold_rad_s2[best]), 3)} rad/s²."
    )


def speed_study_in_words(study: SpeedStudy) -> str:
    """Say in words what `figure_speed_study` shows."""
    return (
        "Parameters with one standard deviation to either side, and the condition number, over "
        f"the fastest speed of {study.speed_rad_s.size} runs. The condition number goes from "
        f"{significant(float(study.condition_number[0]), 3)} at "
        f"{significant(float(study.speed_rad_s[0]), 3)} rad/s to "
        f"{significant(float(study.condition_number[-1]), 3)} at "
        f"{significant(float(study.speed_rad_s[-1]), 3)} rad/s."
    )


def course_in_words(course: Course) -> str:
    """Say in words what `figure_course` shows."""
    settled = [
        f"{_within(parameter_label(name))} from {at:.3g} s on"
        for name, at in course.settled_s().items()
    ]
    return (
        f"Of {lasting(float(course.time_s[-1]))} of motion, taken as it came, each number stays "
        f"within 1 % of its last value: {', '.join(settled)}."
    )


def _within(label: str) -> str:
    """Return a label as it stands within a sentence; Coulomb keeps his capital."""
    return label if label.startswith("Coulomb") else f"{label[:1].lower()}{label[1:]}"


def correlation_in_words(correlation: Correlation) -> str:
    """Say in words what `figure_correlation` shows."""
    return (
        "Correlation of the residual with itself and with the velocity over the lag. Outside the "
        f"band lie {100 * correlation.auto_outside:.0f} % of the lags with itself and "
        f"{100 * correlation.cross_outside:.0f} % of those with the velocity; chance would leave "
        "1 % there."
    )


def _parameters_against(
    at: Floats,
    study: AccelerationSweep | SpeedStudy | Course,
    label: str,
    *,
    logarithmic: bool,
    narrow: bool,
) -> Figure:
    """Draw a panel for each parameter and one for the condition number, over one abscissa."""
    count = len(study.parameters)
    panels = [Panel(_PANEL_IN, WITHOUT_LABELS_IN)] * count + [Panel(_PANEL_IN, WITH_LABELS_IN)]
    column = stacked(panels, narrow=narrow)
    for k, (axes, name) in enumerate(zip(column, study.parameters, strict=False)):
        value, deviation = study.theta[:, k], study.standard_deviation[:, k]
        known = np.isfinite(value)
        unit = parameter_unit(name)
        scale = scale_for(unit, value[known].tolist())
        middle, reach = value[known] * scale.factor, deviation[known] * scale.factor
        axes.fill_between(
            at[known], middle - reach, middle + reach, color=SHADE, lw=0, label="± 1 std. dev."
        )
        axes.plot(at[known], middle, color=MEASURED, marker="o", ms=2.6, label="estimate")
        axes.set_title(parameter_label(name))
        axes.set_ylabel(scale.unit)
        axes.tick_params(labelbottom=False)
    key_in_header(column[0], columns=1 if narrow else 2)
    last = column[-1]
    finite = np.isfinite(study.condition_number)
    last.plot(at[finite], study.condition_number[finite], color=PREDICTED, marker="o", ms=2.6)
    last.set_title("Condition number (4.11)")
    last.set_xlabel(label)
    if logarithmic:
        for axes in column:
            axes.set_xscale("log")
            axes.set_xlim(float(at.min()), float(at.max()))
            plain_ticks(axes)
    last.set_ylim(bottom=0.0)
    return figure_of(last)


def _lags(axes: Axes, lag_s: Floats, values: Floats, band: Floats) -> None:
    axes.fill_between(lag_s, -band, band, color=SHADE, lw=0, label=_BAND_LABEL)
    axes.plot(lag_s, values, color=MEASURED, marker="o", ms=2.6)
    largest = float(np.max(np.abs(values)))
    axes.set_ylim(-1.1 * max(largest, 0.2), 1.1 * max(largest, 0.2))
    axes.set_xlabel("lag, s")
    axes.set_ylabel("correlation")
