"""A strong order's side lobes are no orders, nor is what a cable and a bump have of few waves."""

from __future__ import annotations

import numpy as np

from agent.explain.forms.orders import strong_orders
from agent.explain.rows.orders import orders_of
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
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


def test_what_few_waves_copy_repeats_nowhere() -> None:
    turns = np.random.default_rng(3).uniform(0.0, 40.0, 20000)
    angle, along = 2.0 * np.pi * turns, turns / 20.0 - 1.0
    cable = along**3 - 0.6 * along  # without the line that gravity and an offset take
    bump = np.exp(-0.5 * ((along + 0.3) / 0.05) ** 2)

    def strongest(torque_nm: Floats) -> tuple[float, ...]:
        return orders_of(angle, torque_nm, np.ones_like(angle), 8.0, 100.0, 1)

    for copied in (cable, bump, cable + bump):
        assert strongest(copied) == ()
    gear_stage = np.cos(angle / 8.0)  # five waves along the stroke
    np.testing.assert_allclose(strongest(gear_stage + 0.5 * cable), 0.125, rtol=0.02)
