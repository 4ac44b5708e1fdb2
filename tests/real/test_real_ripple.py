"""Ripple in recordings that others made."""

from __future__ import annotations

import functools
import re
from pathlib import Path

import pytest

from agent.identify.ripple.change import DOWN, GONE, RippleChange, compare_ripple
from agent.identify.ripple.identification import Ripple, find_ripple
from agent.identify.ripple.line import UNDECIDED
from agent.identify.ripple.sentence import motion_sentence
from tests.real.test_real_estimates import load

pytestmark = pytest.mark.real

NM_PER_A = 7.5e-3
SLOWEST = "slow2-slower-nocomp-0"
WITHOUT = ("slow2-nocomp-0", "slow2-nocomp-1", "slow2-nocomp-2", SLOWEST)
WITH = ("slow2-comp-0", "slow2-comp-1", "slow2-comp-2", "slow2-slower-comp-0")


@functools.cache
def ripple(folder: Path, name: str) -> Ripple:
    return find_ripple([load(folder, f"odrive-cogging/{name}")], highest_order=100.0)


def amplitude_a(found: Ripple, order: float) -> tuple[float, float, float]:
    line = found.at(order)
    assert line is not None, f"nothing at {order} per revolution"
    assert line.amplitude_nm.ci95 is not None
    low, high = line.amplitude_nm.ci95
    return line.amplitude_nm.value / NM_PER_A, low / NM_PER_A, high / NM_PER_A


@pytest.mark.parametrize("name", [*WITHOUT, *WITH])
@pytest.mark.parametrize("order", [7, 14, 28])
def test_cogging_is_found_at_each_known_order(real_recordings: Path, name: str, order: int) -> None:
    found = ripple(real_recordings, name)
    value, low, high = amplitude_a(found, order)
    assert low > 0.0
    assert high - low < 0.6 * value
    line = found.at(order)
    assert line is not None
    assert line.order_per_motor_rev.value == pytest.approx(order, abs=0.06)
    # One direction was driven: what it is stays open, and the line says so.
    assert line.kind == UNDECIDED
    assert "one direction" in line.reason


def test_strongest_order_is_seven(real_recordings: Path) -> None:
    found = ripple(real_recordings, SLOWEST)
    assert found.lines[0].order_per_motor_rev.value == pytest.approx(7.0, abs=0.05)


def test_slowest_pass_comes_near_the_static_maps(real_recordings: Path) -> None:
    """0.86 A at 7 and 0.35 A at 14 as in the static maps; the loop hides a part of 28."""
    found = ripple(real_recordings, SLOWEST)
    for order, static_a in ((7, 0.86), (14, 0.35)):
        assert amplitude_a(found, order)[0] == pytest.approx(static_a, rel=0.1)
    value, _, high = amplitude_a(found, 28)
    assert 0.40 < value < high < 0.57


@functools.cache
def anticogging(folder: Path) -> tuple[RippleChange, ...]:
    without, compensated = (
        [load(folder, f"odrive-cogging/{name}") for name in names] for names in (WITHOUT, WITH)
    )
    return compare_ripple(without, compensated, highest_order=60.0)


def test_both_speeds_are_compared(real_recordings: Path) -> None:
    speeds = [change.velocity_rad_s for change in anticogging(real_recordings)]
    assert speeds == pytest.approx([0.19, 0.63], rel=0.02)


@pytest.mark.parametrize(
    ("order", "most_left"), [(7, (0.23, 0.24)), (14, (0.17, 0.19)), (28, (0.07, 0.14))]
)
def test_anticogging_takes_cogging_out_of_the_motion(
    real_recordings: Path, order: int, most_left: tuple[float, float]
) -> None:
    """The position's stutter at 7, 14 and 28 falls to a fifth and less, at both speeds.

    It is not gone: what is left stands clear of the noise.
    """
    for change, most in zip(anticogging(real_recordings), most_left, strict=True):
        found = change.at(order)
        assert found is not None
        assert found.stutter_left.ci95 is not None
        assert found.stutter_left.value < most
        assert found.stutter_left.ci95[1] < 0.3
        still = found.stutter_rad[1]
        assert still.ci95 is not None
        assert still.ci95[0] > 0.0


@pytest.mark.parametrize("order", [7, 14, 28])
def test_anticogging_leaves_the_current(real_recordings: Path, order: int) -> None:
    """The compensation is part of the current: no order of it is gone, in no recording."""
    for change in anticogging(real_recordings):
        found = change.at(order)
        assert found is not None
        assert found.torque_left.value == pytest.approx(1.0, abs=0.2)


def test_order_twelve_is_gone_from_the_slowest_motion(real_recordings: Path) -> None:
    """The one order of the eight strongest that compensation takes out altogether."""
    found = anticogging(real_recordings)[0].at(12)
    assert found is not None
    assert found.stutter_rad[0].value > 4e-3
    assert found.stutter_rad[1].ci95 is not None
    assert found.stutter_rad[1].ci95[0] == 0.0
    assert found.motion == GONE


def test_the_sentence_says_what_the_motion_shows_and_no_more(real_recordings: Path) -> None:
    """At 7, 14 and 28 the stutter is down, not gone; the torque stays."""
    slow, fast = anticogging(real_recordings)
    for change in (slow, fast):
        for number in (7, 14, 28):
            order = change.at(number)
            assert order is not None
            assert order.motion == DOWN
            assert order.stutter_chance[1] < 1e-6
    told = motion_sentence(slow)
    assert re.search(r"down to 20 % \(17 to 23\) at order 7, 14 % .* at order 14, 5 % .* 28", told)
    assert "gone at order 12 (below 0.17 mrad, its noise; 4.3 mrad without)" in told
    assert "the compensation is part of it" in told
    assert "gone" not in motion_sentence(fast)


def test_screw_drive_has_one_and_two_per_turn_without_a_position(real_recordings: Path) -> None:
    found = find_ripple([load(real_recordings, "epos-screw-drives/drive1-steady")])
    assert any("no position was recorded" in note for note in found.notes)
    for order in (1.0, 2.0):
        line = found.at(order)
        assert line is not None
        assert 0.14e-3 <= line.amplitude_nm.value <= 0.38e-3
        assert line.kind == UNDECIDED
    assert {round(line.order_per_motor_rev.value) for line in found.lines[:2]} == {1, 2}


def test_anti_backlash_screw_has_one_per_turn(real_recordings: Path) -> None:
    found = find_ripple([load(real_recordings, "epos-screw-drives/drive2-steady")])
    assert found.lines[0].order_per_motor_rev.value == pytest.approx(1.0, abs=0.01)
    assert 0.44e-3 <= found.lines[0].amplitude_nm.value <= 1.16e-3


def test_production_log_has_no_slow_pass(real_recordings: Path) -> None:
    found = find_ripple([load(real_recordings, "ur3-production/joint1")])
    assert not found.decidable
    assert found.reasons[0].startswith("not identified")
    assert not found.lines
