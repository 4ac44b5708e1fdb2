"""The gear's clearance at reversals, with the arm's encoder and without, beside what mimics it."""

from __future__ import annotations

import pytest

from agent.identify.reversals.arm import arm_clearance
from agent.identify.reversals.identification import identify_reversals
from agent.identify.reversals.laws import range_of
from agent.identify.reversals.result import Clearance
from agent.identify.reversals.turns import read_tracks
from tests.science.reversal_plant import ARM_COULOMB, VISCOUS, geared, sampled

GAP, TEETH = 0.03, 400.0
SKEW = 0.002


def by_arm(gap_rad: float, stiffness: float, seed: int, late_s: float = SKEW) -> Clearance:
    signals = sampled(geared(gap_rad, stiffness), seed, with_arm=True, arm_late_s=late_s)
    motion = read_tracks([signals])
    found = arm_clearance(motion, range_of(motion), VISCOUS)
    assert found is not None
    return found


def lost_motion(gap_rad: float, stiffness: float) -> float:
    return gap_rad + 2.0 * ARM_COULOMB / stiffness


@pytest.mark.parametrize(
    ("gap_rad", "stiffness", "late_s"), [(GAP, TEETH, 0.0), (GAP, TEETH, SKEW), (GAP, 30.0, SKEW)]
)
def test_gap_wind_up_and_skew_are_told_apart_by_the_arms_encoder(
    gap_rad: float, stiffness: float, late_s: float
) -> None:
    for seed in range(3):
        found = by_arm(gap_rad, stiffness, seed, late_s)
        for parameter, truth in (
            (found.lost_motion_rad, lost_motion(gap_rad, stiffness)),
            (found.backlash_rad, gap_rad),
            (found.encoder_skew_s, late_s),
        ):
            assert parameter.ci95 is not None, parameter.reason
            low, high = parameter.ci95
            # Nine numbers: half as much again, so that chance does not fail the test.
            spare = 0.25 * (high - low)
            assert low - spare <= truth <= high + spare, (low, truth, high)
        # A compliance that the gap hides is not guessed at.
        compliance = found.compliance_rad_per_nm
        assert (compliance.ci95 is None) == (stiffness == TEETH)
        if compliance.ci95 is not None:
            assert compliance.ci95[0] <= 1.0 / stiffness <= compliance.ci95[1]
        low, high = found.backlash_rad.ci95 or (0.0, 1.0)
        assert high - low < 0.2 * gap_rad
        # While the motor crosses the gap the arm stands, and its encoder's lateness is none; an arm
        # that still rings winds up the gear by its own acceleration: 2 % and 1 % without that.
        assert found.backlash_rad.value == pytest.approx(gap_rad, rel=0.012)
        assert found.lost_motion_rad.value == pytest.approx(
            lost_motion(gap_rad, stiffness), rel=0.002
        )


def test_a_soft_gear_without_a_gap_is_not_given_one() -> None:
    for seed in range(3):
        found = by_arm(0.0, 20.0, seed)
        assert not found.backlash_rad.identified
        assert "as a spring's does" in found.backlash_rad.reason
        compliance = found.compliance_rad_per_nm
        assert compliance.ci95 is not None
        assert compliance.ci95[0] <= 1.0 / 20.0 <= compliance.ci95[1]


def test_from_the_motors_side_a_gap_is_found_where_it_stands_out() -> None:
    found = identify_reversals([sampled(geared(GAP, TEETH), 1, sample_s=2e-3)])
    assert found.selected is not None
    assert found.selected.law == "backlash"
    gap = found.clearance.backlash_rad
    assert found.clearance.source == "motor-side"
    assert gap.ci95 is not None
    assert gap.ci95[0] <= GAP <= gap.ci95[1]
    assert gap.ci95[1] - gap.ci95[0] < 0.2 * GAP


def test_from_the_motors_side_a_soft_gear_is_not_called_a_gap() -> None:
    found = identify_reversals([sampled(geared(0.0, 20.0), 2, sample_s=2e-3)])
    assert found.selected is not None
    assert found.selected.law == "wind-up"
    gap = found.clearance.backlash_rad
    assert not gap.identified
    assert "record the arm's position" in gap.reason
