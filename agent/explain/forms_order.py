"""What repeats with the motor's turn: ripple, the gear's wobble, the resolver's error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.form import Form, Grid, Point, stack
from agent.explain.orders import Weighting, half_a_line, strong_orders
from agent.explain.scene import Scene
from agent.identify.result import Floats

_POSITION = ("position_rad",)


def _orders(weighting: Weighting) -> Grid:
    def grid(scene: Scene) -> Sequence[Point]:
        return tuple((order,) for order in strong_orders(scene, weighting))

    return grid


def _ripple(scene: Scene, point: Point) -> Floats:
    angle = point[0] * scene.full("position_rad")
    return stack(np.cos(angle), np.sin(angle))


def _ripple_two(scene: Scene, point: Point) -> Floats:
    angle = point[0] * scene.full("position_rad")
    return stack(np.cos(angle), np.sin(angle), np.cos(2.0 * angle), np.sin(2.0 * angle))


def _ripple_two_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    order = values["order_per_motor_rev"]
    return (
        {
            "cos_nm": values["cos_nm"],
            "sin_nm": values["sin_nm"],
            "order_per_motor_rev": order,
        },
        {
            "cos_nm": values["cos_second_nm"],
            "sin_nm": values["sin_second_nm"],
            "order_per_motor_rev": 2.0 * order,
        },
    )


def _kinematic(scene: Scene, point: Point) -> Floats:
    order = point[0]
    angle = order * scene.full("position_rad")
    cos, sin = np.cos(angle), np.sin(angle)
    a, v2 = scene.full("acceleration_rad_s2"), scene.full("velocity_rad_s") ** 2
    # Second time derivatives of cos(k q) and sin(k q), along the motor's motion.
    return stack(-order * sin * a - order**2 * cos * v2, order * cos * a - order**2 * sin * v2)


def _kinematic_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Split into an error of the angle and the inertia behind it; only the product is known."""
    inertia = float(scene.theta[0])
    return (
        {
            "cos_rad": values["cos_kg_m2_rad"] / inertia,
            "sin_rad": values["sin_kg_m2_rad"] / inertia,
            "order_per_motor_rev": values["order_per_motor_rev"],
            "arm_inertia_kg_m2": inertia,
        },
    )


def _whole_orders(scene: Scene) -> Sequence[Point]:
    return tuple((o,) for o in strong_orders(scene, "inertia") if o == round(o) and o >= 1.0)


def _resolver(scene: Scene, point: Point) -> Floats:
    """Return what the twin wrongly adds for a measured angle that errs by cos or sin of k q."""
    order = point[0]
    angle = order * scene.full("position_rad")
    cos, sin = np.cos(angle), np.sin(angle)
    a, v = scene.full("acceleration_rad_s2"), scene.full("velocity_rad_s")
    inertia, viscous = float(scene.theta[0]), float(scene.theta[1])
    cos_second = -order * sin * a - order**2 * cos * v**2
    sin_second = order * cos * a - order**2 * sin * v**2
    return -stack(
        inertia * cos_second - viscous * order * sin * v,
        inertia * sin_second + viscous * order * cos * v,
    )


FORMS: tuple[Form, ...] = (
    Form(
        "torque-ripple",
        "one order",
        ("cos_nm", "sin_nm"),
        _ripple,
        ("order_per_motor_rev",),
        _orders("torque"),
        needs=_POSITION,
        step=half_a_line,
    ),
    Form(
        "torque-ripple",
        "an order and its double",
        ("cos_nm", "sin_nm", "cos_second_nm", "sin_second_nm"),
        _ripple_two,
        ("order_per_motor_rev",),
        _orders("torque"),
        needs=_POSITION,
        step=half_a_line,
        to_twin=_ripple_two_twin,
    ),
    Form(
        "kinematic-error",
        "one order",
        ("cos_kg_m2_rad", "sin_kg_m2_rad"),
        _kinematic,
        ("order_per_motor_rev",),
        _orders("inertia"),
        needs=_POSITION,
        step=half_a_line,
        to_twin=_kinematic_twin,
    ),
    Form(
        "resolver-error",
        "whole order of the motor",
        ("cos_rad", "sin_rad"),
        _resolver,
        ("order_per_motor_rev",),
        _whole_orders,
        needs=_POSITION,
        refine=False,
    ),
)
