"""A look before a start: everything that can be known is said, and nothing but reading is sent."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest

from agent.cell.cell import parse_cell
from agent.cli.devices.fake_cell import fake_cell_text
from agent.cycle.axis_lock import holders, looked_at, owned
from agent.cycle.plan import plan_cycle
from agent.wire.look import Seen, look
from fakes import faults
from fakes.modbus_server import TcpServer
from fakes.plc import GUARD_OPEN, INPUT, FakePlc
from fakes.process import open_bus
from fakes.specification import FakeSpecification
from tests.contract.modbus_rig import served
from tests.system.rig import Rig, rig

SDO_UPLOADS = (0x40, 0x60, 0x70)
"""First bytes of an SDO client that reads: initiate, and a segment with either toggle bit."""


def looked(bench: Rig) -> tuple[dict[str, str], Seen]:
    """Look, and return the reasons by condition; empty where it holds."""
    axis = bench.cell.axis[0]
    seen = look(bench.cell, axis, plan_cycle(bench.cell, axis), bench.clock)
    return {c.name: "" if c.holds else c.reason for c in seen.conditions}, seen


def sent_to_the_drive(bench: Rig) -> list[can.Message]:
    """Have every frame kept that anybody but the drive sends."""
    bus = open_bus(bench.cell.bus.interface, str(bench.cell.bus.channel))
    kept: list[can.Message] = []

    def hear(_now_s: float) -> None:
        while (message := bus.recv(0.0)) is not None:
            kept.append(message)

    bench.clock.attach(hear)
    return kept


def test_a_look_says_what_holds_and_sends_requests_to_read_alone(tmp_path: Path) -> None:
    with rig(tmp_path) as bench:
        kept, node = sent_to_the_drive(bench), bench.cell.axis[0].drive.node_id
        bench.later(0.5)
        before_rad = bench.drive.motor_position_rad
        found, seen = looked(bench)
        bench.later(0.1)
        assert found == dict.fromkeys(
            (
                "identity",
                "drive healthy",
                "limits of the drive",
                "without torque",
                "at standstill",
                "inside its window",
                "gearbox temperature",
            ),
            "",
        )
        assert seen.untold == ""
        ours = [m for m in kept if m.arbitration_id not in (0x580 + node, 0x700 + node)]
        assert {m.arbitration_id for m in ours} == {0x600 + node}
        assert {m.data[0] for m in ours} <= set(SDO_UPLOADS)
        assert len(ours) > 8
        assert bench.drive.motor_position_rad == pytest.approx(before_rad, abs=1e-3)


@pytest.mark.parametrize(
    ("edit", "fault", "name", "reason"),
    [
        ({"product_code": 7}, None, "identity", "product code expected 7 (0x7)"),
        ({"node_id": 77}, None, "identity", "Nobody answers under node id 77"),
        ({"rated_torque_nm": 99.0}, None, "settings read back equal", "rated torque"),
        ({}, faults.DriveFault(at_s=0.0), "drive healthy", "in fault"),
    ],
)
def test_what_would_be_refused_is_refused_before_the_start_with_its_reason(
    tmp_path: Path, edit: dict[str, Any], fault: Any, name: str, reason: str
) -> None:
    def changed(description: dict[str, Any]) -> None:
        description["axis"][0]["drive"] |= {k: v for k, v in edit.items() if k != "node_id"}

    with rig(tmp_path, edit=changed, faults=[fault] if fault else []) as bench:
        if "node_id" in edit:
            drive = bench.cell.axis[0].drive.model_copy(update={"node_id": edit["node_id"]})
            axis = bench.cell.axis[0].model_copy(update={"drive_": drive})
            bench.cell = bench.cell.model_copy(update={"axis": (axis,)})
        bench.later(0.5)
        found, _seen = looked(bench)
        assert reason in found[name]


def test_an_arm_outside_its_window_is_said_before_the_start(tmp_path: Path) -> None:
    def narrow(description: dict[str, Any]) -> None:
        limits = description["axis"][0]["limits"]
        limits["arm_position_min_deg"] = 5.0
        description["axis"][0]["stair"] |= {"arm_from_deg": 20.0, "arm_to_deg": 60.0}

    with rig(tmp_path, edit=narrow) as bench:
        bench.later(0.5)
        found, _seen = looked(bench)
        assert "outside its window" in found["inside its window"]


@pytest.mark.parametrize("cob_id", [0x080, 0x200, 0x600])
def test_a_bus_on_which_somebody_talks_to_the_drive_is_left_alone(
    tmp_path: Path, cob_id: int
) -> None:
    with rig(tmp_path) as bench:
        node = bench.cell.axis[0].drive.node_id
        other = open_bus(bench.cell.bus.interface, str(bench.cell.bus.channel))
        at = cob_id if cob_id == 0x080 else cob_id + node
        data = b"" if cob_id == 0x080 else bytes(8)

        def talk(now_s: float) -> None:
            while other.recv(0.0) is not None:
                pass
            if round(now_s * 1000) % 100 == 0:
                other.send(can.Message(arbitration_id=at, data=data, is_extended_id=False))

        bench.later(0.5)
        kept = sent_to_the_drive(bench)
        bench.clock.attach(talk)
        found, seen = looked(bench)
        other.shutdown()
        assert found == {}
        assert "Somebody else" in seen.untold
        assert {m.arbitration_id for m in kept} <= {at, 0x580 + node, 0x700 + node}


@pytest.mark.parametrize(
    ("act", "reason", "untold"),
    [
        (lambda _plc: None, None, "its permit is asked for at the start"),
        (lambda plc: plc.registers.put(INPUT, 2, GUARD_OPEN), "a guard is open", ""),
        (lambda plc: setattr(plc, "hangs", True), "stands still", ""),
    ],
)
def test_a_plc_is_read_and_asked_for_nothing(
    tmp_path: Path, act: Callable[[FakePlc], None], reason: str | None, untold: str
) -> None:
    plc = FakePlc()
    server = TcpServer(plc.registers)
    with served(server):

        def with_release(description: dict[str, Any]) -> None:
            tcp = f"127.0.0.1:{server.port}"
            description["release"] = {"kind": "modbus", "tcp": tcp, "timeout_s": 0.2}

        with rig(tmp_path, edit=with_release) as bench:
            bench.clock.attach(plc.step_to)
            bench.clock.attach(lambda _now_s: act(plc))
            bench.later(0.5)
            before = plc.registers.get(3, 0, 3)
            found, seen = looked(bench)
            assert plc.registers.get(3, 0, 3) == before
            assert (
                (reason in found["release present"]) if reason else "release present" not in found
            )
            assert untold in seen.untold


def test_the_moment_in_which_a_look_says_nothing_is_no_owner(tmp_path: Path) -> None:
    """It has the lock, and has not yet said, or says no more, that it only looks."""
    cell = parse_cell(fake_cell_text(FakeSpecification(), interface="socketcan", channel="can0"))
    axis, got = cell.axis[0], []

    def want() -> None:
        with owned(cell, axis, tmp_path) as condition:
            got.append(condition.holds)

    with looked_at(cell, axis, tmp_path):
        for path in tmp_path.glob("stribeck.*.lock"):
            path.write_text("")
        wants = threading.Thread(target=want)
        wants.start()
        wants.join(0.1)
        assert got == []
    wants.join(60.0)
    assert got == [True]


def test_whoever_wants_the_axis_waits_for_a_look_and_nobody_calls_it_held(tmp_path: Path) -> None:
    text = fake_cell_text(FakeSpecification(), interface="socketcan", channel="can0")
    cell = parse_cell(text)
    axis, got = cell.axis[0], []

    def want() -> None:
        with owned(cell, axis, tmp_path) as condition:
            got.append(condition.holds)

    with looked_at(cell, axis, tmp_path) as free:
        assert free
        assert holders(tmp_path) == ()
        wants = threading.Thread(target=want)
        wants.start()
        wants.join(0.2)
        assert got == []
    wants.join(60.0)
    assert got == [True]
    with owned(cell, axis, tmp_path) as condition:
        assert condition.holds
        with looked_at(cell, axis, tmp_path) as free:  # a look waits for nobody
            assert not free
        assert json.loads(next(tmp_path.glob("*.lock")).read_text())["pid"] == os.getpid()
