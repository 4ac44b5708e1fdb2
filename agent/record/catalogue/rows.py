"""The catalogue's rows as values, and how each is made from its file."""

from __future__ import annotations

import datetime
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from agent.errors import InputError
from agent.record.events_file import Event
from agent.record.reading import read
from agent.record.recording import Recording
from agent.record.seal import content
from agent.record.verdict_file import read_json, read_verdict


@dataclass(frozen=True)
class RecordingRow:
    """One recording: its file relative to the folder, its content hash, and what it says."""

    path: str
    sha256: str
    size_bytes: int
    robot: str
    axis: int
    gear_ratio: float
    started_at: str
    duration_s: float
    samples: int
    samples_lost: int | None
    trajectory: str
    payload_kg: float | None
    gearbox_serial: str
    gearbox_temperature_degc: float | None
    stopped_because: str
    software: str


@dataclass(frozen=True)
class EstimateRow:
    """One estimate: the plain law's numbers with their 95 % intervals; the rest is in its file."""

    path: str
    recording_sha256: str
    robot: str
    axis: int
    started_at: str
    decidable: bool
    sentence: str
    coulomb_nm: float | None = None
    coulomb_low_nm: float | None = None
    coulomb_high_nm: float | None = None
    viscous_nm_s_per_rad: float | None = None
    viscous_low_nm_s_per_rad: float | None = None
    viscous_high_nm_s_per_rad: float | None = None
    rmse_nm: float | None = None


@dataclass(frozen=True)
class VerdictRow:
    """One verdict: on which recording, with which version; see `verdict_file.Verdict`."""

    path: str
    recording_sha256: str
    robot: str
    axis: int
    started_at: str
    made_at: str
    version: str
    decidable: bool
    alarm: bool
    state: str
    sentence: str


@dataclass(frozen=True)
class EventRow:
    """One event, and the line that it stands in."""

    path: str
    line: int
    event: Event

    def columns(self) -> dict[str, Any]:
        """Return the table's columns."""
        details = json.dumps(dict(self.event.details), sort_keys=True)
        return {**vars(self.event), "path": self.path, "line": self.line, "details": details}

    @classmethod
    def from_columns(cls, row: Mapping[str, Any]) -> EventRow:
        """Take a row of the table."""
        names = Event.__dataclass_fields__
        event = Event(**{n: row[n] for n in names if n != "details"} | {"details": {}})
        details = json.loads(row["details"])
        return cls(row["path"], row["line"], Event(**{**vars(event), "details": details}))


def recording_row(file: Path, folder: Path) -> RecordingRow:
    """Read and check a recording, and return its row.

    Raises
    ------
    agent.errors.InputError
        It is no recording.
    """
    sealed = content(file)
    recording = read(file)
    metadata = recording.metadata
    time_s = recording["time_s"][np.isfinite(recording["time_s"])]
    return RecordingRow(
        path=relative(file, folder),
        sha256=sealed.sha256,
        size_bytes=sealed.size_bytes,
        robot=metadata.robot,
        axis=metadata.axis,
        gear_ratio=metadata.gear_ratio,
        started_at=in_utc(metadata.started_at),
        duration_s=float(time_s[-1] - time_s[0]),
        samples=len(recording),
        samples_lost=None if metadata.samples_lost is None else int(metadata.samples_lost),
        trajectory=str(metadata.trajectory.get("name", "")),
        payload_kg=None if metadata.payload_kg is None else float(metadata.payload_kg),
        gearbox_serial=str(metadata.extra.get("gearbox_serial", "")),
        gearbox_temperature_degc=_temperature(recording),
        stopped_because=str(metadata.extra.get("stopped_because", "")),
        software=_text(metadata.software),
    )


def estimate_row(file: Path, of: RecordingRow | VerdictRow, folder: Path) -> EstimateRow:
    """Return the row of the estimate in `file`.

    Parameters
    ----------
    file : pathlib.Path
        The estimate.
    of : RecordingRow or VerdictRow
        What it belongs to: its recording, or, where that was removed, the verdict on it.
    folder : pathlib.Path
        The catalogue's.

    Raises
    ------
    agent.errors.InputError
        It is no estimate.
    """
    document = read_json(file)
    if not isinstance(document.get("decidable"), bool):
        raise InputError(f"{file}: is no estimate (it does not say whether it is decidable).")
    models = document.get("friction_models")
    plain = next(
        (
            m
            for m in (models if isinstance(models, list) else [])
            if isinstance(m, dict) and m.get("model") == "coulomb-viscous"
        ),
        {},
    )
    return EstimateRow(
        path=relative(file, folder),
        recording_sha256=of.sha256 if isinstance(of, RecordingRow) else of.recording_sha256,
        robot=of.robot,
        axis=of.axis,
        started_at=of.started_at,
        decidable=document["decidable"],
        sentence=_text(document.get("sentence", "")),
        rmse_nm=_number(plain.get("rmse_nm")),
        **_interval(plain, "coulomb", "_nm"),
        **_interval(plain, "viscous", "_nm_s_per_rad"),
    )


def verdict_row(file: Path, folder: Path) -> VerdictRow:
    """Return the row of the verdict in `file`.

    Raises
    ------
    agent.errors.InputError
        It is no verdict.
    """
    verdict = read_verdict(file)
    same = [n for n in VerdictRow.__dataclass_fields__ if n != "path"]
    return VerdictRow(path=relative(file, folder), **{n: getattr(verdict, n) for n in same})


def relative(file: Path, folder: Path) -> str:
    """Return a file's name below the folder, with forward slashes.

    Raises
    ------
    agent.errors.InputError
        It is not below the folder.
    """
    try:
        return file.resolve().relative_to(folder.resolve()).as_posix()
    except ValueError as error:
        raise InputError(
            f"{file} is not below {folder}.", "A catalogue knows the recordings of its own folder."
        ) from error


def in_utc(text: str) -> str:
    """Return a time of ISO 8601 in UTC, to the millisecond, so that it sorts; unreadable as it is.

    A time without a zone is taken as UTC, as the contract says that it is.
    """
    try:
        at = datetime.datetime.fromisoformat(text)
        at = at if at.tzinfo is not None else at.replace(tzinfo=datetime.UTC)
        at = at.astimezone(datetime.UTC)
    except (ValueError, OverflowError):
        return text
    return at.isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _temperature(recording: Recording) -> float | None:
    name = "gearbox_temperature_degc"
    if name not in recording:
        return None
    values = recording[name][np.isfinite(recording[name])]
    return float(values.mean()) if values.size else None


def _interval(model: Mapping[str, Any], name: str, unit: str) -> dict[str, float | None]:
    """Return one parameter of a model as three columns; empty where it was not identified."""
    parameters = model.get("parameters")
    found = parameters.get(f"{name}{unit}") if isinstance(parameters, dict) else None
    if not isinstance(found, dict) or not found.get("identified", True):
        return {}
    ci95 = found.get("ci95")
    low, high = ci95 if isinstance(ci95, list) and len(ci95) == 2 else (None, None)
    return {
        f"{name}{unit}": _number(found.get("value")),
        f"{name}_low{unit}": _number(low),
        f"{name}_high{unit}": _number(high),
    }


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if math.isfinite(value) else None


def _text(value: object) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value, sort_keys=True)
