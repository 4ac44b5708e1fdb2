"""`stribeck study`: what a rigid-body regression is worth, and what it leaves."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import typer

from agent.cli.terminal.talk import talker
from agent.conclude.outcome import Conclusion, conclude, signals_of
from agent.errors import InputError
from agent.identify.result import Floats
from agent.identify.rigid.course import Course, course_of
from agent.identify.rigid.instrumental import fit_instrumental, has_command
from agent.identify.rigid.regression import rows_of
from agent.identify.rigid.residuals import Correlation, correlate, residual_in_words, residual_of
from agent.identify.rigid.thresholding import (
    AccelerationSweep,
    SpeedStudy,
    study_speeds,
    sweep_acceleration,
)
from agent.identify.signals.preprocess import Motion, filter_motion, read_motion
from agent.record.atomic import check_folder, make_folder, publish
from agent.record.reading import read, read_all
from agent.report.study import StudyPage, validation_in_words, write_study_page

SCHEMA = "stribeck.study/1"
_RUNS_FOR_SPEEDS = 3
_GAINS = 0.95  # of the condition number with every sample: less of a fall is not worth a word
_AS_GOOD = 1.2  # times the narrowest interval: no wider, and two choices are one


def run_study(
    patterns: Sequence[str], out: Path, *, as_json: bool, validation: str | None = None
) -> None:
    """Study the regression of these recordings, write page and numbers, print the finding.

    Parameters
    ----------
    patterns : sequence of str
        The recordings of the fit.
    out : Path
        Folder of the page and its numbers.
    as_json : bool
        Whether the numbers go to stdout.
    validation : str, optional
        A run of its own, best the reversed stair: its residual is judged in place of the fit's.

    Raises
    ------
    agent.errors.InputError
        Where the recordings carry no rigid body.
    """
    check_folder(out)
    unseen = None if validation is None else read(validation)
    conclusion = conclude(read_all(patterns), unseen)
    page = study_of(conclusion)
    make_folder(out)
    document = json.dumps(to_json(page, conclusion), indent=2)
    metadata = conclusion.recordings[0].metadata
    publish({out / "study.json": f"{document}\n".encode()}, overwrite=True)
    written = write_study_page(out / "study.html", page, robot=metadata.robot, axis=metadata.axis)
    if as_json:
        talker().print(f"The page is in {written}.")
        typer.echo(document)
        return
    typer.echo(page.sentence)
    if page.validation is not None:
        typer.echo(f"\n{validation_in_words(page.validation)}")
    for finding in page.findings:
        typer.echo(f"  - {finding}")
    if page.course is not None:
        from agent.report.figures.study import course_in_words

        typer.echo(f"\n{course_in_words(page.course)}")
    typer.echo(f"\nOpen this file:\n  {written}")


def study_of(conclusion: Conclusion) -> StudyPage:
    """Study the rigid body of a conclusion.

    Raises
    ------
    agent.errors.InputError
        Where the recordings carry no rigid body.
    """
    body, cutoff_hz = conclusion.estimate.rigid_body, conclusion.identification.cutoff_hz
    if body is None:
        reasons = "; ".join(conclusion.estimate.reasons) or "no rigid body was identified"
        raise InputError(
            f"There is no regression to study: {reasons}.",
            "Record a stair of several speeds in both directions.",
        )
    motions = [read_motion(signals_of(r)) for r in conclusion.recordings]
    rows = rows_of(motions, cutoff_hz)
    sweep = sweep_acceleration(rows)
    unseen = conclusion.validation
    judged = motions if unseen is None else [read_motion(signals_of(unseen))]
    stretches = [s for motion in judged for s in filter_motion(motion, cutoff_hz)]
    residual = residual_of(stretches, body, cutoff_hz)
    correlation: Correlation | None
    try:
        correlation = correlate(residual)
        findings = residual_in_words(residual, correlation)
    except ValueError as error:
        correlation, findings = None, (f"The residual is not judged: {error}.",)
    commanded = all(has_command(motion.signals) for motion in motions)
    return StudyPage(
        sentence=finding(sweep),
        trade_off=pulls_apart(sweep),
        sweep=sweep,
        correlation=correlation,
        findings=findings,
        judged_on=", ".join(motion.signals.name for motion in judged),
        validation=conclusion.estimate.validation,
        speeds=_speeds(motions, cutoff_hz),
        instrumental=fit_instrumental(motions, cutoff_hz) if commanded else None,
        course=course_of(rows),
    )


def to_json(page: StudyPage, conclusion: Conclusion) -> dict[str, Any]:
    """Return the study as plain JSON; what is not a number is null."""
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "recordings": list(conclusion.estimate.recordings),
        "sentence": page.sentence,
        "cutoff_hz": conclusion.identification.cutoff_hz,
        "threshold_sweep": {
            "threshold_rad_s2": page.sweep.threshold_rad_s2.tolist(),
            "samples": page.sweep.samples.tolist(),
            **_regressions(page.sweep),
        },
        "residual": {"judged_on": page.judged_on, "findings": list(page.findings)},
        "validation": None if page.validation is None else page.validation.to_json(),
        "speeds": None,
        "instrumental": None,
        "course": None,
    }
    if page.correlation is not None:
        names = ("lag_s", "auto", "auto_band", "cross_lag_s", "cross", "cross_band")
        document["residual"] |= {name: getattr(page.correlation, name).tolist() for name in names}
    if page.speeds is not None:
        document["speeds"] = {
            "speed_rad_s": page.speeds.speed_rad_s.tolist(),
            **_regressions(page.speeds),
        }
    if page.course is not None:
        document["course"] = {
            "time_s": page.course.time_s.tolist(),
            "settled_s": page.course.settled_s(),
            **_regressions(page.course),
        }
    fit = page.instrumental
    if fit is not None:
        document["instrumental"] = {
            "strength": fit.strength,
            "moved": list(fit.moved),
            "parameters": {name: p.to_json() for name, p in fit.parameters.items()},
            "least_squares": {name: p.to_json() for name, p in fit.least_squares.items()},
        }
    return document


def _regressions(study: AccelerationSweep | SpeedStudy | Course) -> dict[str, Any]:
    return {
        "condition_number": _numbers(study.condition_number),
        "parameters": {
            name: {
                "value": _numbers(study.theta[:, k]),
                "standard_deviation": _numbers(study.standard_deviation[:, k]),
            }
            for k, name in enumerate(study.parameters)
        },
    }


def _numbers(values: Floats) -> list[float | None]:
    return [float(v) if math.isfinite(v) else None for v in values]


def _speeds(motions: Sequence[Motion], cutoff_hz: float) -> SpeedStudy | None:
    """Study the runs one by one, where there are several."""
    runs = [rows_of([motion], cutoff_hz) for motion in motions]
    runs = [r for r in runs if r.torque_nm.size]
    return study_speeds(runs) if len(runs) >= _RUNS_FOR_SPEEDS else None


def _inertia_known(sweep: AccelerationSweep) -> Floats:
    """Return the inertia's standard deviation over its value at each threshold, shape (k,)."""
    place = sweep.parameters.index("inertia_kg_m2")
    value, deviation = sweep.theta[:, place], sweep.standard_deviation[:, place]
    shares = np.full(value.shape, np.inf)
    known = np.isfinite(value) & np.isfinite(deviation) & (value != 0.0)
    shares[known] = deviation[known] / np.abs(value[known])
    return shares


def _mixed_least(sweep: AccelerationSweep) -> int:
    """Return where inertia and friction are mixed up least: every sample, unless others gain."""
    first, best = sweep.condition_number[0], sweep.best
    gains = np.isfinite(first) and sweep.condition_number[best] < _GAINS * first
    return best if gains else 0


def pulls_apart(sweep: AccelerationSweep) -> bool:
    """Tell whether the samples that mix least are not those that know the inertia best."""
    shares = _inertia_known(sweep)
    return bool(shares[_mixed_least(sweep)] > _AS_GOOD * shares.min())


def finding(sweep: AccelerationSweep) -> str:
    """Say which samples mix up inertia and friction least, and which know the inertia best."""
    step, first = _mixed_least(sweep), float(sweep.condition_number[0])
    numbers = f"condition number {first:.3g}"
    if step:
        numbers = f"condition number {sweep.condition_number[step]:.3g}; with every sample "
        numbers += f"{first:.3g}"
    edge = ", the last step of this scan" if step and step == _last(sweep) else ""
    least = (
        f"Inertia and friction are mixed up least {_samples_at(sweep, step)}{edge} ({numbers}; the "
        "lower, the better)"
    )
    shares = _inertia_known(sweep)
    if not np.isfinite(shares).any():
        return f"{least}."
    if not pulls_apart(sweep):
        return f"{least}, and the inertia is known as well there as anywhere."
    known = int(np.argmin(shares))
    return (
        f"No choice of samples is best for everything. {least}. There the inertia is known to "
        f"{_percent(shares[step])} only; it is known best, to {_percent(shares[known])}, "
        f"{_samples_at(sweep, known)} (standard deviations)."
    )


def _last(sweep: AccelerationSweep) -> int:
    """Return the index of the lowest threshold that leaves enough samples."""
    return int(np.flatnonzero(np.isfinite(sweep.theta[:, 0]))[-1])


def _samples_at(sweep: AccelerationSweep, step: int) -> str:
    if step == 0:
        return "with every sample"
    return f"without accelerations above {sweep.threshold_rad_s2[step]:.3g} rad/s²"


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"
