"""Torque from the drive, temperature from another device: one recording, one time base.

Real frames and real Modbus bytes; the drive's time is simulated, the transmitter is asked in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agent.errors import RefusedError, StoppedError
from agent.record.reading import read
from drivers.errors import NodeMissingError
from fakes.can_rtd import FakeRtd
from fakes.modbus_probe import MAP, FakeTransmitter
from fakes.modbus_server import Misbehaviour, TcpServer
from fakes.process import open_bus
from tests.contract.modbus_rig import served, unhurried
from tests.system.rig import Rig, rig

REST_RAD_S = 0.5
PERIOD_S, AGE_MAX_S = 0.25, 0.8
IN_THE_STAIR_S = 5.0
SHORT = {"duration_s": 6.0, "speeds": 3}
RAMP_K_PER_S = 0.5


@dataclass
class Cell:
    """A cell whose gearbox temperature comes over Modbus TCP."""

    rig: Rig
    fake: FakeTransmitter
    server: TcpServer


@contextmanager
def cell(tmp_path: Path) -> Iterator[Cell]:
    (tmp_path / "transmitter.toml").write_text(MAP)
    made: list[Rig] = []
    fake = FakeTransmitter(lambda: 30.0 + RAMP_K_PER_S * made[0].clock.now() if made else 30.0)
    server = TcpServer(fake.registers)

    def beside_the_drive(description: dict[str, Any]) -> None:
        axis = description["axis"][0]
        del axis["drive"]["gearbox_temperature"]
        axis["stair"] |= SHORT
        description["recording"]["sample_rate_hz"] = 100.0
        axis["temperature"] = {
            "kind": "modbus",
            "map": str(tmp_path / "transmitter.toml"),
            "register": "gearbox",
            "tcp": f"127.0.0.1:{server.port}",
            "period_s": PERIOD_S,
            "timeout_s": 0.5,
            "age_max_s": AGE_MAX_S,
        }

    with served(server), unhurried(server), rig(tmp_path / "out", edit=beside_the_drive) as bench:
        made.append(bench)
        yield Cell(bench, fake, server)


def test_the_recording_has_the_temperature_with_its_age_and_quality(tmp_path: Path) -> None:
    with cell(tmp_path) as bench:
        began_s = bench.rig.clock.now()
        result = bench.rig.run()
        ended_s = bench.rig.clock.now()
    recording = read(result.recording)
    columns = recording.columns
    degc, age_s = columns["gearbox_temperature_degc"], columns["gearbox_temperature_age_s"]
    assert set(columns["gearbox_temperature_quality"]) == {"good"}
    assert np.all((age_s >= 0.0) & (age_s < PERIOD_S + 0.05))
    # On one time base: value and age together lie on the ramp that the transmitter measured.
    taken_s = columns["time_s"] - age_s
    slope, at_zero = np.polyfit(taken_s, degc, 1)
    assert slope == pytest.approx(RAMP_K_PER_S, rel=0.02)
    start_s = (at_zero - 30.0) / RAMP_K_PER_S
    assert began_s - 0.3 < start_s < ended_s - columns["time_s"][-1] + 0.3
    assert np.abs(degc - (at_zero + slope * taken_s)).max() < 0.1  # the register's resolution
    source = recording.metadata.extra["temperature_source"]
    assert source["device"] == "simulated temperature transmitter"
    assert source["register"] == "gearbox"


@pytest.mark.parametrize("kind", ["silent", "open", "status", "garbled"])
def test_a_temperature_that_is_lost_in_motion_stops_the_joint(tmp_path: Path, kind: str) -> None:
    def lose(bench: Cell) -> None:
        if kind == "open":
            bench.fake.broken = True
        elif kind == "status":
            bench.fake.status = 3
        else:
            bench.server.misbehaviour = Misbehaviour(kind)

    with cell(tmp_path) as bench:
        bench.rig.at(IN_THE_STAIR_S, lambda: lose(bench))
        with pytest.raises(StoppedError, match="gearbox temperature is not known") as caught:
            bench.rig.run()
        assert abs(bench.rig.drive.motor_velocity_rad_s) < REST_RAD_S
        assert bench.rig.clock.now() < IN_THE_STAIR_S + AGE_MAX_S + PERIOD_S + 1.5
    text = str(caught.value)
    assert {
        "silent": "does not answer",
        "garbled": "no valid reply",
        "open": "there is no value",
        "status": "status is 3",
    }[kind] in text
    assert "The joint is at rest (measured)." in caught.value.__notes__
    (path,) = (tmp_path / "out").glob("*.parquet")
    columns = read(path).columns
    good = columns["gearbox_temperature_quality"] == "good"
    assert np.isfinite(columns["gearbox_temperature_degc"][good]).all()
    assert np.isnan(columns["gearbox_temperature_degc"][~good]).all()
    assert good.sum() > 100


def test_what_is_not_there_before_motion_is_refused_and_nothing_moves(tmp_path: Path) -> None:
    with cell(tmp_path) as bench:
        bench.server.misbehaviour = Misbehaviour("silent")
        with pytest.raises(NodeMissingError, match="does not answer"):
            bench.rig.run()
        assert bench.rig.drive.syncs == 0
        bench.server.misbehaviour = None
        bench.fake.broken = True
        with pytest.raises(RefusedError, match="there is no value"):
            bench.rig.run()
        assert abs(bench.rig.drive.motor_position_rad) < 0.1


def test_a_temperature_node_on_the_drives_own_bus(tmp_path: Path) -> None:
    def beside_the_drive(description: dict[str, Any]) -> None:
        axis = description["axis"][0]
        del axis["drive"]["gearbox_temperature"]
        axis["stair"] |= SHORT
        axis["temperature"] = {"kind": "cia404", "node_id": 21, "period_s": 0.2}

    with rig(tmp_path, edit=beside_the_drive) as bench:
        bus = open_bus("virtual", str(bench.cell.bus.channel))
        try:
            node = FakeRtd(bus, lambda: bench.drive.gearbox_temperature_degc)
            bench.clock.attach(node.step_to)
            columns = read(bench.run().recording).columns
        finally:
            bus.shutdown()
    assert np.abs(columns["gearbox_temperature_degc"] - 25.05).max() < 0.2
    assert columns["gearbox_temperature_age_s"].max() < 0.3
    assert math.isclose(node.answers, 2 * bench.clock.now() / 0.2, rel_tol=0.2)
