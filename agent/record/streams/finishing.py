"""What a stream that has ended becomes: the recording's last metadata, and its Parquet file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from agent.errors import StorageError
from agent.record.metadata import KEY, Metadata
from agent.record.streams.stream_file import read_stream
from agent.record.writing import write_table


def final_metadata(
    metadata: Metadata, samples_lost: int | None, unsaved: int, changes: Mapping[str, Any]
) -> Metadata:
    """Return the metadata of the finished recording.

    Parameters
    ----------
    metadata : Metadata
        As the stream began with it.
    samples_lost : int or None
        Samples that are known not to have arrived; None where nobody knows.
    unsaved : int
        Rows that came and that no disk took; added to those lost, and noted.
    changes : mapping
        Keys of the metadata, known or not, that the end of the run sets.

    Raises
    ------
    ValueError
        When these metadata cannot be used.
    """
    changed = dict(changes)
    if samples_lost is not None or unsaved:
        changed["samples_lost"] = (samples_lost or 0) + unsaved
    final = metadata.updated(changed)
    if unsaved:
        final = final.noted(
            f"The disk failed while recording: the last {unsaved} samples could not be saved."
        )
    return final


def publish_stream(stream: Path, recording: Path, metadata: Metadata, saved: int) -> None:
    """Write the Parquet file from a stream that has ended; the stream is left.

    Parameters
    ----------
    stream, recording : Path
        From where and to where.
    metadata : Metadata
        Of the recording.
    saved : int
        Samples that the disk has taken: all of them must come back.

    Raises
    ------
    StorageError
        When the disk fails, or gives back fewer; it says where the samples are kept.
    """
    table = read_stream(stream).table.replace_schema_metadata({KEY: metadata.dumps()})
    try:
        if table.num_rows < saved:
            raise StorageError(
                f"{stream}: the disk gives back {table.num_rows} of the {saved} samples that it "
                "took."
            )
        write_table(table, recording)
    except StorageError as error:
        raise StorageError(
            f"{error.what} The {table.num_rows} samples are kept in {stream}.",
            f"{error.do} Finish it later with `stribeck recover`.".strip(),
        ) from error
