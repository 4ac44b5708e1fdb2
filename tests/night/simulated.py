"""A cell's nights on a simulated clock: months in seconds, with faults."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from agent.night.attempt import Outcome
from agent.night.description import NightDescription
from agent.night.night import Night
from agent.night.windows import Window
from agent.record.events_file import Event

BERLIN = "Europe/Berlin"


def described(*axes: dict[str, Any], zone: str = BERLIN, **more: Any) -> NightDescription:
    """Return a night's description; an axis without a number is axis 1."""
    listed = [{"number": 1, "window": "22:00-05:00", **axis} for axis in (axes or ({},))]
    return NightDescription.model_validate(
        {"schema": "stribeck.night/1", "time_zone": zone, "axis": listed, **more}
    )


def utc(text: str) -> datetime.datetime:
    """Return a time in UTC."""
    return datetime.datetime.fromisoformat(text).replace(tzinfo=datetime.UTC)


@dataclass
class SimulatedWall:
    """A wall clock that waits by jumping; `jumps` is what others do to it when it gets there."""

    at: datetime.datetime
    jumps: list[tuple[datetime.datetime, datetime.datetime]] = field(default_factory=list)
    waits: int = 0

    def now(self) -> datetime.datetime:
        return self.at

    def wait_until(self, at: datetime.datetime, stopped: Callable[[], bool]) -> None:
        self.waits += 1
        assert self.waits < 200_000, "the night does not come to rest"
        if stopped() or at <= self.at:
            self.at += datetime.timedelta(microseconds=1)
            return
        if self.jumps and at >= self.jumps[0][0]:
            _, self.at = self.jumps.pop(0)
            return
        self.at = at + datetime.timedelta(milliseconds=7)  # no sleep ends on the dot


@dataclass
class SimulatedCell:
    """What the night reaches: a fault for a night where one was put, a gearbox that cools."""

    wall: SimulatedWall
    takes: datetime.timedelta = datetime.timedelta(minutes=4)
    faults: dict[tuple[int, str], Outcome | BaseException] = field(default_factory=dict)
    blocked_on: dict[str, str] = field(default_factory=dict)
    gearbox: Callable[[datetime.datetime], float | None] = lambda _now: None
    attempts: list[tuple[int, str, datetime.datetime]] = field(default_factory=list)

    def blocked(self, axis: int) -> str:
        return self.blocked_on.get(f"{axis}:{self.wall.now():%Y-%m-%d}", "")

    def needs(self, axis: int) -> datetime.timedelta:
        return datetime.timedelta(minutes=6 + axis)

    def temperature(self, axis: int) -> float | None:  # noqa: ARG002 - one gearbox is enough here
        return self.gearbox(self.wall.now())

    def attempt(self, window: Window) -> Outcome:
        began = self.wall.now()
        assert window.begins <= began < window.ends, "outside the quiet window"
        self.attempts.append((*window.key, began))
        self.wall.at += self.takes
        fault = self.faults.get(window.key)
        if isinstance(fault, BaseException):
            raise fault
        return fault or Outcome("run", "As before.", "ab" * 32)


@dataclass
class Watch:
    """A night with all that it has said; `again` starts the program anew, with its history."""

    description: NightDescription
    wall: SimulatedWall
    cell: SimulatedCell
    events: list[Event] = field(default_factory=list)

    @classmethod
    def over(cls, description: NightDescription, start: str) -> Watch:
        wall = SimulatedWall(utc(start))
        return cls(description, wall, SimulatedCell(wall))

    def night(self) -> Night:
        return Night(
            "r", self.description, self.cell, self.wall, self.events.append, tuple(self.events)
        )

    def run(self, until: str) -> Watch:
        self.night().run(lambda: False, utc(until))
        return self

    def kinds(self, axis: int = 1) -> list[str]:
        return [e.kind for e in self.events if e.axis == axis and e.kind not in ("begun", "wait")]

    def texts(self, kind: str) -> list[str]:
        return [e.text for e in self.events if e.kind == kind]
