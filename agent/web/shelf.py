"""The recordings' folder as the page sees it: finished cycles with what was concluded from them.

Files are the truth: a recording's footer, its estimate, its verdict, the folder's events. Nothing
is estimated here, and of a recording's samples none is read. A name that somebody asks for is
looked up among what was found, and never made into a path.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from agent.errors import InputError
from agent.record.events_file import Event, read_events
from agent.record.events_toml import read_written
from agent.record.formats.parquet_footer import ForeignFooterError, key_values
from agent.record.metadata import KEY, Metadata
from agent.record.verdict_file import Verdict, estimate_path, read_verdict, verdict_path

REPORT_SUFFIX = ".report.html"
T = TypeVar("T")


@dataclass(frozen=True)
class Shelved:
    """One finished cycle.

    Parameters
    ----------
    name : str
        Of its files, without suffix.
    path : pathlib.Path
        The recording.
    metadata : Metadata
        What the recording says of itself.
    estimate : mapping or None
        Its `stribeck.estimate/1`, where one was made.
    verdict : Verdict or None
        Its `stribeck.verdict/1`, where one was made.
    """

    name: str
    path: Path
    metadata: Metadata
    estimate: Mapping[str, Any] | None
    verdict: Verdict | None

    @property
    def axis(self) -> int:
        """Return the axis's number."""
        return self.metadata.axis

    @property
    def started_at(self) -> str:
        """Return when it began, ISO 8601; a label."""
        return self.metadata.started_at

    @property
    def trajectory(self) -> str:
        """Return what was driven."""
        reverse = " (reversed)" if self.name.endswith("-reversed") else ""
        return f"{self.metadata.trajectory.get('name', '')}{reverse}"

    @property
    def stopped_because(self) -> str:
        """Return why it was stopped; empty where it ran to its end."""
        return str(self.metadata.extra.get("stopped_because", ""))

    @property
    def decidable(self) -> bool:
        """Return whether it carries a friction estimate."""
        return self.estimate is not None and self.estimate.get("decidable") is True

    @property
    def temperature_degc(self) -> float | None:
        """Return the gearbox's mean temperature, where it was measured."""
        quality = self.estimate.get("quality") if self.estimate is not None else None
        ends = quality.get("temperature_degc") if isinstance(quality, Mapping) else None
        if not isinstance(ends, list) or not ends:
            return None
        numbers = [e for e in ends if isinstance(e, int | float) and math.isfinite(e)]
        return sum(numbers) / len(numbers) if numbers else None

    @property
    def report(self) -> Path:
        """Return where its offline report stands, if it does."""
        return self.path.with_name(self.name + REPORT_SUFFIX)

    @property
    def explanation(self) -> Path | None:
        """Return the explanation page beside it, where somebody has made one."""
        beside = self.path.with_name(f"{self.name}.explanation") / "report.html"
        return beside if beside.is_file() else None


class Shelf:
    """Looks into a folder; what has not changed since the last look is not read again."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, Path], tuple[tuple[int, int], Any]] = {}

    def look(self, folder: Path, robot: str, axis: int | None = None) -> list[Shelved]:
        """Return the cycles of a robot, of one axis or all, newest first."""
        found = [
            Shelved(path.stem, path, metadata, self._estimate(path), self._verdict(path))
            for path, metadata in self._metadata(folder)
            if metadata.robot == robot and axis in (None, metadata.axis)
        ]
        return sorted(found, key=lambda cycle: (cycle.started_at, cycle.name), reverse=True)

    def find(self, folder: Path, robot: str, name: str) -> Shelved | None:
        """Return the cycle of that name; None where there is none."""
        return next((c for c in self.look(folder, robot) if c.name == name), None)

    def events(self, folder: Path, robot: str, axis: int | None = None) -> list[Event]:
        """Return what happened to a robot, newest first; of one axis, what concerns it."""
        events, _torn = read_events(folder)
        written, _wrong = read_written(folder)
        mine = [
            event
            for _line, event in (*events, *written)
            if event.robot in ("", robot) and (axis is None or event.axis in (None, axis))
        ]
        return sorted(mine, key=lambda event: event.at, reverse=True)

    def _metadata(self, folder: Path) -> Iterator[tuple[Path, Metadata]]:
        if not folder.is_dir():
            return
        for path in folder.glob("*.parquet"):
            if path.name.startswith("."):
                continue
            metadata = self._once("metadata", path, _read_metadata)
            if metadata is not None:
                yield path, metadata

    def _estimate(self, path: Path) -> Mapping[str, Any] | None:
        return self._once("estimate", estimate_path(path), _read_estimate)

    def _verdict(self, path: Path) -> Verdict | None:
        return self._once("verdict", verdict_path(path), _read_verdict)

    def _once(self, kind: str, path: Path, read: Callable[[Path], T | None]) -> T | None:
        try:
            status = path.stat()
        except OSError:
            self._known.pop((kind, path), None)
            return None
        stamp = (status.st_mtime_ns, status.st_size)
        known = self._known.get((kind, path))
        if known is not None and known[0] == stamp:
            value: T | None = known[1]
            return value
        fresh = read(path)
        self._known[(kind, path)] = (stamp, fresh)
        return fresh


def _read_metadata(path: Path) -> Metadata | None:
    """Return what a recording says of itself, from its footer; None for a file that is none."""
    try:
        return Metadata.loads(key_values(path)[KEY.encode()], str(path))
    except (ForeignFooterError, OSError, KeyError, InputError):
        return None


def _read_estimate(path: Path) -> Mapping[str, Any] | None:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return document if isinstance(document, dict) else None


def _read_verdict(path: Path) -> Verdict | None:
    try:
        return read_verdict(path)
    except InputError:
        return None
