"""Torque that pulsates with the motor's turn: by itself, or the more the harder the motor pulls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, Proportional
from agent.explain.forms.orders import ORDER, half_a_line, order_limits, strong_orders
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_POSITION = ("position_rad",)
_GROWN, _MOST_GROWN = (0.7, 5.0), 100.0  # times a ripple's own, what the usual torque adds to it


def _orders(scene: Scene) -> Sequence[Point]:
    return tuple((order,) for order in strong_orders(scene, "torque"))


def _ripple(scene: Scene, point: Point) -> Floats:
    return scene.wave(point[0])


def _ripple_two(scene: Scene, point: Point) -> Floats:
    return np.concatenate((scene.wave(point[0]), scene.wave(2.0 * point[0])), axis=1)


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


def _ripple_and_share(scene: Scene, point: Point) -> Floats:
    """Return a ripple, and what of it is in proportion to the torque, (N, 4)."""
    waves = scene.wave(point[0])
    return np.concatenate((waves, waves * scene.predicted_nm[:, np.newaxis]), axis=1)


def _growing_ripple(scene: Scene, point: Point) -> Floats:
    """Return a ripple that grows with the size of the torque, (N, 2)."""
    order, growth = point
    return scene.wave(order) * (1.0 + growth * np.abs(scene.predicted_nm))[:, np.newaxis]


def _growing_orders(scene: Scene) -> Sequence[Point]:
    usual = _usual_nm(scene)
    return tuple((*order, times / usual) for order in _orders(scene) for times in _GROWN)


def _growing_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    return (*order_limits(scene), (0.0, _MOST_GROWN / _usual_nm(scene)))


def _growing_step(scene: Scene) -> Point:
    return (*half_a_line(scene), Proportional(0.5))


def _usual_nm(scene: Scene) -> float:
    return max(float(np.sqrt(np.mean(scene.predicted_nm**2))), 1e-300)


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
        "an order and its double",
        ("cos_nm", "sin_nm", "cos_second_nm", "sin_second_nm"),
        _ripple_two,
        ("order_per_motor_rev",),
        _orders,
        needs=_POSITION,
        step=half_a_line,
        limits=order_limits,
        to_twin=_ripple_two_twin,
        from_residual=True,
    ),
    Form(
        "torque-ripple",
        "one order that grows with the torque",
        ("cos_nm", "sin_nm"),
        _growing_ripple,
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
        _ripple_and_share,
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
