"""Ripple and thermal trends in recordings that others made."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from agent.identify.ripple import Ripple, find_ripple
from agent.identify.ripple_line import UNDECIDED
from agent.identify.thermal_trend import TIE, temperature_or_time
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


def test_anticogging_stills_the_motion_and_not_the_torque(real_recordings: Path) -> None:
    """The drive's compensation is part of the current; what it takes away is the stutter."""

    def stutter_rad(name: str) -> float:
        signals = load(real_recordings, f"odrive-cogging/{name}")
        assert signals.position_rad is not None
        settled = signals.time_s > 0.2 * signals.time_s[-1]
        time_s, position = signals.time_s[settled], signals.position_rad[settled]
        line = np.polyval(np.polyfit(time_s, position, 1), time_s)
        return float(np.std(position - line))

    for without, compensated in zip(WITHOUT, WITH, strict=True):
        assert stutter_rad(compensated) < stutter_rad(without) / 4.0
        before = amplitude_a(ripple(real_recordings, without), 7)[0]
        after = amplitude_a(ripple(real_recordings, compensated), 7)[0]
        assert after == pytest.approx(before, rel=0.05)


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


def test_run_in_is_a_tie_of_temperature_and_time(real_recordings: Path) -> None:
    signals = load(real_recordings, "cycloidal-run-in/baseline")
    table = pq.read_table(real_recordings / "cycloidal-run-in" / "baseline.parquet")
    temperature = table["motor_temperature_degc"].to_numpy()
    found = temperature_or_time([signals], [np.asarray(temperature, dtype=np.float64)])
    assert found.verdict == TIE
    assert "equal temperatures while heating and while cooling" in found.sentence
    assert found.r2_temperature == pytest.approx(0.88, abs=0.06)
    assert found.r2_time == pytest.approx(0.89, abs=0.06)
