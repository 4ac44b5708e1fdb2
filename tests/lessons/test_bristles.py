"""Bristles that are damped (LuGre): without their damping they are a stiffer spring."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.identify.result import Floats
from agent.physics.presliding import YieldingSpring
from tests.science.explain_joint import RATE_HZ, TWIN, Conditions, record, stair
from trajectories import SetPoints

BRISTLES = YieldingSpring(stiffness_nm_per_rad=1.0, damping_nm_s_per_rad=0.04)


def bristles(points: SetPoints, at: Conditions) -> Floats:
    """Return what bristles have more of friction than Coulomb's law."""
    del at
    speed = points.velocity_rad_s
    time, level = np.arange(speed.shape[0]) / RATE_HZ, np.full_like(speed, TWIN.coulomb_nm)
    friction = BRISTLES.torque_nm(time, speed, level)
    return np.asarray(friction - TWIN.coulomb_nm * np.sign(speed))


def test_damped_bristles_have_the_stiffness_and_the_damping_that_they_have() -> None:
    """It came out a seventh to a third too stiff, with an interval beside the truth."""
    trajectory = stair((2.0, 5.0, 10.0, 20.0), stroke_rad=40.0, duration_s=60.0)
    runs = [record(trajectory, bristles, Conditions(), seed) for seed in range(2)]
    (found,) = explain(TWIN, runs).findings
    assert found.effect == "presliding-hysteresis"
    for name in ("stiffness_nm_per_rad", "damping_nm_s_per_rad"):
        told, true = found.parameters[name], getattr(BRISTLES, name)
        assert told.value == pytest.approx(true, rel=0.05)
        low, high = told.ci95 or (np.nan, np.nan)
        assert low < true < high
