"""Controller and PLC as processes of their own on TCP ports, in real time, as on a shop floor."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from agent.cell.cell import parse_cell
from agent.cli.devices.fake_cell import fake_cell_text
from agent.record.reading import read
from agent.wire.wire import CycleRequest, drive_cycle
from drivers.clock import MonotonicClock
from fakes.specification import FakeSpecification

READY_WITHIN_S = 300.0


@contextmanager
def device(module: str, log: Path) -> Iterator[str]:
    """Start a fake device and yield the address that it says it listens on."""
    with log.open("wb") as sink:
        process = subprocess.Popen(
            [sys.executable, "-m", module], stdout=sink, stderr=sink, stdin=subprocess.DEVNULL
        )
    try:
        end = time.monotonic() + READY_WITHIN_S
        while not (said := log.read_text()).startswith("ready: ") or not said.endswith("\n"):
            assert process.poll() is None, said
            assert time.monotonic() < end, "not ready"
            MonotonicClock().sleep_until(time.monotonic() + 0.05)
        yield said.removeprefix("ready: ").strip()
    finally:
        process.terminate()
        process.wait(timeout=60.0)


@pytest.mark.real_time
def test_a_job_with_the_cells_permit_between_three_processes(tmp_path: Path) -> None:
    with contextlib.ExitStack() as stack:
        controller = stack.enter_context(device("fakes.modbus_controller", tmp_path / "c.log"))
        plc = stack.enter_context(device("fakes.plc", tmp_path / "p.log"))
        text = fake_cell_text(FakeSpecification(), interface="virtual", channel="none", short=True)
        description = tomllib.loads(text)
        del description["bus"]
        description["recording"]["sample_rate_hz"] = 100.0
        # A late tick on a loaded test machine is not what is tested.
        description["release"] = {"kind": "modbus", "tcp": plc, "timeout_s": 1.0, "age_max_s": 2.0}
        axis = description["axis"][0]
        del axis["drive"]
        axis["stair"] |= {"duration_s": 4.0, "speeds": 2, "motor_velocity_min_rad_s": 20.0}
        axis["supervision"]["sample_age_max_s"] = 1.5
        axis["job"] = {
            "kind": "modbus",
            "tcp": controller,
            "alive_timeout_s": 2.0,
            "timeout_s": 0.9,
        }
        cell = parse_cell(tomli_w.dumps(description))
        result = drive_cycle(CycleRequest(cell, cell.axis[0], tmp_path), MonotonicClock())
    recording = read(result.recording)
    columns = recording.columns
    assert columns["time_s"][-1] > 3.0
    assert np.all(np.diff(columns["time_s"]) > 0.0)
    assert {"ramp", "steady", "return"} <= set(columns["phase"])
    assert np.abs(columns["velocity_rad_s"]).max() > 70.0
    # What was seen before the start is counted, and not recorded: nothing had moved.
    assert result.account.received >= len(columns["time_s"]) > 50
