"""Torque that pulsates with the motor's turn: by itself, or the more the harder the motor pulls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, Proportional
from agent.explain.forms.mixed import Mixed, Part
from agent.explain.forms.orders import ORDER, few_waves, half_a_line, order_limits, strong_orders
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_POSITION = ("position_rad",)
_GROWN, _MOST_GROWN = (0.7, 5.0), 100.0  # times a ripple's own, what the usual torque adds to it


def _orders(scene: Scene) -> Sequence[Point]:
    return tuple((order,) for order in strong_orders(scene, "torque"))


def _few_waves(scene: Scene) -> Sequence[Point]:
    return tuple((order,) for order in few_waves(scene))


def _ripple(scene: Scene, point: Point) -> Floats:
    return scene.wave(point[0])


def _ripple_on_load(scene: Scene, point: Point) -> Floats:
    """Return a ripple in proportion to the size of the torque, (N, 2)."""
    return scene.wave(point[0]) * np.abs(scene.own_nm)[:, np.newaxis]


def _ripple_share(scene: Scene, point: Point) -> Floats:
    """Return a ripple in proportion to the torque, (N, 2)."""
    return scene.wave(point[0]) * scene.own_nm[:, np.newaxis]


def _of_order_and_double(point: Point) -> Sequence[Part]:
    return ((_ripple, point), (_ripple, (2.0 * point[0],)))


def _of_ripple_and_share(point: Point) -> Sequence[Part]:
    return ((_ripple, point), (_ripple_share, point))


def _of_ripple_on_load(point: Point) -> Sequence[Part]:
    return ((_ripple, point[:1]), (_ripple_on_load, point[:1]))


def _side_by_side(scene: Scene, point: Point) -> Floats:
    """Return how columns are made of themselves, shape (4, 4)."""
    del scene, point
    return np.eye(4)


def _growing_mix(scene: Scene, point: Point) -> Floats:
    """Return how a ripple that grows with the size of the torque is made, shape (4, 2)."""
    del scene
    return np.concatenate((np.eye(2), point[1] * np.eye(2)))


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


def _growing_orders(scene: Scene) -> Sequence[Point]:
    usual = _usual_nm(scene)
    return tuple((*order, times / usual) for order in _orders(scene) for times in _GROWN)


def _growing_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    return (*order_limits(scene), (0.0, _MOST_GROWN / _usual_nm(scene)))


def _growing_step(scene: Scene) -> Point:
    return (*half_a_line(scene), Proportional(0.5))


def _usual_nm(scene: Scene) -> float:
    return max(float(np.sqrt(np.mean(scene.own_nm**2))), 1e-300)


FORMS: tuple[Form, ...] = (
    Form(
        "torque-ripple",
        "one order",
        ("cos_nm", "sin_nm"),
        _ripple,
        ("order_per_motor_rev",),
        _orders,
        needs=_POSITION,
        step=half_a_line,
        limits=order_limits,
        from_residual=True,
    ),
    Form(
        "torque-ripple",
        "a whole order of few waves",
        ("cos_nm", "sin_nm"),
        _ripple,
        (ORDER,),
        _few_waves,
        needs=_POSITION,
        refine=False,
        from_residual=True,
    ),
    Form(
        "torque-ripple",
        "an order and its double",
        ("cos_nm", "sin_nm", "cos_second_nm", "sin_second_nm"),
        Mixed(_of_order_and_double, _side_by_side),
        ("order_per_motor_rev",),
        _orders,
        needs=_POSITION,
        step=half_a_line,
        limits=order_limits,
        to_twin=_ripple_two_twin,
        refines=("one order",),
        from_residual=True,
    ),
    Form(
        "torque-ripple",
        "one order that grows with the torque",
        ("cos_nm", "sin_nm"),
        Mixed(_of_ripple_on_load, _growing_mix),
        (ORDER, "load_growth_per_nm"),
        _growing_orders,
        needs=_POSITION,
        step=_growing_step,
        limits=_growing_limits,
        refines=("one order",),
        rests_on_numbers=True,
        from_residual=True,
    ),
    Form(
        "torque-ripple",
        "one order, in part in proportion to the torque",
        ("cos_nm", "sin_nm", "cos_share", "sin_share"),
        Mixed(_of_ripple_and_share, _side_by_side),
        (ORDER,),
        _orders,
        needs=_POSITION,
        step=half_a_line,
        limits=order_limits,
        refines=("one order",),
        rests_on_numbers=True,
        from_residual=True,
    ),
)
