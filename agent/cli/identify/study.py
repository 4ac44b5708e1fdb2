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
from agent.record.atomic import make_folder, publish
from agent.record.reading import read, read_all
from agent.report.study import StudyPage, validation_in_words, write_study_page

SCHEMA = "stribeck.study/1"
_RUNS_FOR_SPEEDS = 3


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
    sweep = sweep_acceleration(rows_of(motions, cutoff_hz))
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
        sentence=_sentence(sweep),
        sweep=sweep,
        correlation=correlation,
        findings=findings,
        judged_on=", ".join(motion.signals.name for motion in judged),
        validation=conclusion.estimate.validation,
        speeds=_speeds(motions, cutoff_hz),
        instrumental=fit_instrumental(motions, cutoff_hz) if commanded else None,
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
    }
    if page.correlation is not None:
        names = ("lag_s", "auto", "auto_band", "cross_lag_s", "cross", "cross_band")
        document["residual"] |= {name: getattr(page.correlation, name).tolist() for name in names}
    if page.speeds is not None:
        document["speeds"] = {
            "speed_rad_s": page.speeds.speed_rad_s.tolist(),
            **_regressions(page.speeds),
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


def _regressions(study: AccelerationSweep | SpeedStudy) -> dict[str, Any]:
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


def _sentence(sweep: AccelerationSweep) -> str:
    """Say with which samples the regression mixes inertia and friction up least."""
    first, best = sweep.condition_number[0], sweep.best
    least = sweep.condition_number[best]
    mixed = "Inertia and friction are mixed up least"
    if not least < 0.95 * first or not np.isfinite(first):
        return f"{mixed} with every sample (condition number {first:.3g}; the lower, the better)."
    return (
        f"{mixed} where accelerations above {sweep.threshold_rad_s2[best]:.3g} rad/s² are left out "
        f"(condition number {least:.3g}; with every sample {first:.3g}; the lower, the better)."
    )
