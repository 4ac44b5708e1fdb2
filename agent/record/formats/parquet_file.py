"""Parquet in and out, with every way in which a file can fail to be one in plain words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from agent.errors import InputError

MAGIC = b"PAR1"


def read_table(path: Path, where: str) -> pa.Table:
    """Return the whole table of a Parquet file.

    Raises
    ------
    InputError
        Not Parquet, cut short, or damaged.
    """
    with path.open("rb") as file:
        head = file.read(len(MAGIC))
        size = file.seek(0, 2)
        file.seek(max(size - len(MAGIC), 0))
        tail = file.read()
    if size == 0:
        raise InputError(f"{where}: is empty (0 bytes).")
    if head != MAGIC:
        raise InputError(f"{where}: is not a Parquet file (it starts with {head!r}).")
    if tail != MAGIC or size < 3 * len(MAGIC):
        raise InputError(
            f"{where}: is a Parquet file that was cut short after {size} bytes; its end, which "
            "names the columns, is missing."
        )
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as parquet:
            table = parquet.read()
        table.schema.names  # noqa: B018 - a name that is no text shows only when it is asked for
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        reason = " ".join(str(error).split())[:160]
        raise InputError(f"{where}: is a damaged Parquet file ({reason}).") from error
    return table


def to_bytes(table: pa.Table) -> memoryview:
    """Return the table as a Parquet file: zstd, checksums on every page.

    Only text is dictionary-encoded: measured values hardly ever repeat.
    """
    texts: Any = [field.name for field in table.schema if pa.types.is_string(field.type)]
    sink = pa.BufferOutputStream()
    pq.write_table(
        table,
        sink,
        compression="zstd",
        use_dictionary=texts,
        write_page_checksum=True,
    )
    return memoryview(sink.getvalue())
