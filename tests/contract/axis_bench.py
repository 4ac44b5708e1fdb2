"""One bench for each implementation of the port `Axis`, so that one contract holds for all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from drivers.clock import Clock, MonotonicClock, SteppedClock
from drivers.ports import (
    Axis,
    Command,
    DriveState,
    Goal,
    Quality,
    Sample,
    SetPoints,
    TemperatureReading,
)
from drivers.probed_axis import ProbedAxis
from drivers.recorded import Recorded
from drivers.replay import ReplayAxis
from tests.contract.axis_rig import VIRTUAL, Pilot, in_real_time, interfaces, open_rig

SPEED_RAD_S = 20.0
"""What the contract drives at; the replay's recording was driven with it."""

PERIOD_S = 0.004
REST_RAD_S = 0.5


@dataclass(frozen=True)
class AxisBench:
    """An implementation of the port with something behind it.

    Parameters
    ----------
    axis : callable
        Makes an axis object that was never opened.
    clock : Clock
        The one that it lives on.
    pilot : Pilot
        Turns a velocity into what the axis is fed with.
    """

    axis: Callable[[], Axis]
    clock: Clock
    pilot: Pilot = field(default_factory=lambda: Pilot(SetPoints.VELOCITY))

    def send(self, axis: Axis, command: Command) -> None:
        """Send an order for a velocity, as the axis wants it."""
        axis.send(self.pilot.order(command, PERIOD_S))

    def receive(self, axis: Axis) -> tuple[Sample, ...]:
        """Return what the axis received."""
        samples = axis.receive()
        self.pilot.seen(samples)
        return samples

    def run(self, axis: Axis, duration_s: float, command: Command) -> list[Sample]:
        """Tick for a while and return the samples."""
        samples: list[Sample] = []
        end_s = self.clock.now() + duration_s
        while (now_s := self.clock.now()) < end_s:
            self.send(axis, command)
            self.clock.sleep_until(now_s + PERIOD_S)
            samples += self.receive(axis)
        return samples

    def until(
        self, axis: Axis, command: Command, seen: Callable[[Sample], bool], patience_s: float = 5.0
    ) -> list[Sample]:
        """Tick until a sample is as expected and return all up to and with those of its tick."""
        samples: list[Sample] = []
        end_s = self.clock.now() + patience_s
        while self.clock.now() < end_s:
            newest = self.run(axis, PERIOD_S, command)
            samples += newest
            if any(map(seen, newest)):
                return samples
        raise AssertionError(f"not seen within {patience_s} s; the last was {samples[-1:]}")

    def at_speed(self, axis: Axis) -> list[Sample]:
        """Enable and drive until `SPEED_RAD_S` is measured."""
        return self.until(
            axis,
            Command(Goal.ON, SPEED_RAD_S),
            lambda s: abs(s.velocity_rad_s - SPEED_RAD_S) < 0.5 and s.state is DriveState.ON,
        )


class _Thermometer:
    """A probe that always answers."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def open(self) -> Mapping[str, str | int | float]:
        return {"kind": "test"}

    def latest(self) -> TemperatureReading:
        return TemperatureReading(25.0, self._clock.now(), Quality.GOOD)

    def close(self) -> None:
        pass


def driven_and_stopped() -> Recorded:
    """Return 1.5 s of an axis that is enabled, driven at `SPEED_RAD_S`, stopped, and stands."""
    time_s = PERIOD_S * np.arange(376, dtype=np.float64)
    velocity_rad_s = np.interp(
        time_s, [0.0, 0.02, 0.06, 1.0, 1.04, 1.5], [0.0, 0.0, SPEED_RAD_S, SPEED_RAD_S, 0.0, 0.0]
    )
    return Recorded(
        time_s=time_s,
        position_rad=PERIOD_S * np.cumsum(velocity_rad_s),
        velocity_rad_s=velocity_rad_s,
        torque_nm=0.6 * np.sign(velocity_rad_s) + 0.01 * velocity_rad_s,
        velocity_command_rad_s=velocity_rad_s,
        enabled_from=3,
        begins_with_enabling=True,
        identity={"name": "replay"},
    )


@contextmanager
def open_bench(kind: str) -> Iterator[AxisBench]:
    """Yield the bench of one of `kinds`: ``replay-...``, ``probed``, or ``cia402-BUS``."""
    if kind.startswith("replay"):
        clock: Clock = SteppedClock() if kind.endswith("stepped") else MonotonicClock()
        yield AxisBench(lambda: ReplayAxis(driven_and_stopped(), clock), clock)
        return
    with open_rig(VIRTUAL if kind == "probed" else kind.removeprefix("cia402-")) as rig:
        if kind == "probed":
            thermometer = _Thermometer(rig.clock)
            yield AxisBench(lambda: ProbedAxis(rig.axis(), thermometer, 1.0), rig.clock)
        else:
            yield AxisBench(rig.axis, rig.clock, rig.pilot)


def kinds() -> list[Any]:
    """Return every implementation in simulated time, the drive's on each bus; marks are kept."""
    return [*_drives(interfaces()), "probed", "replay-stepped"]


def kinds_in_real_time() -> list[Any]:
    """Return those of them that keep time with the machine's clock, too."""
    return [
        *_drives(in_real_time()),
        pytest.param("replay-real", marks=pytest.mark.real_time),
    ]


def _drives(buses: list[Any]) -> list[Any]:
    return [
        f"cia402-{bus}"
        if isinstance(bus, str)
        else pytest.param(*(f"cia402-{name}" for name in bus.values), marks=bus.marks)
        for bus in buses
    ]
