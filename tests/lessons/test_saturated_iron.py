"""A motor whose iron saturates gives less torque than its current stands for, the more it gives."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.identify.result import Floats
from agent.physics.reported import TorqueConstant
from tests.science.explain_joint import TWIN, Conditions, record
from trajectories import SetPoints, stair_paired

TENTH_LESS_NM = 3.0
SMOOTH = stair_paired(
    -100.0,
    100.0,
    speeds_rad_s=(10.0, 30.0, 60.0, 120.0),
    duration_s=60.0,
    acceleration_rad_s2=100.0,
    jerk_rad_s3=1000.0,
    dwell_min_s=0.1,
)


def saturated(points: SetPoints, at: Conditions) -> Floats:
    """Return by how much more is reported than the motor gives."""
    del at
    given = (
        TWIN.inertia_kg_m2 * points.acceleration_rad_s2
        + TWIN.viscous_nm_s_per_rad * points.velocity_rad_s
        + TWIN.coulomb_nm * np.sign(points.velocity_rad_s)
    )
    reported = given.copy()
    for _ in range(60):  # Newton's: what is reported and given are nearly the same
        lost = reported * (reported / TENTH_LESS_NM) ** 2 / 10.0
        slope = 1.0 - 0.3 * (reported / TENTH_LESS_NM) ** 2
        reported -= (reported - lost - given) / slope
    return np.asarray(reported - given)


def test_a_constant_that_falls_with_the_torque_is_no_friction_under_load() -> None:
    """It was friction under load, a tight spot and a bump, at 25 mN m where noise was 2."""
    runs = [record(SMOOTH, saturated, Conditions(), seed) for seed in range(3)]
    answer = explain(TWIN, runs[:2], runs[2:])
    assert answer.verdict == "explained"
    (found,) = answer.findings
    assert found.effect == "torque-constant-error"
    assert "the drive reports up to" in found.said.lead
    assert "more torque than the simulation" in found.said.lead
    told = found.parameters["tenth_less_nm"]
    assert told.value == pytest.approx(TENTH_LESS_NM, rel=0.03)
    low, high = told.ci95 or (np.nan, np.nan)
    assert low < TENTH_LESS_NM < high
    assert answer.twin is not None
    assert explain(answer.twin, runs[:2], runs[2:]).verdict == "no-mismatch"


def test_what_is_reported_is_the_root_that_begins_at_none() -> None:
    reported = np.linspace(-1.8, 1.8, 37)
    given = reported - 0.1 * reported**3
    constant = TorqueConstant(factor=0.9, tenth_less_nm=2.0)
    assert constant.reported_nm(2.0 * 0.9 * given, None) == pytest.approx(2.0 * reported)
    assert constant.reported_nm(np.array([99.0]), None)[0] == pytest.approx(2.0 * np.sqrt(10 / 3))
