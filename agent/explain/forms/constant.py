"""What becomes of a motor's torque constant: warm magnets, and iron that saturates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, stack
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_EFFECT, _MOTOR_T = "torque-constant-error", "motor_temperature_degc"
WARM, SATURATES = "with motor temperature", "less as the torque grows"
_STEEPEST_PER_K = 0.01  # five times a ferrite magnet's 0.2 %: steeper is no torque constant
_LOST = "lost_per_nm2"
_NEARLY_ALL = 0.99  # of the samples: a spike of noise is no torque
_TENTH, _MOST_LOST = 0.1, 0.3  # of a torque: with more a larger current gives less of it


def _warm(scene: Scene, point: Point) -> Floats:
    del point
    warmer = scene.full(_MOTOR_T) - scene.mean(_MOTOR_T)
    return stack(-scene.full("torque_nm") * warmer)


def _warm_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    return (
        {
            "factor": 1.0,
            "factor_per_k": values["factor_per_k"],
            "reference_degc": scene.mean(_MOTOR_T),
        },
    )


def _saturated(scene: Scene, point: Point) -> Floats:
    """Return what is reported beyond what the motor gives: the cube of what is reported, (N, 1)."""
    del point
    return stack(scene.full("torque_nm") ** 3)


def _within_what_it_gives(scene: Scene, point: Point, coefficients: Floats) -> bool:
    """Return whether a larger current still gives more torque, as far as was driven."""
    del point
    largest = float(np.nanquantile(np.abs(scene.full("torque_nm")), _NEARLY_ALL))
    return float(coefficients[0]) * largest**2 < _MOST_LOST


def _saturated_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    if not values[_LOST] > 0.0:
        return ()
    return ({"tenth_less_nm": math.sqrt(_TENTH / values[_LOST])},)


FORMS: tuple[Form, ...] = (
    Form(
        _EFFECT,
        WARM,
        ("factor_per_k",),
        _warm,
        highest=(_STEEPEST_PER_K,),
        needs=(_MOTOR_T,),
        to_twin=_warm_twin,
    ),
    Form(
        _EFFECT,
        SATURATES,
        (_LOST,),
        _saturated,
        signs=(1,),
        borne=_within_what_it_gives,
        to_twin=_saturated_twin,
        catch_all=True,  # of whatever grows with the torque, as friction under load does
    ),
)
