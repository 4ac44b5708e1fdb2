"""What was done to a joint, after which its friction is another: swap, oil change, relubrication.

An event starts a new baseline. It comes from the recordings (a serial number or the oil's name is
another one than before; the key ``event``) or from a file that people keep, `events.toml`::

    schema = "stribeck.events/1"

    [[events]]
    at = 2026-03-14T09:00:00Z      # the first cycle from then on belongs to the new baseline
    kind = "oil-change"            # swap, oil-change, relubrication or other
    robot = "cell7-irb6650"        # optional: without robot and axis it is every joint's
    axis = 2
    note = "gearbox drained, 2.3 l of the new oil"
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from itertools import pairwise
from typing import Any

from agent.monitor.history.cycle import Cycle, Joint

SCHEMA = "stribeck.events/1"
KINDS: Mapping[str, str] = {
    "swap": "swap",
    "oil-change": "oil change",
    "relubrication": "relubrication",
    "other": "work on the joint",
}
_KEYS = {"at", "kind", "robot", "axis", "note"}
_SHORT_RUN = 2


@dataclass(frozen=True)
class Event:
    """One event.

    Parameters
    ----------
    at_s : float
        Seconds since 1970, UTC; cycles that start then or later come after it.
    kind : str
        One of `KINDS`.
    note : str
    robot : str or None
        None for every robot.
    axis : int or None
        None for every axis.
    """

    at_s: float
    kind: str
    note: str = ""
    robot: str | None = None
    axis: int | None = None

    def concerns(self, joint: Joint) -> bool:
        """Tell whether it was done to this joint."""
        return self.robot in (None, joint.robot) and self.axis in (None, joint.axis)

    @property
    def label(self) -> str:
        """Return the event in words."""
        return KINDS[self.kind] + (f" ({self.note})" if self.note else "")

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        at = datetime.fromtimestamp(self.at_s, UTC).isoformat(timespec="seconds")
        return {"at": at, "kind": self.kind, "note": self.note}


def parse_events(document: Mapping[str, Any]) -> tuple[Event, ...]:
    """Return the events of an `events.toml`, in order of time.

    Raises
    ------
    ValueError
        One sentence: which entry, what was expected, what came.
    """
    if document.get("schema") != SCHEMA:
        raise ValueError(f'expected schema = "{SCHEMA}", got {document.get("schema")!r}')
    entries = document.get("events", [])
    if not isinstance(entries, list) or not all(isinstance(e, Mapping) for e in entries):
        raise ValueError("expected [[events]] tables")
    found = [_event(e, f"event {i}") for i, e in enumerate(entries, start=1)]
    return tuple(sorted(found, key=lambda e: e.at_s))


def _event(entry: Mapping[str, Any], where: str) -> Event:
    unknown = sorted(set(entry) - _KEYS)
    if unknown:
        raise ValueError(
            f"{where}: {', '.join(unknown)} is no key ({', '.join(sorted(_KEYS))} are)"
        )
    kind, axis, robot = entry.get("kind"), entry.get("axis"), entry.get("robot")
    if not isinstance(kind, str) or kind not in KINDS:
        raise ValueError(f"{where}: kind must be one of {', '.join(KINDS)}, got {kind!r}")
    if axis is not None and (not isinstance(axis, int) or isinstance(axis, bool)):
        raise ValueError(f"{where}: axis must be a whole number, got {axis!r}")
    if robot is not None and not isinstance(robot, str):
        raise ValueError(f"{where}: robot must be text, got {robot!r}")
    return Event(_moment(entry.get("at"), where), kind, str(entry.get("note", "")), robot, axis)


def _moment(value: object, where: str) -> float:
    """Return seconds since 1970 of a TOML date or time, or of the same as text; UTC by default."""
    moment = value
    if isinstance(value, str):
        try:
            moment = datetime.fromisoformat(value)
        except ValueError:
            moment = None
    if isinstance(moment, date) and not isinstance(moment, datetime):
        moment = datetime(moment.year, moment.month, moment.day, tzinfo=UTC)
    if not isinstance(moment, datetime):
        raise ValueError(f"{where}: at must be a date or a time, got {value!r}")
    return (moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)).timestamp()


def events_between(before: Cycle, after: Cycle) -> tuple[Event, ...]:
    """Return what the recordings of two successive cycles say was done between them."""
    found = []
    for part in sorted(before.parts.keys() & after.parts.keys()):
        if before.parts[part] != after.parts[part]:
            change = f"{part} {before.parts[part]} to {after.parts[part]}"
            found.append(Event(after.started_s, "swap", change))
    if before.oil and after.oil and before.oil != after.oil:
        found.append(Event(after.started_s, "oil-change", f"{before.oil} to {after.oil}"))
    return (*found, *events_said(after))


def events_said(cycle: Cycle) -> tuple[Event, ...]:
    """Return the event that a recording itself says came right before it."""
    if not cycle.event:
        return ()
    if cycle.event in KINDS:
        return (Event(cycle.started_s, cycle.event, "as its recording says"),)
    return (Event(cycle.started_s, "other", cycle.event),)


def visitors(cycles: Sequence[Cycle]) -> list[int]:
    """Return which cycles, in order of time, are of other parts than those before and after.

    A gearbox is not swapped for one night and then swapped back: one or two such cycles in a row
    are another joint's that go by this one's name.
    """
    starts = [0, *(i for i, (a, b) in enumerate(pairwise(cycles), 1) if _swapped(a, b))]
    runs = list(pairwise([*starts, len(cycles)]))
    found: list[int] = []
    for (before, _), (start, stop) in pairwise(runs[:-1]):
        returned = not _swapped(cycles[start - 1], cycles[stop])
        if returned and stop - start <= _SHORT_RUN and before not in found:
            found.extend(range(start, stop))
    return found


def _swapped(before: Cycle, after: Cycle) -> bool:
    both = before.parts.keys() & after.parts.keys()
    return any(before.parts[part] != after.parts[part] for part in both)
