"""What a kill left behind: unfinished streams become recordings that say so.

A stream is removed only after its Parquet file is on the disk under its name, and what of it
could not be read is not thrown away: with a torn tail it is renamed to ``.arrows.torn``. A stream
that a living process is writing is left alone, and so is one that cannot be read; one that holds
no sample is removed, because it would only stand in the way. Doing it twice does nothing more
than doing it once.
"""

from __future__ import annotations

import contextlib
import glob
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pyarrow as pa

from agent.errors import InputError
from agent.record.atomic import TEMPORARY, storage_error
from agent.record.formats import parquet_file
from agent.record.formats.arrow import metadata_of
from agent.record.lock import try_lock
from agent.record.metadata import KEY, Metadata
from agent.record.reading import natural_key
from agent.record.streams.stream import FLUSH_PERIOD_S
from agent.record.streams.stream_file import SUFFIX, StreamContent, read_stream
from agent.record.writing import write_table

TORN = ".torn"  # added to the name of a stream whose tail could not be read

Outcome = Literal["recovered", "finished before", "in use", "empty", "unreadable", "name taken"]


@dataclass(frozen=True)
class Recovered:
    """What became of one unfinished stream.

    Parameters
    ----------
    stream : Path
        The stream; it is gone (or renamed, if `bytes_cut`) when the outcome is "recovered",
        "finished before" or "empty".
    outcome : str
        "recovered", "finished before", "in use", "empty", "unreadable" or "name taken".
    sentence : str
        The outcome in plain words.
    recording : Path or None
        The finished recording, where there is one.
    samples : int
        How many samples the stream held.
    bytes_cut : int
        How many bytes of an incomplete batch were cut off its end.
    """

    stream: Path
    outcome: Outcome
    sentence: str
    recording: Path | None = None
    samples: int = 0
    bytes_cut: int = 0


def recover(where: str | Path) -> tuple[Recovered, ...]:
    """Finish every unfinished stream in a folder and below it, or one stream.

    Returns
    -------
    tuple of Recovered
        One for each stream that was found, also for those left alone.

    Raises
    ------
    InputError
        When there is no such file or folder, or the file is no stream.
    StorageError
        When a recording cannot be written; its stream is kept.
    """
    where = Path(where)
    if where.is_dir():
        streams = sorted(where.rglob(f"*{SUFFIX}"), key=natural_key)
    elif not where.exists():
        raise InputError(f"{where}: does not exist.")
    elif where.suffix != SUFFIX:
        raise InputError(f"{where}: is not an unfinished stream (expected *{SUFFIX}).")
    else:
        streams = [where]
    results = [_recover_one(stream) for stream in streams]
    return tuple(result for result in results if result is not None)


def _recover_one(stream: Path) -> Recovered | None:
    """Finish one stream under its lock; None when it vanished, because its writer finished it."""
    try:
        descriptor = os.open(stream, os.O_RDWR | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        return None
    except OSError as error:
        reason = f"{stream}: cannot be opened ({error.strerror})."
        return Recovered(stream, "unreadable", reason)
    try:
        if not try_lock(descriptor):
            return Recovered(
                stream, "in use", f"{stream}: is being written by a living process, left alone."
            )
        if os.fstat(descriptor).st_nlink == 0:
            return None
        result = _finish(stream)
    finally:
        os.close(descriptor)
    if result.outcome in ("recovered", "finished before", "empty"):
        _put_away(result)
    return result


def _put_away(result: Recovered) -> None:
    """Remove a stream of which everything was read; one with a torn tail is renamed instead."""
    try:
        if result.bytes_cut:
            result.stream.replace(result.stream.with_name(result.stream.name + TORN))
        else:
            result.stream.unlink(missing_ok=True)
    except OSError as error:
        raise storage_error(
            error, f"{result.stream} is done with, but cannot be removed"
        ) from error


def _finish(stream: Path) -> Recovered:
    """Write the recording of a stream that nobody else touches."""
    recording = stream.with_suffix(".parquet")
    for left in stream.parent.glob(f".{glob.escape(recording.name)}.*{TEMPORARY}"):
        with contextlib.suppress(OSError):  # it stays where it is, in nobody's way
            left.unlink()
    if stream.stat().st_size == 0:  # killed before its header
        return Recovered(stream, "empty", f"{stream}: held nothing at all.")
    try:
        content = read_stream(stream)
        metadata = metadata_of(content.table, str(stream))
    except InputError as error:
        return Recovered(stream, "unreadable", f"{error.what} It is left alone.")
    samples, cut = content.table.num_rows, content.bytes_cut
    if not samples:
        return Recovered(stream, "empty", f"{stream}: held no whole sample.", bytes_cut=cut)
    if recording.exists():
        return _meet(stream, recording, content)
    sentence = _what_was_saved(content)
    final = _final_metadata(metadata, content).noted(sentence)
    write_table(content.table.replace_schema_metadata({KEY: final.dumps()}), recording)
    return Recovered(
        stream, "recovered", f"{recording}: {sentence}", recording, samples=samples, bytes_cut=cut
    )


def _meet(stream: Path, recording: Path, content: StreamContent) -> Recovered:
    """Decide about a stream whose recording's name is taken already."""
    samples = content.table.num_rows
    if _holds(recording, content.table):
        return Recovered(
            stream,
            "finished before",
            f"{recording}: held all {samples} samples already.",
            recording,
            samples=samples,
            bytes_cut=content.bytes_cut,
        )
    return Recovered(
        stream,
        "name taken",
        f"{stream}: {recording.name} exists and is another recording; move it away first.",
        samples=samples,
        bytes_cut=content.bytes_cut,
    )


def _holds(recording: Path, table: pa.Table) -> bool:
    """Tell whether a finished recording begins with every row of `table`."""
    try:
        finished = parquet_file.read_table(recording, str(recording))
    except InputError:
        return False
    same_names = finished.column_names == table.column_names
    return same_names and _nan_equal(finished.slice(0, table.num_rows), table)


def _nan_equal(one: pa.Table, other: pa.Table) -> bool:
    """Tell whether two tables hold the same, NaN being the same as NaN."""
    if one.num_rows != other.num_rows:
        return False
    for a, b in zip(one.columns, other.columns, strict=True):
        if a.type != b.type:
            return False
        if pa.types.is_floating(a.type):
            if not np.array_equal(a.to_numpy(), b.to_numpy(), equal_nan=True):
                return False
        elif not a.equals(b):
            return False
    return True


def _what_was_saved(content: StreamContent) -> str:
    """Return what a reader must know about a recovered recording."""
    samples = content.table.num_rows
    until = ""
    if "time_s" in content.table.column_names:
        until = f" up to time_s = {content.table['time_s'][-1].as_py():.6g}"
    if content.closed:
        return (
            f"Recovered {samples} samples{until} from a stream that was closed but not finished; "
            "nothing is missing at its end, losses before it were not counted."
        )
    return (
        f"Recovered {samples} samples{until} from a stream whose writer did not end it; up to "
        f"{FLUSH_PERIOD_S} s may be missing at its end, and losses before it were not counted."
    )


def _final_metadata(metadata: Metadata, content: StreamContent) -> Metadata:
    """Return the metadata with a count of lost samples only where it can be true."""
    return metadata if content.closed else metadata.updated({"samples_lost": None})
