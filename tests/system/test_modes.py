"""A whole cycle in each mode of the ladder: real frames, the fake drive, the gate in between."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agent.cycle import runner
from agent.errors import RefusedError
from agent.record.reading import read
from drivers.clock import Clock
from drivers.profiles.drive_profile import shipped_profiles
from fakes.impersonation import impersonated
from fakes.specification import FakeSpecification
from tests.system.rig import rig

BITS = {"pv": 3, "csv": 9, "vl": 2, "csp": 8, "ip": 7, "pp": 1}


def offering(*words: str, absent: tuple[int, ...] = ()) -> FakeSpecification:
    """Return a joint whose drive offers these modes only."""
    plain = FakeSpecification()
    modes = sum(1 << BITS[word] - 1 for word in words)
    drive = replace(plain.drive, supported_modes=modes, absent_objects=absent)
    return replace(plain, drive=drive)


def brisk(cell: dict[str, Any]) -> None:
    """Make the stair as short as its test needs."""
    stair = cell["axis"][0]["stair"]
    stair |= {"duration_s": 6.0, "speeds": 2, "arm_from_deg": -8.0, "arm_to_deg": 8.0}
    stair |= {"motor_velocity_min_rad_s": 15.0, "motor_velocity_max_rad_s": 60.0}
    stair["motor_acceleration_rad_s2"] = 120.0  # in pp nothing rounds the corners: the arm rings
    cell["recording"]["sample_rate_hz"] = 100.0


@pytest.mark.parametrize("word", BITS)
def test_a_cycle_in_each_mode(word: str, tmp_path: Path) -> None:
    with rig(tmp_path, specification=offering(word), edit=brisk) as cell:
        result = cell.run()
        assert not cell.drive.plant.powered
    assert result.evidence.mode == word
    assert "0x6502" in result.evidence.mode_reason
    recording = read(result.recording)
    drive = recording.metadata.drive
    assert isinstance(drive, Mapping)
    assert (drive["mode"], drive["mode_reason"]) == (word, result.evidence.mode_reason)
    assert result.account.lost == 0
    velocity = np.asarray(recording.columns["velocity_rad_s"])
    asked = np.asarray(recording.columns["velocity_command_rad_s"])
    phase = np.asarray(recording.columns["phase"])
    for speed in (15.0, 60.0):
        for sign in (1.0, -1.0):
            there = (phase == "steady") & np.isclose(asked, sign * speed, rtol=1e-6)
            assert there.sum() > 20, (speed, sign)
            middle = velocity[there][there.sum() // 3 : -3]
            assert np.median(middle) == pytest.approx(sign * speed, rel=0.02), (speed, sign)
    assert np.max(np.abs(velocity)) < 66.0


def trembling(clock: Clock, tick_s: float) -> Iterator[float]:
    """Yield ticks of which every other one is late by a quarter."""
    begun_s = clock.now()
    for number in itertools.count(1):
        yield clock.now()
        clock.sleep_until(begun_s + (number + 0.25 * (number % 2)) * tick_s)


def test_positions_on_a_trembling_clock_ask_for_no_more_torque_than_velocities(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A position loop holds what a velocity loop lets go; so its set-points must be smoother."""

    def hurried(cell: dict[str, Any]) -> None:
        brisk(cell)
        cell["axis"][0]["stair"]["motor_acceleration_rad_s2"] = 300.0

    peak_nm = {}
    for word in ("pv", "csp"):
        with rig(tmp_path, specification=offering(word), edit=hurried) as cell:
            recording = read(cell.run().recording)
        peak_nm[word] = np.max(np.abs(recording.columns["torque_nm"]))
        monkeypatch.setattr(runner, "ticks", trembling)
    assert peak_nm["csp"] < 1.05 * peak_nm["pv"]


TAKEN = {
    "maxon-epos4": "pv",
    "elmo-gold": "pv",
    # No 0x6007, or no 0x1016: nothing that would go on without us.
    "nanotec-cl4-e": "pp",
    "ingenia-eve-xcr-c": "pp",
    "zeroerr-erob": "pp",
    "schunk-lwa4p": "pp",
    "pilz-prbt": "pp",
}


@pytest.mark.parametrize("name", shipped_profiles())
def test_a_cycle_on_each_drive_that_there_is_a_profile_for(name: str, tmp_path: Path) -> None:
    def of_that_kind(cell: dict[str, Any]) -> None:
        brisk(cell)
        drive = cell["axis"][0]["drive"]
        drive |= {"profile": name, "velocity_unit": "counts_per_s"}

    with rig(tmp_path, specification=impersonated(name), edit=of_that_kind) as cell:
        result = cell.run()
        assert not cell.drive.plant.powered
    assert result.evidence.mode == TAKEN[name]
    assert result.account.lost == 0
    assert ("0x6007:00" in result.evidence.settings) is (
        0x6007 not in cell.drive.specification.drive.absent_objects
    )


def test_a_streamed_mode_on_a_drive_that_does_not_miss_us_is_refused(tmp_path: Path) -> None:
    """The cell insists on ip; the drive goes on when nobody speaks, and the proof shows it."""

    def insisting(cell: dict[str, Any]) -> None:
        brisk(cell)
        drive = cell["axis"][0]["drive"]
        drive |= {"profile": "pilz-prbt", "velocity_unit": "counts_per_s", "mode": "ip"}

    with rig(tmp_path, specification=impersonated("pilz-prbt"), edit=insisting) as cell:
        with pytest.raises(RefusedError, match="watchdog does not work"):
            cell.run()
        assert not cell.drive.plant.powered


def test_a_stair_that_no_move_can_make_is_refused_before_torque(tmp_path: Path) -> None:
    def climbing(cell: dict[str, Any]) -> None:
        brisk(cell)
        cell["axis"][0]["stair"]["kind"] = "between"

    with rig(tmp_path, specification=offering("pp"), edit=climbing) as cell:
        with pytest.raises(RefusedError, match="kind 'paired'"):
            cell.run()
        assert not cell.drive.plant.powered
        assert cell.drive.motor_velocity_rad_s == 0.0
