"""The cell's release: without it nothing moves, and when it goes the joint comes to rest.

Real Modbus bytes and real CAN frames; the joint's speed is measured on the fake itself.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import can
import pytest

import fakes.plc
from agent.errors import InputError, RefusedError, StoppedError
from agent.record.reading import read
from agent.wire.wire import CycleRequest, drive_cycle
from drivers.can.frames import CanBusConfig
from drivers.can.owner import CanBusOwner
from drivers.cia401.contact import CanContact
from drivers.clock import MonotonicClock, SteppedClock
from drivers.errors import NodeMissingError
from drivers.modbus.connection import ModbusConnection, TcpEndpoint
from drivers.modbus.device import MappedDevice
from drivers.modbus.map_file import load_map
from drivers.modbus.release import ModbusRelease
from drivers.ports import Permit
from fakes.modbus_server import Misbehaviour, TcpServer
from fakes.plc import AGENT_TIMEOUT_S, FakeContact, FakePlc
from fakes.process import open_bus
from tests.contract.modbus_rig import served, unhurried
from tests.system.rig import Rig, rig

REST_RAD_S = 0.5
IN_THE_STAIR_S = 5.0
AGE_MAX_S = 0.3
PATIENCE_S = 60.0
STOPPED_WITHIN_S = 1.0
"""Hearing of it (0.3 s), braking from 80 rad/s at 500 rad/s2 (0.16 s), ringing (0.2 s), room."""


@dataclass
class Cell:
    """A cell with a release, and the speed of its joint over time."""

    rig: Rig
    release: FakePlc | FakeContact
    server: TcpServer | None
    speeds: list[tuple[float, float]] = field(default_factory=list)

    def watch(self) -> None:
        clock, drive = self.rig.clock, self.rig.drive
        clock.attach(lambda now_s: self.speeds.append((now_s, drive.motor_velocity_rad_s)))

    def at_rest_from_s(self) -> float:
        """Return when the joint last moved."""
        return max(now_s for now_s, speed in self.speeds if abs(speed) > REST_RAD_S)


@contextmanager
def cell(tmp_path: Path, kind: str) -> Iterator[Cell]:
    with contextlib.ExitStack() as stack:
        release: FakePlc | FakeContact
        server: TcpServer | None = None
        section: dict[str, Any] = {"kind": "can-input", "node_id": 31}
        if kind == "modbus":
            release = FakePlc()
            server = TcpServer(release.registers)
            stack.enter_context(served(server))
            stack.enter_context(unhurried(server))
            section = {"kind": "modbus", "tcp": f"127.0.0.1:{server.port}", "timeout_s": 0.2}

        def with_release(description: dict[str, Any]) -> None:
            description["axis"][0]["stair"] |= {"duration_s": 6.0, "speeds": 3}
            description["recording"]["sample_rate_hz"] = 100.0
            description["release"] = {**section, "age_max_s": AGE_MAX_S, "wait_s": 1.0}

        bench = stack.enter_context(rig(tmp_path, edit=with_release))
        if kind == "can-input":
            bus = open_bus("virtual", str(bench.cell.bus.channel))
            stack.callback(bus.shutdown)
            release = FakeContact(bus)
        bench.clock.attach(release.step_to)
        made = Cell(bench, release, server)
        made.watch()
        yield made


@pytest.mark.parametrize("kind", ["modbus", "can-input"])
def test_with_the_permit_the_cycle_runs_and_gives_it_back(tmp_path: Path, kind: str) -> None:
    with cell(tmp_path, kind) as made:
        result = made.rig.run()
        if isinstance(made.release, FakePlc):
            request, _alive, done = made.release.registers.get(3, 0, 3)
            assert (request, done) == (0, 1)
            assert made.release.withdrawn_for_silence == 0
    assert result.account.lost == 0


def open_guard(made: Cell) -> None:
    if isinstance(made.release, FakePlc):
        made.release.guard_closed = False
    else:
        made.release.closed = False


def cut(made: Cell) -> None:
    if isinstance(made.release, FakeContact):
        made.release.unplugged = True
    elif made.server is not None:
        made.server.misbehaviour = Misbehaviour("deaf")


def hang(made: Cell) -> None:
    assert isinstance(made.release, FakePlc)
    made.release.hangs = True


@pytest.mark.parametrize(
    ("kind", "act", "says"),
    [
        ("modbus", open_guard, "a guard is open"),
        ("modbus", cut, "has not been heard for"),
        ("modbus", hang, "alive count of the cell's PLC stands still"),
        ("can-input", open_guard, "the release contact is open"),
        ("can-input", cut, "has not been heard for"),
    ],
)
def test_a_permit_that_goes_in_motion_brings_the_joint_to_rest(
    tmp_path: Path, kind: str, act: Callable[[Cell], None], says: str
) -> None:
    with cell(tmp_path, kind) as made:
        made.rig.at(IN_THE_STAIR_S, lambda: act(made))
        with pytest.raises(StoppedError, match=says) as caught:
            made.rig.run()
        made.rig.later(1.0)
        assert IN_THE_STAIR_S < made.at_rest_from_s() < IN_THE_STAIR_S + STOPPED_WITHIN_S
        if act is open_guard and isinstance(made.release, FakePlc):
            assert made.release.registers.get(3, 0, 3)[2] == 2  # told: ended with trouble
    assert "The joint is at rest (measured)." in caught.value.__notes__
    (path,) = tmp_path.glob("*.parquet")
    assert read(path).columns["time_s"][-1] > 3.0


@pytest.mark.parametrize(
    ("kind", "act", "error", "says"),
    [
        ("modbus", open_guard, RefusedError, "a guard is open; waited 1.0 s"),
        ("modbus", hang, RefusedError, "stands still"),
        ("modbus", cut, NodeMissingError, "does not answer"),
        ("can-input", open_guard, RefusedError, "contact is open"),
        ("can-input", cut, RefusedError, "has not been heard yet"),
    ],
)
def test_without_the_permit_the_drive_is_not_even_opened(
    tmp_path: Path, kind: str, act: Callable[[Cell], None], error: type[Exception], says: str
) -> None:
    with cell(tmp_path, kind) as made:
        act(made)
        with pytest.raises(error, match=says) as caught:
            made.rig.run()
        notes = " ".join(getattr(caught.value, "__notes__", ()))
        assert ("the cell's PLC" in notes) == (error is NodeMissingError)
        assert made.rig.drive.syncs == 0
        assert not made.speeds or max(abs(v) for _, v in made.speeds) < REST_RAD_S


@dataclass
class Talk:
    """A release that talks to a PLC in real time, by a thread of its own."""

    plc: FakePlc
    server: TcpServer
    release: ModbusRelease

    def until(self, true: Callable[[], object]) -> None:
        """Wait for a fact; a machine may take its time."""
        clock = MonotonicClock()
        end_s = clock.now() + PATIENCE_S
        while not true():
            assert clock.now() < end_s
            clock.sleep_until(clock.now() + 0.002)

    def go_on(self) -> None:
        """Wait until they have said at least one whole exchange to each other."""
        begun = self.server.requests
        self.until(lambda: self.server.requests >= begun + 6)  # an exchange is two requests


@contextmanager
def talking(monkeypatch: pytest.MonkeyPatch) -> Iterator[Talk]:
    """Yield both; neither loses its patience on a machine that stands still."""
    monkeypatch.setattr(fakes.plc, "AGENT_TIMEOUT_S", PATIENCE_S)
    clock, plc = MonotonicClock(), FakePlc()
    server = TcpServer(plc.registers)
    with served(server, between=lambda: plc.step_to(clock.now())):
        device = MappedDevice(
            ModbusConnection(TcpEndpoint("127.0.0.1", server.port), clock), load_map("cell-release")
        )
        release = ModbusRelease(
            device, clock, period_s=0.01, timeout_s=PATIENCE_S, age_max_s=PATIENCE_S
        )
        release.open()
        yield Talk(plc, server, release)
        release.close()


def test_the_alive_count_is_the_control_ticks_and_not_the_threads(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In real time the thread goes on talking when nobody asks for the permit any more."""
    with talking(monkeypatch) as talk:
        talk.release.request()
        talk.until(lambda: talk.release.permit().granted)
        talk.go_on()
        count = talk.plc.registers.get(3, 1)
        talk.go_on()
        assert talk.plc.registers.get(3, 1) == count
        talk.release.done(well=True)
    assert talk.plc.registers.get(3, 0, 3)[0::2] == (0, 1)


def test_a_contact_that_was_open_between_two_looks_is_no_permit_any_more() -> None:
    clock = SteppedClock()
    owner = CanBusOwner.open(CanBusConfig("virtual", "contact"), clock)
    bus = open_bus("virtual", "contact")
    release = CanContact(owner, clock, node_id=31, bit=0, age_max_s=1.0)
    release.open()

    def says(*inputs: int) -> Permit:
        for byte in inputs:
            bus.send(can.Message(arbitration_id=0x19F, data=[byte], is_extended_id=False))
        return release.permit()

    assert not says(0).granted
    assert says(0, 1).granted  # before the first permit it may do as it likes
    assert says(1, 3).granted  # the other inputs are not ours
    assert says(1, 2, 1).reason.startswith("the release contact was open for a moment")
    assert not says(1).granted
    release.close()
    owner.close()
    bus.shutdown()


def test_a_permit_that_was_taken_back_between_two_ticks_is_gone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And one that was there before it was asked for is no answer."""
    with talking(monkeypatch) as talk:
        talk.plc.registers.put(4, 0, 1)
        assert not talk.release.permit().granted
        talk.release.request()
        talk.until(lambda: talk.release.permit().granted)
        talk.plc.guard_closed = False
        talk.until(lambda: talk.plc.registers.get(4, 0) == (0,))
        talk.go_on()
        talk.plc.guard_closed = True
        talk.until(lambda: talk.plc.registers.get(4, 0) == (1,))
        talk.go_on()
        assert talk.release.permit().reason == (
            "the cell's PLC has taken its permit back for a moment"
        )
        talk.release.done(well=False)


def test_a_plc_sees_that_the_agent_hangs(tmp_path: Path) -> None:
    with cell(tmp_path, "modbus") as made:
        assert isinstance(made.release, FakePlc)
        hung: list[float] = []

        def stop_requested() -> str | None:
            now_s = made.rig.clock.now()
            if now_s > IN_THE_STAIR_S and not hung:
                hung.append(now_s)
                made.rig.later(AGENT_TIMEOUT_S + 0.5)
            return None

        request = CycleRequest(made.rig.cell, made.rig.cell.axis[0], tmp_path)
        with pytest.raises(Exception, match=r"."):
            drive_cycle(request, made.rig.clock, stop_requested=stop_requested)
        assert hung
        assert made.release.withdrawn_for_silence == 1
        assert abs(made.rig.drive.motor_velocity_rad_s) < REST_RAD_S


def test_a_map_of_another_device_is_refused(tmp_path: Path) -> None:
    def with_a_probes_map(description: dict[str, Any]) -> None:
        place = {"kind": "modbus", "tcp": "127.0.0.1:1", "map": "modmux-pm6rtd"}
        description["release"] = place

    wrong_map = pytest.raises(InputError, match="not for this handshake: it has no permit")
    with rig(tmp_path, edit=with_a_probes_map) as bench, wrong_map:
        bench.run()
