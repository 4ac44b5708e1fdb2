"""What of an event is news: told when something changes, then reminded of sparsely.

The rule, for each axis:

- An **alarm** is told when it begins, when it has got worse (`WORSE_PERCENT` more of friction at
  low or high speed than anything told or acknowledged of it, or a higher state), and else every
  `REMIND_DAYS`. Acknowledged, it is silent until it gets worse, which asks to be acknowledged
  again. It ends with a cycle without alarm, which is told to whoever wants alarms.
- A **skip** or a **missed** window for the same reason as the last one is told every `REMIND_DAYS`.
- Everything else is told each time: a joint that was stopped is never old news.

Every event is recorded, told or not, and what follows every event (MQTT) gets every event.
"""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from agent.record.events_file import Event

REMIND_DAYS = 7.0
WORSE_PERCENT = 5.0
NEW, WORSE, REMINDER, CLEARED, SILENT = "new", "worse", "reminder", "cleared", "silent"
KEY = "told"
"""The key of an event's details that says which of these it was."""

_CYCLES = ("run", "alarm")
_REPEATED = ("skip", "missed")
_ACKNOWLEDGED = "acknowledged"


def judged(event: Event, history: Iterable[Event]) -> Event:
    """Return the event with what it is as news in its details.

    Parameters
    ----------
    event : Event
        What has just happened.
    history : iterable of Event
        Everything that happened before, oldest first.
    """
    mine = [e for e in history if (e.robot, e.axis) == (event.robot, event.axis)]
    kind = ""
    if event.kind == "alarm":
        kind = _alarm(event, mine)
    elif event.kind == "run" and _streak(mine):
        kind = CLEARED
    elif event.kind in _REPEATED:
        kind = _repeated(event, mine)
    return replace(event, details={**event.details, KEY: kind}) if kind else event


def is_silent(event: Event) -> bool:
    """Return whether nobody needs to be told who was told before."""
    return event.details.get(KEY) == SILENT


def _alarm(event: Event, mine: Sequence[Event]) -> str:
    streak = _streak(mine)
    if not streak:
        return NEW
    said = [e for e in streak if not is_silent(e)] or streak[:1]
    looked_at = [e for e in mine if e.kind == _ACKNOWLEDGED and _moment(e) >= _moment(streak[0])]
    known = said + [e for e in streak if looked_at and _moment(e) <= _moment(looked_at[-1])]
    if _size(event) >= max(map(_size, known)) + WORSE_PERCENT:
        return WORSE
    if _rank(event) > max(map(_rank, known)):
        return WORSE
    if looked_at and _moment(looked_at[-1]) >= _moment(said[-1]):
        return SILENT
    return REMINDER if _days(said[-1], event) >= REMIND_DAYS else SILENT


def _streak(mine: Sequence[Event]) -> list[Event]:
    """Return the alarms since the last cycle without one."""
    out: list[Event] = []
    for event in mine:
        if event.kind in _CYCLES:
            out = [*out, event] if event.kind == "alarm" else []
    return out


def _repeated(event: Event, mine: Sequence[Event]) -> str:
    """Judge a skip or a missed window: the same words as last time, numbers aside, are no news."""
    said: Event | None = None
    for before in mine:
        if before.kind == event.kind and _words(before) == _words(event):
            said = said if said is not None and is_silent(before) else before
        elif before.kind in (*_CYCLES, *_REPEATED, "stopped", "failed"):
            said = None
    if said is None:
        return NEW
    return REMINDER if _days(said, event) >= REMIND_DAYS else SILENT


def _size(event: Event) -> float:
    """Return the larger of an alarm's changes in per cent; none where it does not say."""
    facts = event.details.get("facts")
    sizes = []
    for name in ("low", "high"):
        effect = facts.get(name) if isinstance(facts, Mapping) else None
        percent = effect.get("percent") if isinstance(effect, Mapping) else None
        if isinstance(percent, int | float) and math.isfinite(percent):
            sizes.append(abs(float(percent)))
    return max(sizes, default=0.0)


def _rank(event: Event) -> str:
    """Return the state, which sorts as it grows: NF, then H0, then H1."""
    return {"H0": "1", "H1": "2"}.get(str(event.details.get("state", "")), "0")


def _words(event: Event) -> str:
    return re.sub(r"[\d.,:+−-]+", "", event.text)


def _days(earlier: Event, later: Event) -> float:
    return (_moment(later) - _moment(earlier)).total_seconds() / 86400.0


def _moment(event: Event) -> datetime.datetime:
    """Return when an event was; what is no time is of the distant past."""
    try:
        at = datetime.datetime.fromisoformat(event.at)
    except ValueError:
        at = datetime.datetime.min
    return at if at.tzinfo is not None else at.replace(tzinfo=datetime.UTC)
