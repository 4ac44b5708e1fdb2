"""A recording into a file, whole or not at all: Parquet, or CSV with its side file, by suffix."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from agent.errors import StorageError
from agent.record.atomic import publish
from agent.record.reading import CSV, PARQUET, side_file
from agent.record.recording import Recording

if TYPE_CHECKING:
    import pyarrow as pa


def write(recording: Recording, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a recording with its metadata, and return the path.

    Parameters
    ----------
    recording : Recording
        Written as it is; a short one is written, too, though `read` will refuse it.
    path : str or Path
        ``.parquet``, or ``.csv`` with the metadata in ``.json`` beside it.
    overwrite : bool
        Whether a file that exists may be replaced.

    Raises
    ------
    StorageError
        The name is taken, the disk is full or refuses; no half file is left.
    ValueError
        Another suffix, or columns that the format cannot hold.
    """
    from agent.record.formats import arrow

    path = Path(path)
    if path.suffix.lower() not in (PARQUET, CSV):
        raise ValueError(f"{path}: expected a name that ends in {PARQUET} or {CSV}")
    table = arrow.to_table(recording)
    if path.suffix.lower() == PARQUET:
        write_table(table, path, overwrite=overwrite)
        return path
    from agent.record.formats import csv_file

    # the side file first: metadata without columns is no recording, columns without it would be
    publish(
        {
            side_file(path): recording.metadata.dumps(indent=2) + b"\n",
            path: csv_file.to_bytes(table),
        },
        overwrite=overwrite,
        recording=True,
    )
    return path


def write_table(table: pa.Table, path: Path, *, overwrite: bool = False) -> None:
    """Write an Arrow table, metadata in its schema, as Parquet: whole or not at all."""
    from agent.record.formats import parquet_file

    try:
        content = parquet_file.to_bytes(table)
    except MemoryError as error:
        raise StorageError(f"{path} cannot be written: not enough memory.") from error
    publish({path: content}, overwrite=overwrite, recording=True)
