"""The contour check on a simulated joint: free and heavier somewhere, or blocked."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agent.cell.cell import parse_cell
from agent.cli.devices.fake_cell import fake_cell_text
from agent.cycle.contour import contour_of, creep_rad_s, creeping
from agent.cycle.ending import CycleResult
from agent.cycle.heaviness import heaviness
from agent.errors import StoppedError
from agent.record.reading import read
from agent.wire.wire import CycleRequest, drive_cycle
from fakes.imperfections import Imperfections
from fakes.specification import FakeSpecification
from tests.system.rig import Rig, rig
from trajectories import TrajectoryError

FROM_DEG, TO_DEG, BUMP_DEG, WIDTH_DEG = -12.0, 12.0, 5.0, 1.5


def bumpy(bump_nm: float) -> FakeSpecification:
    """Return a joint with more dry friction around one place, gravity and a tugging cable."""
    plain = FakeSpecification()
    imperfections = Imperfections(
        bump_nm=bump_nm,
        bump_arm_rad=math.radians(BUMP_DEG),
        bump_width_arm_rad=math.radians(WIDTH_DEG),
        cable_nm_per_arm_rad=0.3,
    )
    return replace(plain, joint=replace(plain.joint, imperfections=imperfections))


def short(cell: dict[str, Any]) -> None:
    cell["axis"][0]["stair"] |= {"arm_from_deg": FROM_DEG, "arm_to_deg": TO_DEG}
    cell["recording"]["sample_rate_hz"] = 100.0


def creep(bench: Rig, torque_nm: float | None = None) -> CycleResult:
    axis = creeping(bench.cell.axis[0], torque_nm)
    request = CycleRequest(bench.cell, axis, bench.folder, trajectory=contour_of(axis))
    return drive_cycle(request, bench.clock)


def test_it_says_where_the_joint_is_heavier_and_by_how_much(tmp_path: Path) -> None:
    with rig(tmp_path, specification=bumpy(0.5), edit=short) as bench:
        recording = read(creep(bench).recording)
        speed = creep_rad_s(bench.cell.axis[0])
    assert recording.metadata.trajectory["name"] == "contour"
    assert np.max(np.abs(recording.columns["velocity_rad_s"])) < 1.5 * speed
    found = heaviness(recording.columns, recording.metadata.gear_ratio)
    assert found is not None
    (place,) = found.heavy
    assert place.from_deg < BUMP_DEG < place.to_deg
    assert place.to_deg - place.from_deg < 4.0 * WIDTH_DEG
    assert place.extra_nm == pytest.approx(0.5, rel=0.15)
    assert f"heavier at {place.from_deg:.1f}" in found.sentence


def test_an_even_joint_is_heavier_nowhere(tmp_path: Path) -> None:
    with rig(tmp_path, specification=bumpy(0.0), edit=short) as bench:
        recording = read(creep(bench).recording)
    found = heaviness(recording.columns, recording.metadata.gear_ratio)
    assert found is not None
    assert found.heavy == ()
    assert "nowhere plainly more" in found.sentence


def test_what_blocks_the_way_stops_it_at_little_torque(tmp_path: Path) -> None:
    """A bump far above the tight limit, and far below what the axis may do in its stair."""
    with rig(tmp_path, specification=bumpy(6.0), edit=short) as bench:
        tight_nm = creeping(bench.cell.axis[0]).limits.motor_torque_max_nm
        assert tight_nm < 0.5 * bench.cell.axis[0].limits.motor_torque_max_nm
        with pytest.raises(StoppedError, match="measured torque") as caught:
            creep(bench)
        bench.later(0.5)
        assert abs(bench.drive.motor_velocity_rad_s) < 0.5
        at_deg = math.degrees(bench.drive.plant.arm_position_rad) / bench.cell.axis[0].gear_ratio
    assert "at rest (measured)" in " ".join(caught.value.__notes__)
    assert abs(at_deg - BUMP_DEG) < 3.0 * WIDTH_DEG
    (kept,) = tmp_path.glob("*-contour.parquet")
    assert np.max(np.abs(read(kept).columns["torque_nm"])) < 1.5 * tight_nm


def test_no_limit_is_ever_widened() -> None:
    text = fake_cell_text(FakeSpecification(), interface="virtual", channel="x", short=True)
    axis = parse_cell(text).axis[0]
    tight = creeping(axis, torque_nm=1000.0)
    for name in ("motor_torque_max_nm", "motor_velocity_max_rad_s", "following_error_max_arm_deg"):
        assert getattr(tight.limits, name) <= getattr(axis.limits, name)
    assert tight.stair.approach_velocity_rad_s <= axis.stair.approach_velocity_rad_s
    assert creeping(axis, 0.7).limits.motor_torque_max_nm == 0.7
    untold = axis.model_copy(update={"expected": None})
    assert creeping(untold).limits.motor_torque_max_nm < axis.limits.motor_torque_max_nm
    gentle = axis.limits.model_copy(update={"motor_jerk_max_rad_s3": 0.01})
    with pytest.raises(TrajectoryError, match="too short"):
        contour_of(axis.model_copy(update={"limits": gentle}))


def test_places_that_only_one_pass_crossed_are_no_verdict() -> None:
    n = 500
    columns = {
        "position_rad": np.linspace(0.0, 10.0, n),
        "velocity_command_rad_s": np.ones(n),
        "torque_nm": np.ones(n),
        "phase": np.array(["steady"] * n),
    }
    assert heaviness(columns, 100.0) is None
