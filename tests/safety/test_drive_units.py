"""A drive that counts in other units than when its axis was last driven moves nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from agent.cell.cell import parse_cell
from agent.errors import InputError
from agent.record.reading import read
from drivers.errors import ConfigurationError
from tests.faults.aftermath import registers
from tests.system.rig import Rig, rig

GEAR_RATIO = 0x6091


def brisk(cell: dict[str, Any]) -> None:
    """Make the cycle as short as its test needs."""
    cell["axis"][0]["stair"] |= {"duration_s": 3.2, "speeds": 2}
    cell["recording"]["sample_rate_hz"] = 100.0


def set_up_anew(bench: Rig, motor_revolutions: int) -> None:
    """Do what a set-up tool does between two cycles."""
    od = bench.drive.dictionary
    od.write_number(od.entry(GEAR_RATIO, 1), motor_revolutions)


def test_other_units_than_last_time_are_refused_until_the_cell_says_so_too(tmp_path: Path) -> None:
    with rig(tmp_path, edit=brisk) as bench:
        first = bench.run()
        assert first.evidence.units["0x6091:01"] == 1
        kept = (tmp_path / ".simulated-joint-axis1.units.json").read_text()
        set_up_anew(bench, 8)
        found, stands_rad = registers(bench), bench.drive.motor_position_rad
        for _ in range(2):  # a refused cycle is no drive that was looked at
            with pytest.raises(
                ConfigurationError,
                match=r"gear ratio, motor revolutions \(0x6091:01\) reads 8, it was 1",
            ) as caught:
                bench.run()
            assert ".simulated-joint-axis1.units.json" in caught.value.do
        assert bench.drive.motor_position_rad == stands_rad
        assert registers(bench) == found
        assert (tmp_path / ".simulated-joint-axis1.units.json").read_text() == kept

        description = bench.cell.model_dump(mode="json", by_alias=True, exclude_none=True)
        description["axis"][0]["drive"]["encoder_counts_per_motor_rev"] = 8192
        bench.cell = parse_cell(tomli_w.dumps(description))
        second = bench.run()
    true, again = (read(path.recording).columns["velocity_rad_s"] for path in (first, second))
    assert np.ptp(again) == pytest.approx(np.ptp(true), rel=0.01)


def test_a_drive_that_says_another_encoder_than_the_cell_moves_nothing(tmp_path: Path) -> None:
    """Twice the counts were twice the way and speed, out of the window, with exit code 0."""

    def doubled(cell: dict[str, Any]) -> None:
        brisk(cell)
        cell["axis"][0]["drive"]["encoder_counts_per_motor_rev"] *= 2

    with rig(tmp_path, edit=doubled) as bench:
        found, stands_rad = registers(bench), bench.drive.motor_position_rad
        with pytest.raises(
            ConfigurationError, match=r"counts in a motor turn \(0x608F\)"
        ) as caught:
            bench.run()
        assert "encoder_resolution = false" in caught.value.do
        assert bench.drive.motor_position_rad == stands_rad
        assert registers(bench) == found
        bench.drive.dictionary.write_number(bench.drive.dictionary.entry(GEAR_RATIO, 2), 2)
        bench.run()  # behind a gear in the drive the object says another thing


def test_a_note_of_the_units_that_cannot_be_read_moves_nothing(tmp_path: Path) -> None:
    (tmp_path / ".simulated-joint-axis1.units.json").write_text("[]")
    with rig(tmp_path) as bench, pytest.raises(InputError, match="last driven, and cannot be read"):
        bench.run()
