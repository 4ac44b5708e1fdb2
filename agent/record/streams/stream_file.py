"""The Arrow IPC stream on disk: what of it is whole, where that ends, and whether it was closed."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.ipc as ipc

from agent.errors import InputError

SUFFIX = ".arrows"
END_OF_STREAM = b"\xff\xff\xff\xff\x00\x00\x00\x00"


@dataclass(frozen=True)
class StreamContent:
    """What could be read of a stream.

    Parameters
    ----------
    table : pyarrow.Table
        Every whole batch, under the schema with the metadata.
    bytes_cut : int
        How many bytes behind the last whole batch belong to none.
    closed : bool
        Whether the writer ended the stream itself, so that nothing can be missing at its end.
    """

    table: pa.Table
    bytes_cut: int
    closed: bool


def read_stream(path: Path) -> StreamContent:
    """Read every whole batch of a stream, finished or not.

    Raises
    ------
    InputError
        When not even the header is there, the file is no Arrow stream, or a batch is damaged in
        such a way that it does not fit into memory.
    """
    size = path.stat().st_size
    with pa.OSFile(str(path), "rb") as file:
        try:
            reader = ipc.open_stream(file)
            reader.schema.names  # noqa: B018 - a name that is no text shows only when asked for
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            why = " ".join(str(error).split())[:160]
            reason = "is empty" if size == 0 else f"has no readable Arrow stream header ({why})"
            raise InputError(f"{path}: {reason}.") from error
        batches: list[pa.RecordBatch] = []
        whole = file.tell()
        while True:
            try:
                batch = reader.read_next_batch()
                batch.validate(full=True)
            except MemoryError as error:  # no reason to call what follows a torn tail
                raise InputError(f"{path}: a batch asks for more memory than there is.") from error
            except (StopIteration, pa.ArrowException, OSError):
                break  # the end, or a tail that the writer did not live to complete
            batches.append(batch)
            whole = file.tell()
        table = pa.Table.from_batches(batches, schema=reader.schema)
    with path.open("rb") as tail:
        tail.seek(whole, os.SEEK_SET)
        rest = tail.read(len(END_OF_STREAM) + 1)
    closed = rest == END_OF_STREAM
    return StreamContent(
        table=table, bytes_cut=0 if closed else max(size - whole, 0), closed=closed
    )
