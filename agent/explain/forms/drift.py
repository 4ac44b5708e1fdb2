"""Friction that changes by the clock: steadily, as it runs in, or between two recordings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, stack
from agent.explain.forms.grid import log_grid
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.friction_drift import LevelStep, LinearDrift, coming_share

_HOUR_S = 3600.0
_CHANGED = "changed_at_elapsed_s"


def _evenly(scene: Scene, law: LinearDrift) -> Floats:
    hours = (scene.full("elapsed_s") - scene.mean("elapsed_s")) / _HOUR_S
    return law.torque_nm(scene.full("velocity_rad_s"), scene.direction, hours)


def _drift_coulomb(scene: Scene, point: Point) -> Floats:
    del point
    return stack(_evenly(scene, LinearDrift(coulomb_nm_per_step=1.0)))


def _drift_both(scene: Scene, point: Point) -> Floats:
    slope = stack(_evenly(scene, LinearDrift(viscous_nm_s_per_rad_per_step=1.0)))
    return np.concatenate((_drift_coulomb(scene, point), slope), axis=1)


def _run_in(scene: Scene, point: Point) -> Floats:
    elapsed = scene.full("elapsed_s")
    return stack(scene.direction * coming_share(elapsed - np.nanmin(elapsed), point[0]))


def _dated(scene: Scene) -> bool:
    """Return whether a drift can be told to a twin, which counts from a date."""
    return all(math.isfinite(run.started_s) for run in scene.table.runs)


def _instant(scene: Scene, elapsed_s: float) -> str:
    """Return an instant of the table's own clock as a date and time, UTC."""
    started = min(run.started_s for run in scene.table.runs)
    return datetime.fromtimestamp(started + elapsed_s, tz=UTC).isoformat()


def _drift_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    if not _dated(scene):
        return ()
    return ({**values, "reference_started_at": _instant(scene, scene.mean("elapsed_s"))},)


def _run_in_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Return the change since the first sample; what was there then belongs to the base."""
    if not _dated(scene):
        return ()
    first = float(np.nanmin(scene.full("elapsed_s")))
    return (
        {
            "coulomb_change_nm": -values["run_in_nm"],
            "settling_h": values["run_in_s"] / _HOUR_S,
            "reference_started_at": _instant(scene, first),
        },
    )


def _changes(scene: Scene) -> Sequence[Point]:
    """Return when every recording after the first began, s of the table's clock.

    Of two recordings a change and a steady drift are the same.
    """
    begins = _begins(scene)
    return tuple((at,) for at, _ in begins[1:]) if len(begins) > 2 else ()


def changed_between(scene: Scene, form: Form, point: Point) -> tuple[str, str] | None:
    """Return the names of the recordings between which levels changed; None for another law."""
    if form.nonlinear != (_CHANGED,):
        return None
    begins = _begins(scene)
    after = min(range(1, len(begins)), key=lambda k: abs(begins[k][0] - point[0]))
    return begins[after - 1][1], begins[after][1]


def _begins(scene: Scene) -> list[tuple[float, str]]:
    """Return when recordings began, s of the table's clock, and what they are called, in order."""
    elapsed, run = scene.full("elapsed_s"), scene.full("run")
    return sorted(
        (float(np.min(elapsed[run == own])), scene.table.runs[int(own)].name)
        for own in np.unique(run)
    )


def _step_coulomb(scene: Scene, point: Point) -> Floats:
    return stack(_stepped(scene, point, LevelStep(coulomb_step_nm=1.0)))


def _step_both(scene: Scene, point: Point) -> Floats:
    slope = stack(_stepped(scene, point, LevelStep(viscous_step_nm_s_per_rad=1.0)))
    return np.concatenate((_step_coulomb(scene, point), slope), axis=1)


def _stepped(scene: Scene, point: Point, law: LevelStep) -> Floats:
    since_s = scene.full("elapsed_s") - point[0]
    return law.torque_nm(scene.full("velocity_rad_s"), scene.direction, since_s)


def _step_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    if not _dated(scene):
        return ()
    steps = {name: value for name, value in values.items() if name != _CHANGED}
    return ({**steps, "changed_at": _instant(scene, values[_CHANGED])},)


def _run_in_grid(scene: Scene) -> Sequence[Point]:
    lower, upper = scene.span("elapsed_s")
    return tuple((t,) for t in log_grid(0.1 * (upper - lower), 1.0 * (upper - lower), 4))


_STEP = Form(
    "friction-drift",
    "Coulomb level, another from one recording on",
    ("coulomb_step_nm",),
    _step_coulomb,
    (_CHANGED,),
    _changes,
    needs=("elapsed_s",),
    refine=False,
    to_twin=_step_twin,
    catch_all=True,
)
FORMS: tuple[Form, ...] = (
    Form(
        "friction-drift",
        "Coulomb level, steady",
        ("coulomb_nm_per_h",),
        _drift_coulomb,
        needs=("elapsed_s",),
        to_twin=_drift_twin,
        catch_all=True,
    ),
    Form(
        "friction-drift",
        "Coulomb and viscous, steady",
        ("coulomb_nm_per_h", "viscous_nm_s_per_rad_per_h"),
        _drift_both,
        needs=("elapsed_s",),
        to_twin=_drift_twin,
        catch_all=True,
    ),
    _STEP,
    replace(
        _STEP,
        name="Coulomb and viscous, others from one recording on",
        linear=("coulomb_step_nm", "viscous_step_nm_s_per_rad"),
        columns=_step_both,
    ),
    Form(
        "friction-drift",
        "run-in",
        ("run_in_nm",),
        _run_in,
        ("run_in_s",),
        _run_in_grid,
        needs=("elapsed_s",),
        to_twin=_run_in_twin,
        catch_all=True,
    ),
)
