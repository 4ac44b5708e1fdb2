"""What happened to a joint or at night: ``events.jsonl``, one JSON object a line, only ever longer.

The file is the truth, and the catalogue's table of events is made from it. A line is appended
under the system's lock and is on the disk before anybody is told; a last line that a power cut has
torn is passed over, and said.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from agent.errors import InputError
from agent.record.atomic import storage_error, sync, sync_folder, write_all
from agent.record.lock import try_lock

NAME = "events.jsonl"
_TRIES, _PAUSE_S = 500, 0.01  # others hold the lock for one line only


@dataclass(frozen=True)
class Event:
    """One thing that happened.

    Parameters
    ----------
    at : str
        When: ISO 8601, UTC.
    kind : str
        One word: ``run``, ``skip``, ``alarm``, ``acknowledged``, ``swap``, ``oil`` ...
    text : str
        One sentence for a person.
    robot : str
        Whose; empty where it is nobody's.
    axis : int or None
        Which axis; None where it is the whole robot.
    recording : str
        Content hash of the recording that it is about; empty where there is none.
    by : str
        Who did or said it; empty where nobody did.
    details : mapping
        Whatever else a reader may want, as JSON.
    """

    at: str
    kind: str
    text: str
    robot: str = ""
    axis: int | None = None
    recording: str = ""
    by: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)

    def dumps(self) -> str:
        """Return the event as one line of JSON; what is empty is left out."""
        kept = {k: v for k, v in vars(self).items() if v not in ("", None, {})}
        return json.dumps(kept, ensure_ascii=False, allow_nan=False)


def append_event(folder: Path, event: Event) -> int:
    """Append an event to the folder's file, and return the number of its line, from 1.

    Raises
    ------
    agent.errors.StorageError
        The disk is full or refuses.
    """
    path = folder / NAME
    try:
        with _locked(path) as descriptor:
            said = _everything(descriptor)
            torn = b"\n" if said and not said.endswith(b"\n") else b""
            write_all(descriptor, torn + event.dumps().encode() + b"\n")
            sync(descriptor)
            if not said:
                sync_folder(folder)
            return (said + torn).count(b"\n") + 1
    except OSError as error:
        raise storage_error(error, f"{path} cannot be written") from error


def read_events(folder: Path) -> tuple[tuple[tuple[int, Event], ...], tuple[str, ...]]:
    """Return the events of a folder with their lines, and a sentence for every line that is none.

    Raises
    ------
    agent.errors.InputError
        The file is there and cannot be read.
    """
    path = folder / NAME
    try:
        text = path.read_bytes()
    except FileNotFoundError:
        return (), ()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}).") from error
    events, problems = [], []
    for number, line in enumerate(text.split(b"\n"), 1):
        if not line.strip():
            continue
        try:
            events.append((number, _event(json.loads(line))))
        except (ValueError, TypeError, RecursionError) as error:
            problems.append(f"{path}: line {number} is no event ({error})")
    return tuple(events), tuple(problems)


def _event(document: object) -> Event:
    """Return the event of one line; keys that this version does not know go into its details."""
    if not isinstance(document, dict):
        raise ValueError("expected a JSON object")
    known = {k: v for k, v in document.items() if k in Event.__dataclass_fields__}
    for name in ("at", "kind", "text"):
        if not isinstance(known.get(name), str):
            raise ValueError(f"{name} is missing or no text")
    axis, details = known.get("axis"), known.get("details", {})
    if axis is not None and (not isinstance(axis, int) or isinstance(axis, bool)):
        raise ValueError("axis is no whole number")
    if not isinstance(details, dict):
        raise ValueError("details is no object")
    for name in ("robot", "recording", "by"):
        known[name] = str(known.get(name, ""))
    unknown = {k: v for k, v in document.items() if k not in known}
    return Event(**{**known, "details": {**details, **unknown}})


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[int]:
    """Open the file for appending, alone.

    Raises
    ------
    OSError
        It cannot be opened, or others have held it for seconds.
    """
    flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags, 0o644)
    try:
        pause = threading.Event()
        if not any(try_lock(descriptor) or pause.wait(_PAUSE_S) for _ in range(_TRIES)):
            raise OSError(errno.EBUSY, "another program has held it for seconds")
        yield descriptor
    finally:
        os.close(descriptor)


def _everything(descriptor: int) -> bytes:
    """Return all that an open file holds."""
    os.lseek(descriptor, 0, os.SEEK_SET)
    blocks = []
    while block := os.read(descriptor, 1 << 20):
        blocks.append(block)
    return b"".join(blocks)
