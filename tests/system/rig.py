"""A whole cell in one process: the agent and the fake drive on one stepped clock, real frames."""

from __future__ import annotations

import secrets
import tomllib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import can
import tomli_w

from agent.cell.cell import Cell, parse_cell
from agent.cli.devices.fake_cell import fake_cell_text
from agent.cycle.ending import CycleResult
from agent.wire.wire import CycleRequest, drive_cycle
from drivers.can.frames import CanBusConfig
from drivers.clock import SteppedClock
from fakes.can_drive import FakeDrive
from fakes.fault import Fault
from fakes.process import open_bus
from fakes.specification import FakeSpecification

RATE_HZ = 250.0


@dataclass
class Rig:
    """One simulated cell; `run` drives a cycle on it."""

    folder: Path
    cell: Cell
    clock: SteppedClock
    drive: FakeDrive
    stop_reason: str | None = field(default=None)
    ask: Callable[[], str | None] | None = None  # in place of `stop_reason`, once a tick

    def run(
        self,
        *,
        reverse: bool = False,
        progress: Callable[[str, float], None] = lambda _stage, _share: None,
    ) -> CycleResult:
        return drive_cycle(
            CycleRequest(self.cell, self.cell.axis[0], self.folder, reverse),
            self.clock,
            stop_requested=self.ask or (lambda: self.stop_reason),
            progress=progress,
        )

    def at(self, time_s: float, act: Callable[[], None]) -> None:
        """Do something, once, when the cell's clock has come to `time_s`."""
        waiting = [act]

        def step_to(now_s: float) -> None:
            if waiting and now_s >= time_s:
                waiting.pop()()

        self.clock.attach(step_to)

    def later(self, seconds: float) -> None:
        """Let time pass without the agent: what does the drive do on its own?"""
        end_s = self.clock.now() + seconds
        while self.clock.now() < end_s:
            self.clock.sleep_until(self.clock.now() + 0.01)


@contextmanager
def rig(
    folder: Path,
    *,
    faults: Iterable[Fault] = (),
    specification: FakeSpecification | None = None,
    edit: Callable[[dict[str, Any]], None] = lambda _cell: None,
    seed: int = 1,
    wire: Callable[[can.BusABC, SteppedClock], can.BusABC] = lambda bus, _clock: bus,
    place: CanBusConfig | None = None,
) -> Iterator[Rig]:
    """Yield a cell with a short stair at 250 Hz; `edit` changes its description first.

    `wire` may put something between the drive and the bus; `place` is a bus to drive on whose
    frames have arrived when `send` returns: one in memory where it is None, the kernel's own,
    or multicast on the loopback.
    """
    specification = specification or FakeSpecification()
    place = place or CanBusConfig("virtual", f"rig-{secrets.token_hex(4)}")
    text = fake_cell_text(
        specification,
        interface=place.interface,
        channel=str(place.channel),
        options=place.options,
        short=True,
    )
    description = tomllib.loads(text)
    description["recording"]["sample_rate_hz"] = RATE_HZ
    edit(description)
    cell = parse_cell(tomli_w.dumps(description))
    clock = SteppedClock()
    bus = open_bus(place.interface, str(place.channel), options=place.options)
    try:
        drive = FakeDrive(
            wire(bus, clock),
            node_id=cell.axis[0].drive.node_id,
            specification=specification,
            faults=faults,
            seed=seed,
        )
        clock.attach(drive.step_to)
        yield Rig(folder, cell, clock, drive)
    finally:
        bus.shutdown()
