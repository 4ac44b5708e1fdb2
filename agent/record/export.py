"""A recording in other programs' formats, units and all: CSV with its side file, or MDF 4."""

from __future__ import annotations

import datetime
import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from agent.errors import InputError, UsageError
from agent.record.atomic import publish
from agent.record.reading import CSV
from agent.record.recording import FLOAT_COLUMNS, TEXT_COLUMNS, Column, Recording
from agent.record.writing import write

if TYPE_CHECKING:
    from asammdf import Signal

Format = Literal["csv", "mdf4"]
SUFFIXES: dict[str, str] = {"csv": CSV, "mdf4": ".mf4"}
_UNITS = (("_rad_s", "rad/s"), ("_nm", "N m"), ("_degc", "°C"), ("_rad", "rad"), ("_s", "s"))


def export(recording: Recording, path: Path, kind: Format) -> Path:
    """Write a recording for another program; an existing file is not replaced.

    Parameters
    ----------
    recording : Recording
    path : pathlib.Path
        Where to; its suffix must be the format's.
    kind : str
        ``csv`` (the contract's: units in the names, metadata beside) or ``mdf4`` (units and
        comments with each channel, metadata in the file's comment).

    Raises
    ------
    agent.errors.InputError
        Another suffix, a column that the format cannot hold, or asammdf is not installed.
    agent.errors.StorageError
        The name is taken, or the disk refuses.
    """
    if path.suffix.lower() != SUFFIXES[kind]:
        raise UsageError(f"{path}: a file of {kind} must end in {SUFFIXES[kind]}.")
    if kind == "csv":
        try:
            return write(recording, path)
        except ValueError as error:
            raise InputError(f"{recording.source}: {error}.") from error
    publish({path: _mdf4(recording)})
    return path


def unit_of(column: str) -> str:
    """Return the unit that a column's name says; empty where it says none."""
    return next((unit for suffix, unit in _UNITS if column.endswith(suffix)), "")


def _mdf4(recording: Recording) -> bytes:
    """Return the recording as a file of MDF 4.10."""
    try:
        from asammdf import MDF
    except ImportError as error:
        raise InputError(
            "For MDF 4 the package asammdf is needed.", "Install stribeck[mdf4], or export CSV."
        ) from error
    metadata = recording.metadata
    with tempfile.TemporaryDirectory() as folder, MDF(version="4.10") as mdf:
        mdf.header.comment = json.dumps(metadata.to_json(), ensure_ascii=False)
        if metadata.started_at:
            start = datetime.datetime.fromisoformat(metadata.started_at)
            mdf.start_time = start if start.tzinfo else start.replace(tzinfo=datetime.UTC)
        mdf.append(_signals(recording), comment=f"{metadata.robot} axis {metadata.axis}")
        written = Path(mdf.save(Path(folder) / "recording.mf4", compression=2))
        return written.read_bytes()


def _signals(recording: Recording) -> list[Signal]:
    """Return a channel for each column but time; samples without a time cannot be in MDF.

    Raises
    ------
    agent.errors.InputError
        Samples without a time, or a column of a kind that MDF has no channel for.
    """
    from asammdf import Signal

    time_s = recording["time_s"]
    timeless = int(np.count_nonzero(~np.isfinite(time_s)))
    if timeless:
        raise InputError(
            f"{recording.source}: {timeless} samples have no time, and MDF cannot hold them.",
            "Export CSV, which can.",
        )
    return [
        Signal(
            samples=_samples(values, name, recording.source),
            timestamps=time_s,
            name=name,
            unit=unit_of(name),
            comment=FLOAT_COLUMNS.get(name, TEXT_COLUMNS.get(name, "")),
            **_encoding(values),
        )
        for name, values in recording.columns.items()
        if name != "time_s"
    ]


def _encoding(values: Column) -> dict[str, Any]:
    return {"encoding": "utf-8"} if values.dtype.kind in "UO" else {}


def _samples(values: Column, name: str, where: str) -> Column:
    """Return a column as a channel's samples: numbers as they are, text as UTF-8."""
    if values.dtype.kind in "fiu":
        return values
    if values.dtype.kind == "b":
        return values.astype(np.uint8)
    items = ["" if item is None else item for item in values.tolist()]
    if all(isinstance(item, str) for item in items):
        text: Column = np.array([item.encode() for item in items])
        return text
    raise InputError(f"{where}: column {name} is of a kind that MDF has no channel for.")
