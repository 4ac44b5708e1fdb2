"""What repeats with the motor's turn: ripple, the gear's wobble, the resolver's error."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Grid, Point, stack
from agent.explain.forms.hidden_arm import HiddenArm
from agent.explain.forms.orders import Weighting, half_a_line, strong_orders
from agent.explain.rows.scene import Scene, log_grid
from agent.identify.result import Floats

_POSITION = ("position_rad",)
_GEAR_DAMPING = 0.1  # of the arm's swing on the gear: between steel's and a harmonic drive's


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


def _wobble_grid(scene: Scene) -> Sequence[Point]:
    """Return the strong orders with springs from soft to as good as rigid in the band."""
    cutoff = scene.table.cutoff_hz
    springs = log_grid(0.4 * cutoff, 3.0 * cutoff, 5)
    return tuple((order, hz) for order in strong_orders(scene, "inertia") for hz in springs)


def _wobble(scene: Scene, point: Point) -> Floats:
    """Return what reaches the motor through the gear's spring when the ratio wobbles, (N, 2).

    The spring is driven by ``q + e(q)``: below the arm's resonance as through a stiff gear, near it
    more, above it ever less. An error of the measured angle passes no spring.
    """
    order, hertz = point
    angle = order * scene.full("position_rad")
    arm = HiddenArm(hertz, _GEAR_DAMPING)
    velocity = order * scene.full("velocity_rad_s")
    return stack(
        arm.shaft_rad_s2(scene, -velocity * np.sin(angle)),
        arm.shaft_rad_s2(scene, velocity * np.cos(angle)),
    )


def _wobble_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    """Return how far order and spring are followed: beyond, the spring is rigid in the band."""
    cutoff = scene.table.cutoff_hz
    return (0.0, math.inf), (0.2 * cutoff, 8.0 * cutoff)


def _wobble_step(scene: Scene) -> Point:
    return (*half_a_line(scene), 0.3 * scene.table.cutoff_hz)


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


def _wobble_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Return the wobble of a stiff gear, as the twin has it, that comes nearest in the band."""
    order, found = values["order_per_motor_rev"], dict(values)
    table = scene.table
    stiff = table.band(_kinematic(scene, (order,)))[table.used]
    soft = table.band(_wobble(scene, (order, values["antiresonance_hz"])))[table.used]
    torque = soft @ np.array([values["cos_kg_m2_rad"], values["sin_kg_m2_rad"]])
    found["cos_kg_m2_rad"], found["sin_kg_m2_rad"] = np.linalg.lstsq(stiff, torque)[0].tolist()
    return _kinematic_twin(scene, found)


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
        from_residual=True,
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
        from_residual=True,
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
        from_residual=True,
    ),
    Form(
        "kinematic-error",
        "one order, through the gear's spring",
        ("cos_kg_m2_rad", "sin_kg_m2_rad"),
        _wobble,
        ("order_per_motor_rev", "antiresonance_hz"),
        _wobble_grid,
        needs=_POSITION,
        step=_wobble_step,
        limits=_wobble_limits,
        to_twin=_wobble_twin,
        from_residual=True,
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
        rests_on_numbers=True,
        from_residual=True,
    ),
)
