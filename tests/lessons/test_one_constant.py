"""An offset, a difference of the directions and where a cable hangs free: one constant torque."""

from __future__ import annotations

import numpy as np

from agent.explain.explain import explain
from agent.identify.result import Floats
from tests.science.explain_joint import GEAR_RATIO, TWIN, Conditions, record, stair
from trajectories import SetPoints

PULL_NM_PER_RAD, FREE_RAD, VISCOUS = 0.6, 0.5, 0.004


def cable_and_asymmetry(points: SetPoints, at: Conditions) -> Floats:
    """Return the pull of a cable, and viscous friction that is more forward than backward."""
    del at
    pull = PULL_NM_PER_RAD * (points.position_rad / GEAR_RATIO - FREE_RAD)
    return np.asarray(pull + 0.5 * VISCOUS * np.abs(points.velocity_rad_s))


def test_a_cable_that_hangs_free_elsewhere_is_no_coulomb_friction_for_certain() -> None:
    """It was 23 (22 to 24) mN m more forward, and none was."""
    trajectory = stair((10.0, 20.0, 40.0, 80.0), stroke_rad=160.0, duration_s=40.0)
    runs = [record(trajectory, cable_and_asymmetry, Conditions(), seed) for seed in range(2)]
    answer = explain(TWIN, runs)
    told = {name: p for f in answer.findings for name, p in f.parameters.items()}
    stiffness = told["stiffness_nm_per_arm_rad"]
    assert stiffness.ci95 is not None
    assert stiffness.ci95[0] < PULL_NM_PER_RAD < stiffness.ci95[1]
    low, high = told["viscous_difference_nm_s_per_rad"].ci95 or (np.nan, np.nan)
    assert low < VISCOUS < high
    for name in ("coulomb_difference_nm", "torque_offset_nm", "neutral_arm_rad"):
        number = told.get(name)
        assert number is None or not number.identified
