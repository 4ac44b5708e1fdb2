"""One variation of one fault on a whole cell: real frames, stepped time, the plant as the judge."""

from __future__ import annotations

import contextlib
import copy
import functools
import math
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from can.interfaces import virtual

from agent.cli.terminal.exits import exit_code
from agent.cycle import runner
from agent.errors import AgentError
from agent.record.reading import read
from agent.record.streams.stream import FLUSH_PERIOD_S, StreamWriter
from drivers.can.frames import CanBusConfig
from drivers.can.opening import open_bus as sound
from drivers.cia402.axis import Cia402Axis
from drivers.clock import SteppedClock
from drivers.errors import DriverError
from drivers.ports import StopReport
from fakes.fault import Fault
from fakes.fault_adapter import FaultyAdapter
from fakes.fault_wire import Wire
from fakes.faults import AdapterFails
from fakes.plc import FakeContact
from fakes.process import open_bus
from fakes.specification import FakeSpecification
from fakes.wire_faults import WireFault
from tests.faults.acts import ACTS, Stage
from tests.faults.aftermath import (
    Watch,
    kept_of,
    recording_troubles,
    registers,
    said_troubles,
    settings_troubles,
)
from tests.faults.scenario import Run, Scenario
from tests.system.rig import Rig, rig

AFTERWARDS_S = 0.3
SHORT = {"duration_s": 3.2, "speeds": 2}
REVERSAL_S = 0.1
WITH_RELEASE = ("open the release", "cut the release")
FOR_GOOD = ("power-cut", "unplugged", "sdo-silent", "sdo-aborts")
"""Faults of the drive itself, which no healed wire takes back."""

Span = tuple[float, float]
"""From when until when, in seconds."""


def play(
    scenario: Scenario,
    phase: str,
    seed: int,
    *,
    rate_hz: float = 100.0,
    place: CanBusConfig | None = None,
) -> Run:
    """Run one variation; `seed` draws the moment inside `phase` and the fault's parameters.

    `place` is another bus than one in memory to play it on, in the same stepped time: what is
    sent on the kernel's own, or to a multicast group on the loopback, has arrived when the call
    returns (`tests/quirks/test_python_can.py`), so that it is as repeatable as in memory.
    """
    random = np.random.default_rng(seed)
    release = scenario.act in WITH_RELEASE
    begins_s, ends_s = _one_of(random, timeline(rate_hz, release=release)[phase])
    onset_s = float(random.uniform(begins_s, ends_s))
    script = scenario.faults(onset_s, random)
    lasts_s = scenario.lasts_s.draw(random)
    with (
        tempfile.TemporaryDirectory() as name,
        _cell(Path(name), script, rate_hz, seed, release=release, place=place) as made,
    ):
        bench, watch, wire, contact = made
        stage = Stage(bench, onset_s, lasts_s, contact)
        with pytest.MonkeyPatch.context() as patch, contextlib.ExitStack() as stack:
            _count_rows(patch, watch, bench.clock)
            _note_stop(patch, watch, bench.clock)
            # Pauses of the collector belong to real time; here they would be half of the cost.
            patch.setattr(runner, "unhurried_collector", contextlib.nullcontext)
            # Nobody changes a frame's bytes after it was sent: a shallow copy for each listener.
            patch.setattr(virtual, "deepcopy", copy.copy)
            # Nobody cuts this computer's power; waiting for its disk would be a tenth of the cost.
            patch.setattr(os, "fsync", lambda _descriptor: None)
            _adapter(patch, bench.clock, [f for f in script if isinstance(f, AdapterFails)])
            stage.patch, stage.stack = patch, stack
            if scenario.act:
                ACTS[scenario.act](stage)
            found = registers(bench)
            error = _drive(bench, watch)
        bench.later(AFTERWARDS_S)
        troubles = recording_troubles(Path(name)) + said_troubles(error)
        troubles += settings_troubles(
            bench, wire, found, Path(name), heals=not any(f.kind in FOR_GOOD for f in script)
        )
        kept, lost, misplaced, doubtful = kept_of(Path(name), watch)
    begins_s = max(onset_s, watch.decided_s) if scenario.outcome == "either" else onset_s
    committed_s = math.inf if scenario.act != "fill the disk" else onset_s - FLUSH_PERIOD_S
    return Run(
        scenario=scenario,
        phase=phase,
        onset_s=onset_s,
        seed=seed,
        code=0 if error is None else exit_code(error),
        message="" if error is None else " ".join([str(error), *getattr(error, "__notes__", [])]),
        rest_after_s=max(0.0, watch.moved_s - begins_s) if watch.decided_s else 0.0,
        moves=watch.moves,
        handed_over=len(watch.rows_s),
        committed=sum(1 for row_s in watch.rows_s if row_s <= committed_s),
        kept=kept,
        lost=lost,
        misplaced_rad=misplaced,
        doubtful=doubtful,
        troubles=tuple(troubles),
    )


@functools.cache
def timeline(rate_hz: float, *, release: bool = False) -> dict[str, tuple[Span, ...]]:
    """Return when a cycle without a fault is in each of `scenario.PHASES`, by the cell's clock.

    The rig is deterministic: what happens when is the same in every run until the fault strikes.
    """
    began: list[float] = []
    with (
        tempfile.TemporaryDirectory() as name,
        _cell(Path(name), (), rate_hz, 1, release=release) as made,
    ):
        bench = made[0]
        result = bench.run(
            progress=lambda stage, _share: (
                began.append(bench.clock.now()) if stage == "enable" else None
            )
        )
        ended_s = bench.clock.now()
        columns = read(result.recording).columns
    time_s = columns["time_s"] + began[0]
    phase, command = columns["phase"], columns["velocity_command_rad_s"]
    turns = np.zeros(len(time_s), dtype=bool)
    moving = np.flatnonzero(command)
    flips = moving[1:][np.diff(np.sign(command[moving])) != 0]
    for index in flips:
        turns |= np.abs(time_s - time_s[index]) < REVERSAL_S
    masks = {
        "standstill": np.isin(phase, ["enable", "rest"]) & ~turns,
        "approach": (phase == "approach") & (command != 0.0),
        "ramp": (phase == "ramp") & ~turns,
        "plateau": phase == "steady",
        "reversal": turns,
        "return": (phase == "return") & (command != 0.0),
    }
    spans = {name: _spans(time_s, mask) for name, mask in masks.items()}
    return {**spans, "teardown": ((float(time_s[phase == "disable"][0]), ended_s),)}


def _spans(time_s: Any, mask: Any) -> tuple[Span, ...]:
    """Return the stretches in which `mask` holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return tuple(
        (float(time_s[first]), float(time_s[after - 1]))
        for first, after in zip(edges[::2], edges[1::2], strict=True)
    )


def _one_of(random: np.random.Generator, spans: tuple[Span, ...]) -> Span:
    return spans[int(random.integers(len(spans)))]


@contextlib.contextmanager
def _cell(
    folder: Path,
    script: tuple[Fault, ...],
    rate_hz: float,
    seed: int,
    *,
    release: bool,
    place: CanBusConfig | None = None,
) -> Iterator[tuple[Rig, Watch, Wire, FakeContact | None]]:
    """Yield a cell whose drive hangs on a bad wire, and the watch over its plant."""
    wires: list[Wire] = []

    def wire(bus: can.BusABC, clock: SteppedClock) -> can.BusABC:
        made = Wire(bus, [f for f in script if isinstance(f, WireFault)], seed)
        clock.attach(made.step_to)
        wires.append(made)
        return made

    def edit(description: dict[str, Any]) -> None:
        description["axis"][0]["stair"] |= SHORT
        description["recording"]["sample_rate_hz"] = rate_hz
        if release:
            description["release"] = {"kind": "can-input", "node_id": 31, "wait_s": 1.0}

    drives = [f for f in script if not isinstance(f, WireFault | AdapterFails)]
    watch = Watch(step_s=FakeSpecification().servo.step_s)
    with (
        rig(folder, faults=drives, edit=edit, seed=seed, wire=wire, place=place) as bench,
        contextlib.ExitStack() as stack,
    ):
        stack.callback(wires[0].shutdown)
        plant, contact = bench.drive.plant, None
        bench.clock.attach(
            lambda now_s: watch.look(now_s, plant.motor_position_rad, plant.motor_velocity_rad_s)
        )
        if release:
            told = bench.cell.bus
            bus = open_bus(told.interface, str(told.channel), options=told.options)
            stack.callback(bus.shutdown)
            contact = FakeContact(bus)
            bench.clock.attach(contact.step_to)
        bench.clock.settle()  # the drive and the wire are switched on at 0
        yield bench, watch, wires[0], contact


def _count_rows(patch: pytest.MonkeyPatch, watch: Watch, clock: SteppedClock) -> None:
    """Count every row that the recorder is given, and was not refused."""
    append = StreamWriter.append

    def counted(writer: StreamWriter, row: Any) -> None:
        append(writer, row)
        watch.rows_s.append(clock.now())

    patch.setattr(StreamWriter, "append", counted)


def _note_stop(patch: pytest.MonkeyPatch, watch: Watch, clock: SteppedClock) -> None:
    """Note when the agent begins to stop the axis."""
    stop = Cia402Axis.stop

    def noted(axis: Cia402Axis, deadline_s: float) -> StopReport:
        watch.decided_s = clock.now()
        return stop(axis, deadline_s)

    patch.setattr(Cia402Axis, "stop", noted)


def _adapter(patch: pytest.MonkeyPatch, clock: SteppedClock, faults: list[AdapterFails]) -> None:
    """Let the agent's own adapter fail; the drive's stays as it is."""
    if not faults:
        return
    patch.setattr(
        "drivers.can.owner.open_bus",
        lambda config: FaultyAdapter(sound(config), clock.now, faults),
    )


def _drive(bench: Rig, watch: Watch) -> AgentError | DriverError | None:
    """Run the cycle and return how it failed; what is not one of ours is a bug, and raised."""

    def note_begin(stage: str, _share: float) -> None:
        if stage == "enable" and math.isnan(watch.origin_s):
            watch.origin_s = bench.clock.now()

    try:
        bench.run(progress=note_begin)
    except (AgentError, DriverError) as error:
        return error
    return None
