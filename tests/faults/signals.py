"""Signals to a real agent in motion: its drive lives in this process, where its plant is seen."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import can

from agent.cli.devices.fake_cell import fake_cell_text
from agent.cycle.precedence import PRIORITY, before_others
from agent.record.streams.recover import recover
from drivers.can.frames import CanBusConfig
from drivers.clock import MonotonicClock
from fakes.can_drive import FakeDrive
from fakes.process import POLL_S, Arrivals, LateClock, open_bus
from fakes.specification import FakeSpecification
from tests.system.processes import STRIBECK, be_patient, multicast

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGKILL, signal.SIGSTOP)
STATED_S = 1.5
"""Heartbeat time-out (1 s, for a loaded test machine), braking (0.16 s), ringing (0.2 s)."""

REST_RAD_S = 0.5
QUIET_S = 0.5
STARTS_WITHIN_S = 300.0


@dataclass(frozen=True)
class SignalRun:
    """What became of a run that got a signal: as `tests.faults.scenario.Run` has it."""

    number: signal.Signals
    code: int
    rest_after_s: float
    moves: bool
    rows: int
    journal: bool
    message: str

    def objections(self) -> list[str]:
        """Return everything that is not as it must be."""
        found = ["the joint still moves"] if self.moves else []
        if self.rest_after_s > STATED_S:
            found.append(f"rest after {self.rest_after_s:.2f} s")
        codes = {signal.SIGKILL: (-signal.SIGKILL,), signal.SIGSTOP: (4, 5)}.get(self.number, (5,))
        if self.code not in codes:
            found.append(f"exit code {self.code}, expected one of {codes}: {self.message}")
        if self.number is signal.SIGKILL:
            if not self.journal:
                found.append("no journal was left")
        elif not re.search("at rest|use the E-stop", self.message):
            found.append(f"nothing said of the joint: {self.message}")
        if not self.rows:
            found.append("nothing of the recording can be read")
        return found


class _Drive:
    """The fake in this process, in real time, and when its motor was last seen to move.

    A frame counts when it came, as in `stribeck fake`: a heartbeat that this process takes 30 ms
    late beside other programs would hold the drive's watchdog up by as much, and a watchdog that
    is late is rightly refused before the first motion.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus
        self._drive = FakeDrive(bus)
        self._arrivals, self._clock = Arrivals(LateClock()), MonotonicClock()
        self.moved_s = 0.0

    def now(self) -> float:
        return self._clock.now()

    def step(self) -> float:
        """Live for a millisecond; return the motor's speed."""
        looked_s = time.perf_counter()
        message = self._bus.recv(POLL_S)
        self._drive.step_to(self._arrivals.moment_of(message, looked_s), message)
        speed = abs(self._drive.motor_velocity_rad_s)
        if speed > REST_RAD_S:
            self.moved_s = self._clock.now()
        return speed

    def live(self, seconds: float) -> None:
        end_s = self.now() + seconds
        while self.now() < end_s:
            self.step()


def signalled(
    number: signal.Signals, after_s: float, *, place: CanBusConfig | None = None
) -> SignalRun:
    """Run the agent, send it a signal `after_s` after the joint began to move, and see.

    `place` is the bus to run on; where it is None, multicast on a port of its own.
    """
    place = place or multicast()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cell, log, out = folder / "cell.toml", folder / "run.log", folder / "out"
        specification = FakeSpecification()
        cell.write_text(
            fake_cell_text(
                specification,
                interface=place.interface,
                channel=str(place.channel),
                options=place.options,
                short=True,
            ).replace("sample_rate_hz = 500.0", "sample_rate_hz = 100.0")
        )
        be_patient(cell)
        bus = open_bus(place.interface, str(place.channel), options=place.options)
        try:
            with log.open("wb") as sink:
                command = [*STRIBECK, "run", str(cell), "--axis", "1", "--out", str(out)]
                agent = subprocess.Popen(
                    command, stdout=sink, stderr=sink, stdin=subprocess.DEVNULL
                )
            try:
                with before_others(PRIORITY + 1):  # a drive has a processor of its own
                    return _seen(_Drive(bus), agent, number, after_s, folder)
            finally:
                if agent.poll() is None:
                    agent.kill()
                    agent.wait()
        finally:
            bus.shutdown()


def _seen(
    drive: _Drive,
    agent: subprocess.Popen[bytes],
    number: signal.Signals,
    after_s: float,
    folder: Path,
) -> SignalRun:
    log, out = folder / "run.log", folder / "out"
    deadline_s = time.monotonic() + STARTS_WITHIN_S
    while drive.step() < 1.0:
        assert agent.poll() is None, log.read_text()
        assert time.monotonic() < deadline_s, log.read_text()
    drive.live(after_s)
    sent_s = drive.now()
    os.kill(agent.pid, number)
    drive.live(STATED_S + QUIET_S)
    rest_after_s = max(0.0, drive.moved_s - sent_s)
    if number is signal.SIGSTOP:
        os.kill(agent.pid, signal.SIGCONT)
    deadline_s = time.monotonic() + STARTS_WITHIN_S
    while agent.poll() is None and time.monotonic() < deadline_s:
        drive.step()
    moves = drive.step() > REST_RAD_S
    journal = any((folder / "recordings").glob(".*.found.json"))
    recovered = sum(result.samples for result in recover(out))
    said = " ".join(log.read_text(errors="replace").split())
    finished = recovered or len(list(out.glob("*.parquet")))
    code = agent.returncode if agent.returncode is not None else 0
    return SignalRun(number, code, rest_after_s, moves, finished, journal, said[-600:])
