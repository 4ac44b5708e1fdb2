"""A gap that is the same all the way round, and whose contact is a spring and a plain damper."""

from __future__ import annotations

import pytest

from agent.explain.findings import findings_of
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.physics.twin import Twin
from tests.science.explain_plant import GEAR, Joint, record, waves

TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)
PLAIN = Joint(
    half_gap=0.05,
    stiffness=90.0,
    damping=0.15,
    parting=1.0,
    arm_coulomb=0.02,
    motor_coulomb=0.48,
)


def test_a_contact_is_told_once_one_gap_is_followed_at_the_joints_own_numbers() -> None:
    """As the mean of gaps that differ by 7 % its spring was 22 % too soft, damped 30 % too much."""
    runs = [record(PLAIN, seed, command=waves(seed, 30.0)) for seed in (1, 2)]
    (found,) = findings_of(study(TWIN, tabulate(TWIN, runs)))
    assert found.effect == "backlash"
    damping = found.parameters["damping_nm_s_per_rad"].ci95
    stiffness = found.parameters["stiffness_nm_per_rad"].ci95
    assert damping is not None
    assert stiffness is not None
    assert damping[0] < 0.15 < damping[1]
    assert stiffness[0] < 90.0 < stiffness[1]
    numbers = {name: number.value for name, number in found.parameters.items()}
    assert numbers["half_gap_rad"] == pytest.approx(0.05, rel=0.02)
    assert numbers["half_gap_spread"] == pytest.approx(0.01)
    assert numbers["stiffness_nm_per_rad"] == pytest.approx(90.0, rel=0.1)
    assert numbers["damping_nm_s_per_rad"] == pytest.approx(0.15, rel=0.15)
    assert numbers["arm_inertia_kg_m2"] == pytest.approx(0.003, rel=0.02)
