"""What changes with temperature: viscosity and the dry level."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, stack
from agent.explain.forms.grid import log_grid
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.friction_oil import TemperatureCoulomb, thinning_share

_GEAR_T = "gearbox_temperature_degc"
_THINS_FASTEST_K = 10.0  # as VG 150 does at 0 degC (ASTM D341); friction thins more slowly than oil
_USUALLY_K = (
    25.0  # VG 100 to 220 thin by e in 14 to 25 at 20 to 60 degC (D341), friction more slowly
)
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
)
