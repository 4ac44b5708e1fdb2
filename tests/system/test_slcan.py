"""A short cycle in real time through an slcan adapter on a pty, to the fake drive behind it."""

from __future__ import annotations

import threading
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from agent.cell.cell import Cell, parse_cell
from agent.cli.devices.fake_cell import fake_cell_text
from agent.cycle.ending import CycleResult
from agent.errors import StoppedError
from agent.record.reading import read
from agent.wire.wire import CycleRequest, drive_cycle
from drivers.clock import MonotonicClock
from drivers.errors import DriverError
from fakes.process import run_process
from fakes.specification import FakeSpecification
from tests.contract.slcan_rig import Plugged, plugged_in
from trajectories import point_to_point

TURNS_RAD = 30.0
SPEED_RAD_S = 40.0


@contextmanager
def drive_behind_an_adapter() -> Iterator[Plugged]:
    """Yield an adapter with the fake drive on the bus behind it."""
    stop = threading.Event()
    with plugged_in() as plugged:
        thread = threading.Thread(
            target=run_process,
            args=("virtual", plugged.channel),
            kwargs={"stop": stop, "node_id": 1},
            name="fake drive",
        )
        thread.start()
        try:
            yield plugged
        finally:
            stop.set()
            thread.join()


def described(plugged: Plugged) -> Cell:
    """Return a cell that reaches the drive by the adapter; patient with a busy machine."""
    text = fake_cell_text(
        FakeSpecification(),
        interface="slcan",
        channel=str(plugged.config.channel),
        options=dict(plugged.config.options),
        short=True,
    )
    cell: dict[str, Any] = tomllib.loads(text)
    cell["recording"]["sample_rate_hz"] = 100.0
    axis = cell["axis"][0]
    axis["supervision"] = {
        "heartbeat_timeout_s": 1.0,
        "drive_heartbeat_period_s": 0.5,
        "sample_age_max_s": 1.0,
    }
    axis["limits"] |= {"velocity_error_max_rad_s": 100.0, "following_error_max_arm_deg": 30.0}
    return parse_cell(tomli_w.dumps(cell))


def drive(cell: Cell, folder: Path, **more: Any) -> CycleResult:
    move = point_to_point(
        from_rad=0.0,
        to_rad=TURNS_RAD,
        velocity_rad_s=SPEED_RAD_S,
        acceleration_rad_s2=200.0,
        jerk_rad_s3=5000.0,
    )
    request = CycleRequest(cell, cell.axis[0], folder, trajectory=move)
    return drive_cycle(request, MonotonicClock(), **more)


@pytest.mark.real_time
def test_a_short_cycle_runs_through_an_adapter(tmp_path: Path) -> None:
    with drive_behind_an_adapter() as plugged:
        result = drive(described(plugged), tmp_path)
    recording = read(result.recording)
    assert result.account.lost <= 0.01 * result.account.expected  # a machine may stand still
    assert recording["position_rad"].max() == pytest.approx(TURNS_RAD, abs=2.0)
    at_speed = recording["velocity_command_rad_s"] == SPEED_RAD_S
    speed_rad_s = np.median(recording["velocity_rad_s"][at_speed])
    assert speed_rad_s == pytest.approx(SPEED_RAD_S, rel=0.05)


@pytest.mark.real_time
def test_an_adapter_that_refuses_in_motion_ends_the_cycle_and_says_so(tmp_path: Path) -> None:
    with drive_behind_an_adapter() as plugged:

        def refuse(stage: str, _share: float) -> None:
            if stage == "return":
                plugged.adapter.misbehaviour = "bell"

        with pytest.raises((DriverError, StoppedError), match="refused a frame with a bell") as why:
            drive(described(plugged), tmp_path, progress=refuse)
    notes = " ".join(why.value.__notes__)
    assert "NOT seen to come to rest" in notes
    assert "is kept in" in notes
    (kept,) = tmp_path.glob("*.parquet")
    assert len(read(kept)) > 100
