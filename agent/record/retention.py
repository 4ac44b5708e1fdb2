"""What may go when recordings are too many or too old, and what never may.

Only recordings go, the oldest first; estimates, verdicts and events stay. A recording stays
whatever its age where its verdict is an alarm, where any verdict was compared with it (a
baseline), where nobody has made a verdict from it, or where it is the newest of its axis.
"""

from __future__ import annotations

import datetime
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from agent.errors import InputError
from agent.record.atomic import storage_error
from agent.record.catalogue.catalogue import Catalogue, RecordingRow
from agent.record.reading import natural_key
from agent.record.seal import files_of, seal_path, unprotect
from agent.record.verdict_file import SUFFIX, Verdict, read_verdict

MEGABYTE = 1e6


@dataclass(frozen=True)
class Limits:
    """How long recordings are kept, and how much room they may take; None: no limit."""

    days: float | None = None
    megabytes: float | None = None


@dataclass(frozen=True)
class Fate:
    """What becomes of one recording, and why."""

    recording: RecordingRow
    goes: bool
    why: str


def plan_retention(catalogue: Catalogue, limits: Limits, now: str) -> tuple[Fate, ...]:
    """Say what would go, and what stays and why; nothing is touched.

    Parameters
    ----------
    catalogue : Catalogue
        Of the folder, up to date.
    limits : Limits
    now : str
        The time now, ISO 8601, UTC.
    """
    rows = catalogue.recordings()
    held = _held(rows, _verdicts(catalogue.folder))
    oldest = _days_before(now, limits.days) if limits.days is not None else ""
    room = None if limits.megabytes is None else limits.megabytes * MEGABYTE
    total = sum(row.size_bytes for row in rows)
    fates = []
    for row in rows:  # oldest first
        why = ""
        if limits.days is not None and row.started_at and row.started_at < oldest:
            why = f"older than {limits.days:g} days"
        elif room is not None and total > room:
            why = f"the recordings take {total / MEGABYTE:.1f} MB of {limits.megabytes:g} MB"
        reason = held.get((row.path, row.sha256), "")
        goes = bool(why) and not reason
        if goes:
            total -= row.size_bytes
        fates.append(Fate(row, goes, why if goes else reason or "within the limits"))
    return tuple(fates)


def apply_retention(catalogue: Catalogue, fates: Iterable[Fate]) -> int:
    """Remove what goes: files first, then rows; return the bytes that are free again.

    Raises
    ------
    agent.errors.StorageError
        A file cannot be removed; those before it are.
    """
    freed = 0
    for fate in fates:
        if not fate.goes:
            continue
        recording = catalogue.folder / fate.recording.path
        for path in (*files_of(recording), seal_path(recording)):
            if not path.exists():
                continue
            unprotect(path)
            try:
                path.unlink()
            except OSError as error:
                raise storage_error(error, f"{path} cannot be removed") from error
        catalogue.remove(fate.recording.path)
        freed += fate.recording.size_bytes
    return freed


def over_limit(folder: Path, megabytes: float | None) -> str:
    """Say why there is no room for another recording; empty where there is.

    Parameters
    ----------
    folder : pathlib.Path
        Of the recordings; everything below it counts.
    megabytes : float or None
        What it may hold.
    """
    if megabytes is None or not folder.is_dir():
        return ""
    held = sum(_size(path) for path in folder.rglob("*")) / MEGABYTE
    if held < megabytes:
        return ""
    return f"{folder} holds {held:.1f} MB, its limit is {megabytes:g} MB"


def _size(path: Path) -> int:
    try:
        return path.stat().st_size if path.is_file() else 0
    except OSError:  # a temporary file that has gone meanwhile
        return 0


def _held(
    rows: tuple[RecordingRow, ...], verdicts: tuple[Verdict, ...]
) -> dict[tuple[str, str], str]:
    """Return why a recording (path and hash) must stay, for those that must."""
    judged = {verdict.recording_sha256 for verdict in verdicts}
    alarms = {verdict.recording_sha256 for verdict in verdicts if verdict.alarm}
    baselines = {sha256 for verdict in verdicts for sha256 in verdict.baseline}
    newest = {(row.robot, row.axis): row.path for row in rows}
    held = {}
    for row in rows:
        if row.sha256 in alarms:
            why = "an alarm stands on it"
        elif row.sha256 in baselines:
            why = "it belongs to a baseline"
        elif row.sha256 not in judged:
            why = "no verdict was made from it"
        elif newest[row.robot, row.axis] == row.path:
            why = "the newest of its axis"
        elif not row.started_at:
            why = "it does not say when it was made"
        else:
            continue
        held[row.path, row.sha256] = why
    return held


def _verdicts(folder: Path) -> tuple[Verdict, ...]:
    """Return every verdict below a folder.

    Raises
    ------
    agent.errors.InputError
        One cannot be read: what it protects is not known, so nothing may go.
    """
    try:
        return tuple(
            read_verdict(path) for path in sorted(folder.rglob(f"*{SUFFIX}"), key=natural_key)
        )
    except InputError as error:
        error.add_note("What this verdict protects is not known: nothing is removed.")
        raise


def _days_before(now: str, days: float) -> str:
    at = datetime.datetime.fromisoformat(now) - datetime.timedelta(days=days)
    return at.isoformat(timespec="milliseconds").replace("+00:00", "Z")
