"""Drive and agent as processes of their own, in real time, on multicast: as on a shop floor.

The tests listen on the same bus, so that what they judge is what the wire saw.
"""

from __future__ import annotations

import json
import os
import re
import signal
import struct
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import can
import numpy as np
import pytest

from agent.cycle.precedence import before_others, scheduling
from agent.record.reading import read
from fakes.process import open_bus
from fakes.specification import FakeSpecification
from tests.system.processes import MULTICAST_GROUP, be_patient, free_udp_port, started, stribeck

pytestmark = pytest.mark.real_time

NODE = 1
SYNC, RPDO1, TPDO2, EMCY = 0x080, 0x200 + NODE, 0x280 + NODE, 0x080 + NODE
SHUTDOWN = 0x06
COUNTS_PER_RAD = 65536 / (2.0 * np.pi)
FLUSH_S = 0.5


@dataclass
class Bench:
    """A fake drive in its own process, its cell, and an ear on the bus."""

    folder: Path
    cell: Path
    bus: can.BusABC

    def listen(self, until: Callable[[can.Message], bool], timeout_s: float) -> can.Message | None:
        """Return the first frame that `until` is true of, or None when time is up."""
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            message = self.bus.recv(0.05)
            if message is not None and until(message):
                return message
        return None

    def velocity_rad_s(self) -> float:
        """Ask the drive for its velocity (0x606C) as a bystander, by SDO: in any NMT state."""
        ask = can.Message(
            arbitration_id=0x600 + NODE,
            is_extended_id=False,
            data=bytes.fromhex("406c600000000000"),
        )
        while self.bus.recv(0.0) is not None:  # what was said before, during the motion
            pass
        self.bus.send(ask)
        answer = self.listen(
            lambda m: m.arbitration_id == 0x580 + NODE and bytes(m.data[:4]) == b"\x43\x6c\x60\x00",
            60.0,
        )
        assert answer is not None, "the drive does not answer"
        counts: int = struct.unpack_from("<i", answer.data, 4)[0]
        return counts / COUNTS_PER_RAD


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    cell, port = tmp_path / "cell.toml", free_udp_port()
    try:
        bus = open_bus("udp_multicast", MULTICAST_GROUP, options={"port": port})
    except (can.CanError, OSError) as error:
        pytest.skip(f"this machine has no IPv4 multicast: {error}")
    arguments: list[str | Path] = ["fake", "--write-cell", cell, "--short"]
    arguments += ["--bus-option", f"port={port}"]
    try:
        with started(arguments, tmp_path / "fake.log", ready="ready"):
            be_patient(cell)
            text = cell.read_text()
            cell.write_text(text.replace("sample_rate_hz = 500.0", "sample_rate_hz = 200.0"))
            yield Bench(tmp_path, cell, bus)
    finally:
        bus.shutdown()


def test_run_drives_the_fake_and_finds_its_friction(bench: Bench) -> None:
    done = stribeck("run", bench.cell, "--axis", "1", "--out", bench.folder / "out", "--json")
    assert done.returncode == 0, done.stderr
    estimate = json.loads(done.stdout)
    assert estimate["decidable"]
    selected = next(m for m in estimate["friction_models"] if m["selected"])
    friction = FakeSpecification().joint.friction
    viscous = selected["parameters"]["viscous_nm_s_per_rad"]["value"]
    assert viscous == pytest.approx(friction.truth(25.0).viscous_nm_s_per_rad, rel=0.05)
    (recording,) = (bench.folder / "out").glob("*.parquet")
    metadata = read(recording).metadata
    account = metadata.extra["acquisition"]
    assert account["lost"] == metadata.samples_lost <= 0.01 * account["expected"]
    with before_others():
        assert metadata.extra["scheduling"] == scheduling()
    assert len(list((bench.folder / "out").glob("*.report.html"))) == 1
    assert bench.velocity_rad_s() == pytest.approx(0.0, abs=0.5)


def test_a_killed_run_stops_the_joint_and_loses_half_a_second_at_most(bench: Bench) -> None:
    out = bench.folder / "out"
    with started(["run", bench.cell, "--axis", "1", "--out", out], bench.folder / "run.log") as run:
        proven = bench.listen(lambda m: m.arbitration_id == EMCY, timeout_s=120.0)
        assert proven is not None, "the drive's watchdog was not proven before motion"
        first = bench.listen(
            lambda m: m.arbitration_id == RPDO1 and m.data[0] == SHUTDOWN, timeout_s=120.0
        )
        assert first is not None, (bench.folder / "run.log").read_text()
        began = first.timestamp
        end, last = time.monotonic() + 3.0, began
        while time.monotonic() < end:
            message = bench.bus.recv(0.05)
            if message is not None and message.arbitration_id == SYNC:
                last = message.timestamp
        os.kill(run.pid, signal.SIGKILL)
        run.wait()
        emergency = bench.listen(lambda m: m.arbitration_id == EMCY, timeout_s=60.0)
    assert emergency is not None, "the drive did not notice that the agent is gone"
    assert struct.unpack_from("<H", emergency.data)[0] == 0x8130
    assert bench.listen(lambda _m: False, timeout_s=1.0) is None
    assert bench.velocity_rad_s() == pytest.approx(0.0, abs=0.5)

    recovered = stribeck("recover", out)
    assert recovered.returncode == 0, recovered.stderr
    (path,) = out.glob("*.parquet")
    recording = read(path)
    assert recording.columns["time_s"][-1] > (last - began) - FLUSH_S - 0.1

    # For the next run to restore, wherever that one puts its recordings.
    assert (bench.folder / "recordings" / ".simulated-joint-axis1.found.json").exists()


def test_a_hanging_run_stops_the_joint(bench: Bench) -> None:
    """SIGSTOP is the agent that still exists and no longer thinks: heartbeat and SYNC must end."""
    with started(
        ["run", bench.cell, "--axis", "1", "--out", bench.folder / "out"], bench.folder / "run.log"
    ) as run:
        moving = bench.listen(
            lambda m: (
                m.arbitration_id == TPDO2
                and abs(struct.unpack_from("<i", m.data)[0]) > 3.0 * COUNTS_PER_RAD
            ),
            timeout_s=120.0,
        )
        assert moving is not None, (bench.folder / "run.log").read_text()
        os.kill(run.pid, signal.SIGSTOP)
        try:
            emergency = bench.listen(lambda m: m.arbitration_id == EMCY, timeout_s=60.0)
            assert emergency is not None, "the drive did not notice that the agent hangs"
            assert bench.listen(lambda _m: False, timeout_s=1.0) is None
            assert bench.velocity_rad_s() == pytest.approx(0.0, abs=0.5)
        finally:
            os.kill(run.pid, signal.SIGCONT)
        assert run.wait(timeout=120.0) in (4, 5)


def test_stop_from_another_terminal_does_what_ctrl_c_does(bench: Bench) -> None:
    """It sends the same signal, so the order of the stop is Ctrl-C's, too."""
    text = bench.cell.read_text()
    text = re.sub(r"\bduration_s = [\d.]+", "duration_s = 60.0", text)
    text = re.sub(r"sample_rate_hz = [\d.]+", "sample_rate_hz = 200.0", text)
    bench.cell.write_text(text)
    axis: list[str | Path] = [bench.cell, "--axis", "1"]
    idle = stribeck("stop", *axis)
    assert idle.returncode == 3, idle.stderr
    assert "nothing was asked to stop" in idle.stderr
    with started(["run", *axis, "--out", bench.folder / "out"], bench.folder / "run.log") as run:
        moving = bench.listen(
            lambda m: (
                m.arbitration_id == TPDO2
                and abs(struct.unpack_from("<i", m.data)[0]) > 3.0 * COUNTS_PER_RAD
            ),
            timeout_s=120.0,
        )
        assert moving is not None
        dry = stribeck("stop", *axis, "--dry-run")
        assert f"process {run.pid} " in dry.stdout, dry.stderr
        assert run.poll() is None
        stopped = stribeck("stop", *axis, "--json")
        assert stopped.returncode == 0, stopped.stderr
        assert run.wait(timeout=120.0) == 5
    said = (bench.folder / "run.log").read_text()
    assert "the operator asked for it" in said
    assert "The joint is at rest (measured)." in said
    assert "Standstill was measured 0." in said
    (ended,) = json.loads(stopped.stdout)["ended"]
    assert ended["pid"] == run.pid
    assert 0.0 < ended["let_go_after_s"] < 15.0
    assert "Standstill was measured 0." in ended["said"]
    assert bench.velocity_rad_s() == pytest.approx(0.0, abs=0.5)
    (path,) = (bench.folder / "out").glob("*.parquet")
    assert "the operator asked for it" in str(read(path).metadata.extra["stopped_because"])
    assert not (bench.folder / "recordings" / ".simulated-joint-axis1.found.json").exists()
