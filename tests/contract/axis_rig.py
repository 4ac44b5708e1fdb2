"""A drive and an axis on one bus, stepped or in real time, for tests that hold for both."""

from __future__ import annotations

import itertools
import math
import os
import socket
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import can
import pytest

from drivers.can.owner import CanBusConfig, CanBusOwner
from drivers.cia402.axis import Cia402Axis
from drivers.cia402.config import Cia402Config
from drivers.cia402.modes import RUNGS, Rung
from drivers.cia402.network import CanopenNode
from drivers.cia402.objects import setting_of
from drivers.cia402.scaling import Scaling, TemperatureSource
from drivers.cia402.sdo import SdoAccess
from drivers.clock import Clock, MonotonicClock, SteppedClock
from drivers.ports import Command, DriveState, Goal, Move, Sample, SetPoints
from fakes.can_drive import FakeDrive
from fakes.fault import Fault
from fakes.process import run_process
from fakes.specification import FakeSpecification

NODE = 5
VIRTUAL, MULTICAST, SOCKETCAN = "virtual", "udp_multicast", "socketcan"
CHANNEL_VARIABLE = "STRIBECK_CAN_CHANNEL"
OTHER_MODES = ("csv", "vl", "csp", "ip", "pp")
"""Each on the stepped bus besides pv, which is held on every bus."""
STEPPED = "stepped"
"""After the name of a bus: in simulated time there, too, with frames that a kernel delivers."""
EVERY_MODE = 0b1_1100_0111
_CHANNELS = itertools.count()


def interfaces() -> list[Any]:
    """Return the buses to hold the contract on, all in simulated time.

    A real CAN bus is among them where CHANNEL_VARIABLE names one: `tests/bus/test_on_vcan.py`
    does, in User-Mode Linux where the host has none. What is sent there, or to a multicast group
    on the loopback, has arrived when the call returns (`tests/quirks/test_python_can.py`).
    """
    stepped = [VIRTUAL, *(f"{VIRTUAL}/{word}" for word in OTHER_MODES), f"{MULTICAST}/{STEPPED}"]
    if CHANNEL_VARIABLE not in os.environ:
        return stepped
    return [*stepped, pytest.param(f"{SOCKETCAN}/{STEPPED}", marks=pytest.mark.bus)]


def in_real_time() -> list[Any]:
    """Return the buses on which what hangs on a clock that nobody steps is held, too."""
    real = [pytest.param(MULTICAST, marks=pytest.mark.real_time)]
    if CHANNEL_VARIABLE in os.environ:
        real.append(pytest.param(SOCKETCAN, marks=[pytest.mark.bus, pytest.mark.real_time]))
    return real


CONFIG = Cia402Config(
    node_id=NODE,
    scaling=Scaling(encoder_counts_per_motor_rev=65536, rated_torque_nm=5.0),
    acceleration_rad_s2=500.0,
    deceleration_rad_s2=500.0,
    quick_stop_deceleration_rad_s2=2000.0,
    software_limits_rad=(-4000.0, 4000.0),
    temperature=TemperatureSource(0x2100, 1, sentinels=(-32768,)),
    stop_period_s=0.004,
)
PATIENT = replace(
    CONFIG,
    sync_timeout_s=0.25,
    agent_heartbeat_timeout_s=0.5,
    drive_heartbeat_timeout_s=1.5,
    state_timeout_s=5.0,
)
"""For real time on a machine that has other things to do."""

VERY_PATIENT = replace(
    PATIENT,
    sync_timeout_s=0.5,
    agent_heartbeat_timeout_s=1.5,
    drive_heartbeat_timeout_s=3.0,
)
"""For a real bus inside User-Mode Linux, which has one slow processor for everybody."""


class Pilot:
    """Turns "that velocity, please" into the set-points that a mode is fed with."""

    RAMP_RAD_S2 = 500.0
    FAR_RAD = 1000.0

    def __init__(self, set_points: SetPoints) -> None:
        self.set_points = set_points
        self._position_rad = self._velocity_rad_s = 0.0
        self._move: Move | None = None
        self._enabled = False

    def seen(self, samples: Iterable[Sample]) -> None:
        """Follow the joint as long as it is not led."""
        for sample in samples:
            self._enabled = sample.state is DriveState.ON
            if not self._enabled or self._move is None:
                self._where_rad = sample.position_rad
            if not self._enabled:
                self._position_rad, self._velocity_rad_s = sample.position_rad, 0.0
                self._move = None

    _where_rad = 0.0

    def order(self, command: Command, period_s: float) -> Command:
        """Return the command with the set-point of the mode."""
        if command.goal is not Goal.ON or self.set_points is SetPoints.VELOCITY:
            return command
        wanted = command.velocity_rad_s
        if self.set_points is SetPoints.POSITION:
            if self._enabled:
                step = self.RAMP_RAD_S2 * period_s
                change = min(max(wanted - self._velocity_rad_s, -step), step)
                self._velocity_rad_s += change
                self._position_rad += self._velocity_rad_s * period_s
            return command._replace(position_rad=self._position_rad)
        if self._enabled and wanted and self._move is None:
            end_rad = self._where_rad + math.copysign(self.FAR_RAD, wanted)
            self._move = Move(1, end_rad, abs(wanted))
        return command._replace(move=self._move)


@dataclass
class Rig:
    """One fake drive on a bus; `axis` makes the product's side of it."""

    bus: CanBusConfig
    clock: Clock
    owner: CanBusOwner
    config: Cia402Config
    drive: FakeDrive | None  # None where it runs in a thread of its own
    pilot: Pilot = field(default_factory=lambda: Pilot(SetPoints.VELOCITY))

    @property
    def rung(self) -> Rung:
        """Return the mode that this rig is in."""
        return RUNGS["pv" if self.config.mode == "auto" else self.config.mode]

    def send(self, axis: Cia402Axis, command: Command, period_s: float = 0.004) -> None:
        """Send an order for a velocity, as the mode wants it."""
        axis.send(self.pilot.order(command, period_s))

    def receive(self, axis: Cia402Axis) -> tuple[Sample, ...]:
        """Return what the axis received."""
        samples = axis.receive()
        self.pilot.seen(samples)
        return samples

    def axis(self, **changes: Any) -> Cia402Axis:
        """Return an axis on this bus, its configuration changed as asked."""
        return Cia402Axis(self.owner, replace(self.config, **changes), self.clock)

    def run(
        self, axis: Cia402Axis, duration_s: float, command: Command, period_s: float = 0.004
    ) -> list[Sample]:
        """Tick for a while and return the samples; errors of `receive` pass."""
        samples: list[Sample] = []
        end_s = self.clock.now() + duration_s
        while (now_s := self.clock.now()) < end_s:
            self.send(axis, command, period_s)
            self.clock.sleep_until(now_s + period_s)
            samples += self.receive(axis)
        return samples

    def enable(
        self, axis: Cia402Axis, velocity_rad_s: float, shown_rad_s: float | None = None
    ) -> Sample:
        """Drive until that speed, or another one, is shown and return the sample that says so."""
        expected_rad_s = velocity_rad_s if shown_rad_s is None else shown_rad_s
        deadline_s = self.clock.now() + 5.0
        while self.clock.now() < deadline_s:
            for sample in self.run(axis, 0.02, Command(Goal.ON, velocity_rad_s)):
                close = abs(sample.velocity_rad_s - expected_rad_s) < 0.5
                if close and sample.state is DriveState.ON:
                    return sample
        raise AssertionError(f"{expected_rad_s} rad/s was not reached within 5 s")

    def inject(self, cob_id: int, data: bytes) -> None:
        """Say something on the bus as somebody else."""
        with open_bus(self.bus) as bus:
            bus.send(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))
            self.clock.sleep_until(self.clock.now() + 0.01)

    @contextmanager
    def sdo(self) -> Iterator[SdoAccess]:
        """Look into the drive while no axis is open."""
        node = CanopenNode(self.owner, self.clock, NODE, 0.3)
        try:
            yield SdoAccess(node, attempts=3)
        finally:
            node.release()

    def values(self, keys: Iterable[str]) -> dict[str, int]:
        """Read a snapshot's objects from the drive."""
        with self.sdo() as sdo:
            return {key: sdo.read(setting_of(key)) for key in keys}


@contextmanager
def open_bus(config: CanBusConfig) -> Iterator[can.BusABC]:
    """Open a second end of the bus."""
    options = {"hop_limit": 0} if config.interface == MULTICAST else {}
    bus = can.Bus(
        interface=config.interface,
        channel=config.channel,
        ignore_config=True,
        **{**options, **config.options},
    )
    try:
        yield bus
    finally:
        bus.shutdown()


def describe_bus(interface: str) -> CanBusConfig:
    """Return a bus that no other test uses."""
    if interface == VIRTUAL:
        return CanBusConfig(VIRTUAL, f"axis-{next(_CHANNELS)}")
    if interface == MULTICAST:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        return CanBusConfig(MULTICAST, "239.74.163.2", options={"port": port})
    return CanBusConfig(SOCKETCAN, os.environ[CHANNEL_VARIABLE])


@contextmanager
def open_rig(
    interface: str,
    faults: Iterable[Fault] = (),
    specification: FakeSpecification | None = None,
) -> Iterator[Rig]:
    """Yield a rig whose drive is in process (stepped) or in a thread (real time).

    `interface` may name a mode after a slash; the drive then offers every mode. Or `STEPPED`.
    """
    interface, _, mode = interface.partition("/")
    stepped = interface == VIRTUAL or mode == STEPPED
    mode = "" if mode == STEPPED else mode
    config = describe_bus(interface)
    if mode:
        given = specification or FakeSpecification()
        every = replace(given.drive, supported_modes=EVERY_MODE)
        specification = replace(given, drive=every)
    if stepped:
        with open_bus(config) as bus:
            clock = SteppedClock()
            drive = FakeDrive(bus, node_id=NODE, faults=faults, specification=specification)
            clock.attach(drive.step_to)
            yield from _owned(config, clock, replace(CONFIG, mode=mode or "auto"), drive)
        return
    stop = threading.Event()
    thread = threading.Thread(
        target=run_process,
        args=(config.interface, str(config.channel)),
        kwargs={
            "stop": stop,
            "node_id": NODE,
            "faults": faults,
            "specification": specification,
            "options": config.options,
        },
    )
    thread.start()
    try:
        patience = PATIENT if interface == MULTICAST else VERY_PATIENT
        yield from _owned(config, MonotonicClock(), patience, None)
    finally:
        stop.set()
        thread.join()


def _owned(
    bus: CanBusConfig, clock: Clock, config: Cia402Config, drive: FakeDrive | None
) -> Iterator[Rig]:
    """Yield the rig and let go of the bus, whatever the test left open."""
    owner = CanBusOwner.open(bus, clock)
    try:
        rung = RUNGS["pv" if config.mode == "auto" else config.mode]
        yield Rig(bus, clock, owner, config, drive, Pilot(rung.set_points))
    finally:
        owner.close()
