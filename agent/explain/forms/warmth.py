"""What changes with temperature and time: viscosity, the dry level, the torque constant."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, stack
from agent.explain.rows.scene import Scene, log_grid
from agent.identify.result import Floats
from agent.physics.friction_drift import LevelStep, LinearDrift, coming_share
from agent.physics.friction_oil import TemperatureCoulomb, thinning_share

_HOUR_S = 3600.0
_GEAR_T, _MOTOR_T = "gearbox_temperature_degc", "motor_temperature_degc"
_THINS_FASTEST_K = 10.0  # as VG 150 does at 0 degC (ASTM D341); friction thins more slowly than oil
_USUALLY_K = (
    25.0  # VG 100 to 220 thin by e in 14 to 25 at 20 to 60 degC (D341), friction more slowly
)
_STEEPEST_PER_K = 0.01  # five times a ferrite magnet's 0.2 %: steeper is no torque constant
_CHANGED = "changed_at_elapsed_s"
_COULOMB_K, _VISCOUS_T = "coulomb_nm_per_k", "viscous_thermal_nm_s_per_rad"


def _warmer(scene: Scene, decay_k: float) -> Floats:
    temperature = scene.full("gearbox_temperature_degc")
    reference = scene.mean("gearbox_temperature_degc")
    return thinning_share(temperature, reference, decay_k) - 1.0


def _viscosity(scene: Scene, point: Point) -> Floats:
    return stack(scene.full("velocity_rad_s") * _warmer(scene, point[0]))


def _viscosity_grid(scene: Scene) -> Sequence[Point]:
    lower, upper = scene.span("gearbox_temperature_degc")
    span = max(upper - lower, 1.0)
    return tuple(
        (k,) for k in log_grid(max(_THINS_FASTEST_K, 0.2 * span), max(150.0, 5.0 * span), 8)
    )


def _viscosity_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    """Return by how much warmer oil may be that is thinner by a factor of e."""
    del scene
    return ((_THINS_FASTEST_K, math.inf),)


def _viscosity_and_coulomb(scene: Scene, point: Point) -> Floats:
    return np.concatenate((_viscosity(scene, point), _coulomb_warm(scene, point)), axis=1)


def _coulomb_warm(scene: Scene, point: Point) -> Floats:
    del point
    law = TemperatureCoulomb(1.0, scene.mean("gearbox_temperature_degc"))
    return stack(law.torque_nm(scene.direction, scene.full("gearbox_temperature_degc")))


def _viscosity_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    return ({**values, "reference_degc": scene.mean("gearbox_temperature_degc")},)


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
    names = [name for _, name in _begins(scene)]
    after = [at for at, _ in _begins(scene)].index(point[0])
    return names[after - 1], names[after]


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


def _constant_warm(scene: Scene, point: Point) -> Floats:
    del point
    temperature = scene.full("motor_temperature_degc")
    warmer = temperature - scene.mean("motor_temperature_degc")
    return stack(-scene.full("torque_nm") * warmer)


def _constant_warm_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    return (
        {
            "factor": 1.0,
            "factor_per_k": values["factor_per_k"],
            "reference_degc": scene.mean("motor_temperature_degc"),
        },
    )


FORMS: tuple[Form, ...] = (
    Form(
        "temperature-dependent-friction",
        "viscosity",
        (_VISCOUS_T,),
        _viscosity,
        ("decay_k",),
        _viscosity_grid,
        (1,),
        needs=(_GEAR_T,),
        limits=_viscosity_limits,
        to_twin=_viscosity_twin,
        typical=(_USUALLY_K,),
    ),
    Form(
        "temperature-dependent-friction",
        "viscosity and Coulomb level",
        (_VISCOUS_T, _COULOMB_K),
        _viscosity_and_coulomb,
        ("decay_k",),
        _viscosity_grid,
        (1, 0),
        needs=(_GEAR_T,),
        limits=_viscosity_limits,
        to_twin=_viscosity_twin,
        typical=(_USUALLY_K,),
    ),
    Form(
        "temperature-dependent-friction",
        "Coulomb level",
        (_COULOMB_K,),
        _coulomb_warm,
        needs=(_GEAR_T,),
        to_twin=_viscosity_twin,
    ),
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
    Form(
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
    ),
    Form(
        "friction-drift",
        "Coulomb and viscous, others from one recording on",
        ("coulomb_step_nm", "viscous_step_nm_s_per_rad"),
        _step_both,
        (_CHANGED,),
        _changes,
        needs=("elapsed_s",),
        refine=False,
        to_twin=_step_twin,
        catch_all=True,
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
    Form(
        "torque-constant-error",
        "with motor temperature",
        ("factor_per_k",),
        _constant_warm,
        highest=(_STEEPEST_PER_K,),
        needs=(_MOTOR_T,),
        to_twin=_constant_warm_twin,
    ),
)
