"""A strong order's side lobes are higher than a weak order's peak, and yet no orders."""

from __future__ import annotations

import numpy as np

from agent.explain.forms.orders import strong_orders
from agent.explain.rows.scene import Scene, refit
from agent.explain.rows.table import BASE, tabulate
from agent.identify.result import Floats
from tests.science.explain_joint import TWIN, Conditions, record, stair
from trajectories import SetPoints


def waves(points: SetPoints, at: Conditions) -> Floats:
    del at
    angle = points.position_rad
    return np.asarray(0.3 * np.sin(3.0 * angle) + 0.008 * np.sin(5.0 * angle))


def test_a_weak_order_comes_second_beside_a_strong_one() -> None:
    table = tabulate(TWIN, [record(stair([6.0, 10.0, 16.0]), waves, Conditions(), 1)])
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0))
    assert strong_orders(scene, "torque")[:2] == (3.0, 5.0)
