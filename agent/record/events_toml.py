"""What people wrote down of joints in ``events.toml``, as events of the catalogue.

`agent.monitor.history.events` says what its entries mean for a baseline, and refuses what it cannot
judge by; here each entry is kept as it was written, so that swaps and oil changes can be asked for
in one place, wherever somebody noted them. The file may be edited: its rows are made anew when it
has changed.
"""

from __future__ import annotations

import datetime
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from agent.record.events_file import Event

NAME = "events.toml"


def read_written(folder: Path) -> tuple[tuple[tuple[int, Event], ...], tuple[str, ...]]:
    """Return the entries of a folder's file with their numbers from 1, and what is wrong with it.

    A file that is not there has none. Nothing is raised: whoever judges by the file refuses it.
    """
    path = folder / NAME
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        return (), ()
    except (OSError, ValueError) as error:
        return (), (f"{path}: cannot be read ({error}).",)
    entries = document.get("events", [])
    if not isinstance(entries, list):
        return (), (f"{path}: expected [[events]] tables.",)
    events, problems = [], []
    for number, entry in enumerate(entries, 1):
        try:
            events.append((number, _event(entry)))
        except (KeyError, TypeError, ValueError) as error:
            problems.append(f"{path}: event {number} is none ({error}).")
    return tuple(events), tuple(problems)


def _event(entry: object) -> Event:
    if not isinstance(entry, Mapping):
        raise TypeError("expected a table")
    kind, robot, axis = entry["kind"], entry.get("robot", ""), entry.get("axis")
    if not isinstance(kind, str) or not isinstance(robot, str):
        raise TypeError("kind and robot must be text")
    if axis is not None and (isinstance(axis, bool) or not isinstance(axis, int)):
        raise TypeError("axis must be a whole number")
    return Event(_in_utc(entry["at"]), kind, str(entry.get("note", "")), robot, axis)


def _in_utc(at: Any) -> str:
    """Return a TOML date or time, or the same as text, as ISO 8601; UTC where it has no zone."""
    if isinstance(at, str):
        at = datetime.datetime.fromisoformat(at)
    if isinstance(at, datetime.date) and not isinstance(at, datetime.datetime):
        at = datetime.datetime(at.year, at.month, at.day)
    if not isinstance(at, datetime.datetime):
        raise TypeError(f"at must be a date or a time, got {at!r}")
    aware = at if at.tzinfo is not None else at.replace(tzinfo=datetime.UTC)
    text = aware.astimezone(datetime.UTC).isoformat(timespec="milliseconds")
    return text.replace("+00:00", "Z")
