"""Friction that falls with speed and yields before it slips: LuGre's, as textbooks have it."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.identify.result import Floats
from agent.physics.presliding import YieldingSpring
from tests.science.explain_joint import RATE_HZ, TWIN, Conditions, record, stair
from trajectories import SetPoints

CYCLE = stair((2.0, 5.0, 12.0, 30.0), 60.0)
STIFFNESS, FALL_NM, FALLS_RAD_S = 2.0, 0.5, 6.0


def bristles(points: SetPoints, at: Conditions) -> Floats:
    """Return what LuGre's friction has beyond Coulomb's."""
    del at
    velocity = points.velocity_rad_s
    time = np.arange(velocity.shape[0]) / RATE_HZ
    level = TWIN.coulomb_nm + FALL_NM * np.exp(-np.abs(velocity) / FALLS_RAD_S)
    friction = YieldingSpring(STIFFNESS).torque_nm(time, velocity, level)
    return np.asarray(friction - TWIN.coulomb_nm * np.sign(velocity))


def test_bristles_that_hold_all_of_a_friction_that_falls_are_named_with_their_stiffness() -> None:
    """A third too soft, and explained in part: what falls had hung on no spring."""
    runs = [record(CYCLE, bristles, Conditions(), seed) for seed in range(3)]
    answer = explain(TWIN, runs[:2], runs[2:])
    assert [f.effect for f in answer.findings] == ["stribeck", "presliding-hysteresis"]
    assert answer.verdict in ("explained", "tied")  # with another law that falls
    falls, yields = (f.parameters for f in answer.findings)
    assert yields["stiffness_nm_per_rad"].value == pytest.approx(STIFFNESS, rel=0.05)
    assert falls["stribeck_velocity_rad_s"].value == pytest.approx(FALLS_RAD_S, rel=0.15)
    assert answer.extended.rmse_nm < 1.2 * answer.floor.value_nm
