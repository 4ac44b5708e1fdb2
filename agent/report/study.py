"""The offline page of a regression's study: one HTML file without network or script."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from agent.identify.result import Parameter, Validation
from agent.identify.rigid.course import Course
from agent.identify.rigid.instrumental import InstrumentalFit
from agent.identify.rigid.residuals import Correlation
from agent.identify.rigid.thresholding import AccelerationSweep, SpeedStudy
from agent.identify.sentence import percent
from agent.numbers import parameter_label, parameter_unit, scale_for, significant, written
from agent.record.atomic import publish
from agent.report.estimate import Picture
from agent.report.figures.canvas import data_uri
from agent.report.figures.study import (
    correlation_in_words,
    course_in_words,
    figure_correlation,
    figure_course,
    figure_speed_study,
    figure_threshold_sweep,
    speed_study_in_words,
    threshold_sweep_in_words,
)
from agent.report.page import render

if TYPE_CHECKING:
    from matplotlib.figure import Figure

S = TypeVar("S")


@dataclass(frozen=True)
class StudyPage:
    """What the page shows.

    Parameters
    ----------
    sentence : str
        The finding, in one sentence.
    sweep : AccelerationSweep
        The regression against the acceleration threshold.
    correlation : Correlation or None
        Of the residual; None where it is too short.
    findings : sequence of str
        What the residual says.
    judged_on : str
        Which recording's residual that is.
    speeds : SpeedStudy or None
        One fit for every run, where there are several.
    instrumental : InstrumentalFit or None
        Where the recordings hold the commanded trajectory.
    validation : Validation or None
        How well a run is predicted that the fit has not seen; then it is judged.
    course : Course or None
        How the regression came about while the cycle went on; None for too little motion.
    trade_off : bool
        Whether no choice of samples is the best one, so that the page approves of none.
    """

    sentence: str
    sweep: AccelerationSweep
    correlation: Correlation | None
    findings: Sequence[str]
    judged_on: str
    speeds: SpeedStudy | None = None
    instrumental: InstrumentalFit | None = None
    validation: Validation | None = None
    course: Course | None = None
    trade_off: bool = False


def validation_in_words(validation: Validation) -> str:
    """Say how well the rigid body predicts a run that it has not seen."""
    scale = scale_for("N m", [validation.rmse_nm])
    return (
        f"On {validation.recording}, which the fit has not seen, the rigid body predicts the "
        f"torque with {percent(validation.fit_percent)} fit; "
        f"{significant(scale.factor * validation.rmse_nm, 3)} {scale.unit} rms is left, a relative "
        f"torque error of {validation.relative_torque_error_percent:.2f} %."
    )


def write_study_page(path: Path, page: StudyPage, *, robot: str = "", axis: int | str = "") -> Path:
    """Write the page, whole or not at all.

    Parameters
    ----------
    path : Path
        Where to; the folder must exist. A file that is there is replaced.
    page : StudyPage
        What is shown.
    robot : str
        As the user calls it; untrusted, escaped.
    axis : int or str
        As the cell numbers it.

    Raises
    ------
    agent.errors.StorageError
        If the file cannot be written.
    """
    html = study_html(page, robot=robot, axis=axis)
    publish({path: html.encode("utf-8")}, overwrite=True)
    return path


def study_html(page: StudyPage, *, robot: str = "", axis: int | str = "") -> str:
    """Return the page as text; the same input gives the same text."""
    return render(
        "study.html.j2",
        robot=robot,
        axis=str(axis),
        page=page,
        sweep=_picture(page.sweep, figure_threshold_sweep, threshold_sweep_in_words),
        correlation=None
        if page.correlation is None
        else _picture(page.correlation, figure_correlation, correlation_in_words),
        speeds=None
        if page.speeds is None
        else _picture(page.speeds, figure_speed_study, speed_study_in_words),
        course=None
        if page.course is None
        else _picture(page.course, figure_course, course_in_words),
        steps=sweep_rows(page.sweep),
        validation="" if page.validation is None else validation_in_words(page.validation),
        instrument_rows=() if page.instrumental is None else _instrument_rows(page.instrumental),
        strength="" if page.instrumental is None else significant(page.instrumental.strength, 3),
    )


def sweep_rows(sweep: AccelerationSweep) -> tuple[tuple[str, str, str], ...]:
    """Return threshold, condition number and samples as written, one row for each threshold."""
    return tuple(
        (significant(float(t), 3), significant(float(c), 3), str(n))
        for t, c, n in zip(
            sweep.threshold_rad_s2, sweep.condition_number, sweep.samples, strict=True
        )
    )


def _picture(value: S, draw: Callable[..., Figure], words: Callable[[S], str]) -> Picture:
    return Picture(data_uri(draw(value)), data_uri(draw(value, narrow=True)), words(value))


def _instrument_rows(fit: InstrumentalFit) -> list[tuple[str, str, str, str, str]]:
    """Return label, unit, both estimates with intervals, and whether they differ."""
    rows = []
    for name, parameter in fit.parameters.items():
        plain = fit.least_squares[name]
        values = [p.value for p in (parameter, plain) if p.identified]
        if not values:
            continue
        scale = scale_for(parameter_unit(name), values)
        verdict = "yes" if name in fit.moved else "no"
        both = [_written(p, scale.factor) for p in (plain, parameter)]
        rows.append((parameter_label(name), scale.unit, both[0], both[1], verdict))
    return rows


def _written(parameter: Parameter, factor: float) -> str:
    if not parameter.identified:
        return f"not identified: {parameter.reason}"
    value, interval, _ = written(parameter, factor)
    return f"{value} ({interval})" if interval else value
