"""The bound of what the arm's encoder tells: slopes that jumps of the integration do not touch."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.science.backlash_bound import arm_slopes
from tests.science.reversal_plant import ARM_COULOMB, ARM_INERTIA, gear_motion, own_swings

TWO_REVERSALS = 160_000  # steps of the integration


@pytest.mark.parametrize(("gap_rad", "stiffness"), [(0.03, 400.0), (0.0, 20.0)])
def test_an_arms_slopes_are_those_of_its_path(gap_rad: float, stiffness: float) -> None:
    motor, velocity = (x[:TWO_REVERSALS] for x in gear_motion(gap_rad, stiffness, own_swings(1)))
    gear = np.array([gap_rad, stiffness, 0.1, ARM_INERTIA, ARM_COULOMB, 0.0])
    path, slopes = arm_slopes(motor, velocity, gear)
    assert math.isclose(float(np.abs(path[:, 0]).max()), 1.0, rel_tol=0.2)
    for i in np.flatnonzero(gear):
        step = np.zeros(6)
        step[i] = 1e-3 * gear[i]
        ahead, behind = (arm_slopes(motor, velocity, gear + h)[0] for h in (step, -step))
        change = (ahead[:, 0] - behind[:, 0]) / (2.0 * step[i])
        missed = np.linalg.norm(change - slopes[:, 0, i]) / np.linalg.norm(change)
        assert missed < 0.02, f"number {i}"
