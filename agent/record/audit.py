"""Who did what: lines that are only ever added, each carrying the hash of the one before it.

A line is JSON; its `hash` is SHA-256 over the line without it. Changing, removing or moving a line
breaks the chain at that place, and cutting the end off is seen by the head that is kept beside.
Somebody who may write both files can forge the whole trail: note the head elsewhere where that
matters (`stribeck audit verify` prints it, `--expect` holds the trail against it).
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agent.errors import InputError
from agent.record.atomic import publish, storage_error, sync, write_all
from agent.record.lock import try_lock
from drivers.clock import Clock, MonotonicClock, wall_time_utc

NAME = "audit.jsonl"
HEAD = "audit.head"
BEGINNING = "0" * 64
_PATIENCE_S = 5.0
_LOOK_S = 0.01


@dataclass(frozen=True)
class Entry:
    """One line: who did what, when (UTC, a label), with what."""

    number: int
    at: str
    who: str
    what: str
    detail: Mapping[str, Any]
    hash: str


@dataclass(frozen=True)
class Head:
    """Where a trail ends: how many lines, and the hash of the last."""

    entries: int
    hash: str


class AuditTrail:
    """The trail in one folder; several processes may add to it.

    Parameters
    ----------
    folder : pathlib.Path
        Must exist.
    clock : drivers.clock.Clock
        Paces the waiting for another writer.
    """

    def __init__(self, folder: Path, clock: Clock | None = None) -> None:
        self.path = folder / NAME
        self._head_path = folder / HEAD
        self._clock = clock or MonotonicClock()

    def add(self, who: str, what: str, **detail: str | float | bool | None) -> Entry:
        """Add one line and wait until the disk has it.

        Raises
        ------
        agent.errors.StorageError
            The disk does not take it, or another writer does not let go.
        agent.errors.InputError
            The trail is damaged: nothing is added to a chain that does not hold.
        """
        try:
            with self._alone() as descriptor:
                head = self._head(descriptor)
                entry: dict[str, Any] = {
                    "n": head.entries + 1,
                    "at": wall_time_utc(),
                    "who": who,
                    "what": what,
                    "detail": {key: value for key, value in detail.items() if value is not None},
                    "previous": head.hash,
                }
                sealed = {**entry, "hash": _seal(entry)}
                write_all(descriptor, f"{_canonical(sealed)}\n".encode())
                sync(descriptor)
                self._keep(Head(head.entries + 1, sealed["hash"]))
        except OSError as error:
            raise storage_error(error, f"{self.path} cannot be written") from error
        return _entry(sealed)

    def newest(self, count: int) -> list[Entry]:
        """Return the last lines, newest first; the chain is not checked."""
        if not self.path.exists():
            return []
        lines = self.path.read_text(encoding="utf-8").splitlines()[-count:]
        return [_entry(json.loads(line)) for line in reversed(lines)]

    @contextlib.contextmanager
    def _alone(self) -> Iterator[int]:
        """Hold the trail's file, open for adding, against every other writer."""
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND
        flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
        descriptor = os.open(self.path, flags, 0o600)
        try:
            deadline_s = self._clock.now() + _PATIENCE_S
            while not try_lock(descriptor):
                if self._clock.now() > deadline_s:
                    raise TimeoutError(f"another program has held it for {_PATIENCE_S:g} s")
                self._clock.sleep_until(self._clock.now() + _LOOK_S)
            yield descriptor
        finally:
            os.close(descriptor)

    def _head(self, descriptor: int) -> Head:
        """Return where the chain ends, from its last line; the kept head must say the same.

        One line more than the head says is what a power cut between the two writes leaves.
        """
        last = _last_line(descriptor)
        head = Head(0, BEGINNING) if last is None else Head(last["n"], last["hash"])
        kept = read_head(self._head_path)
        if kept is not None and kept != head:
            behind = last is not None and kept == Head(last["n"] - 1, last["previous"])
            if not behind:
                raise InputError(
                    f"{self.path} does not end where {self._head_path.name} says: nothing is "
                    "added to it.",
                    "Keep both files for whoever looks into it, and run `stribeck audit verify`.",
                )
        return head

    def _keep(self, head: Head) -> None:
        content = json.dumps({"entries": head.entries, "hash": head.hash})
        publish({self._head_path: content.encode()}, overwrite=True)


def verify(folder: Path, expect: str = "") -> Head:
    """Walk the whole chain and return where it ends.

    Parameters
    ----------
    folder : pathlib.Path
        Where the trail is.
    expect : str, optional
        A head's hash that somebody has noted; some line of the trail must carry it.

    Raises
    ------
    agent.errors.InputError
        Naming the first line that does not fit, or what is missing at the end.
    """
    path, head, seen = folder / NAME, Head(0, BEGINNING), {BEGINNING}
    if not path.exists():
        raise InputError(f"{path} is not there: no audit trail was ever begun, or it was removed.")
    with path.open("rb") as file:
        for number, raw in enumerate(file, start=1):
            head = _checked(path, number, raw, head)
            seen.add(head.hash)
    kept = read_head(folder / HEAD)
    if kept is None:
        raise InputError(
            f"{folder / HEAD} is not there: nobody can tell whether lines are missing."
        )
    if kept.entries > head.entries:
        missing = kept.entries - head.entries
        raise InputError(f"{path}: {missing} of {kept.entries} lines are missing at its end.")
    if kept.hash not in seen:
        raise InputError(f"{path} is not the trail that {HEAD} was kept for: it was written anew.")
    if expect and expect not in seen:
        raise InputError(f"{path}: no line has the expected hash {expect}: it was written anew.")
    return head


def read_head(path: Path) -> Head | None:
    """Return the head that is kept beside a trail; None where there is none."""
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        return Head(int(kept["entries"]), str(kept["hash"]))
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path} does not say where the audit trail ends ({error}).") from error


def _checked(path: Path, number: int, raw: bytes, before: Head) -> Head:
    """Return the head after one line, or refuse the line."""
    try:
        line = json.loads(raw)
        claimed = line.pop("hash")
        fits = (
            raw == f"{_canonical({**line, 'hash': claimed})}\n".encode()
            and line["n"] == number
            and line["previous"] == before.hash
            and claimed == _seal(line)
        )
    except (ValueError, KeyError, TypeError, AttributeError):
        fits = False
    if not fits:
        raise InputError(
            f"{path}, line {number}: does not fit the line before it. It was changed, or a line "
            "was removed, added or moved here; the lines before it hold."
        )
    return Head(number, str(claimed))


def _last_line(descriptor: int) -> dict[str, Any] | None:
    size = os.fstat(descriptor).st_size
    if size == 0:
        return None
    start = max(0, size - 65536)
    os.lseek(descriptor, start, os.SEEK_SET)
    tail = os.read(descriptor, size - start)
    try:
        line = json.loads(tail.splitlines()[-1]) if tail.endswith(b"\n") else None
        if isinstance(line, dict) and isinstance(line["n"], int) and isinstance(line["hash"], str):
            return line
    except (ValueError, KeyError):
        pass
    raise InputError(
        f"The audit trail's last line is damaged ({size} bytes): nothing is added to it.",
        "Run `stribeck audit verify`.",
    )


def _seal(line: Mapping[str, Any]) -> str:
    return hashlib.sha256(_canonical(line).encode()).hexdigest()


def _canonical(line: Mapping[str, Any]) -> str:
    return json.dumps(line, ensure_ascii=True, sort_keys=True, separators=(",", ":"))


def _entry(line: Mapping[str, Any]) -> Entry:
    return Entry(line["n"], line["at"], line["who"], line["what"], line["detail"], line["hash"])
