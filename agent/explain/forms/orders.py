"""Which orders per revolution stand out in a residual: a scan over the motor's angle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from agent.explain.rows.lines import of_speed
from agent.explain.rows.orders import FEWEST_WAVES, order_of_few_waves, orders_of
from agent.explain.rows.scene import Scene

ORDER = "order_per_motor_rev"
Weighting = Literal["torque", "friction", "inertia", "load"]
_PEAKS = 5
_OF_BAND = 0.9  # of the cutoff: what passes that fast at the slowest speed still shows


def strong_orders(scene: Scene, weighting: Weighting) -> tuple[float, ...]:
    """Return the orders per motor turn at which the residual has most energy, strongest first.

    Parameters
    ----------
    scene : Scene
    weighting : {"torque", "friction", "inertia", "load"}
        Whether the wave keeps its sign (ripple), follows the velocity's sign (friction), or grows
        with the square of the speed or with the arm's weight (kinematic error).
    """
    table = scene.table
    if not scene.has("position_rad"):
        return ()
    rows = table.sliding
    position = table.rows["position_rad"][rows]
    velocity = table.rows["velocity_rad_s"][rows]
    residual = scene.residual_nm[rows]
    weight = {
        "torque": np.ones_like(velocity),
        "friction": np.sign(velocity),
        "inertia": (velocity / scene.fastest) ** 2,
        "load": scene.weight_rows()[rows],
    }[weighting]
    if not weight.any():
        return ()  # an arm without weight bears none
    highest = highest_order(scene)
    repeating = weighting != "friction"  # along the path friction varies as it likes
    return orders_of(
        position, residual, weight, highest, table.gear_ratio, _PEAKS, repeating=repeating
    )


def few_waves(scene: Scene) -> tuple[float, ...]:
    """Return the whole order of few waves along the stroke that carries most of the residual.

    Beside what varies with the speed, as friction that a twin lacks.
    """
    table = scene.table
    if not scene.has("position_rad"):
        return ()
    rows = table.sliding
    residual = scene.residual_nm - of_speed(table, scene.residual_nm)
    position = table.rows["position_rad"][rows]
    order = order_of_few_waves(position, residual[rows], highest_order(scene))
    return () if order is None else (order,)


def highest_order(scene: Scene) -> float:
    """Return the highest order per motor turn that the band shows at the slowest speed."""
    return _OF_BAND * scene.table.cutoff_hz * 2.0 * math.pi / scene.slowest


def least_order(scene: Scene) -> float:
    """Return the order per motor turn of the fewest waves along the stroke that are no trend."""
    return FEWEST_WAVES * 2.0 * half_a_line(scene)[0]


def half_a_line(scene: Scene) -> tuple[float]:
    """Return half the width of an order's line over the stroke, per motor turn."""
    lower, upper = scene.span("position_rad")
    return (0.5 * 2.0 * math.pi / max(upper - lower, 1e-9),)


def order_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    """Return between which orders a wave is looked for."""
    return ((least_order(scene), math.inf),)
