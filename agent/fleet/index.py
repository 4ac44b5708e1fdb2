"""What is in a lake's packs: one small Parquet file for each time that a month was packed.

A month has more than one where recordings were delivered late. Rows are in order of the path.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

from agent.fleet.entry import Entry, entry_of, month_of
from agent.fleet.parquet import read_table, without_repeats

if TYPE_CHECKING:
    import pyarrow as pa

    from agent.fleet.store import Store

INDEX = "packed/index"
_ROWS = 4096  # of a row group: so many are read to find one


def packed_months(store: Store) -> dict[str, tuple[str, ...]]:
    """Return each packed month's index files."""
    found: dict[str, list[str]] = {}
    for path in store.files(INDEX):
        found.setdefault(path.rpartition("/")[2].rpartition("-")[0], []).append(path)
    return {month: tuple(paths) for month, paths in found.items()}


def packed(
    store: Store, paths: Sequence[str], low: str | None = None, high: str | None = None
) -> pa.Table:
    """Read index files: path, size_bytes, pack, offset; each path once, in order.

    Parameters
    ----------
    store : Store
    paths : sequence of str
        Of one month's index files.
    low, high : str, optional
        Only recordings whose paths are not below one, nor above the other.
    """
    schema = entries_schema()
    tables = [read_table(store, p, schema, low=low, high=high) for p in paths]
    return without_repeats(schema, tables)


def packed_entry(store: Store, path: str) -> Entry | None:
    """Return a recording's entry in the packs, or None where it is in none."""
    files = [p for p in store.files(INDEX) if p.startswith(f"{INDEX}/{month_of(path)}-")]
    rows = packed(store, files, low=path, high=path).to_pylist()
    return None if not rows else entry_of(path, *(rows[0][n] for n in entries_schema().names[1:]))


def put_index(store: Store, month: str, rows: Sequence[tuple[str, int, str, int]]) -> None:
    """Write what a month's new packs hold."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = entries_schema()
    columns = zip(*sorted(rows), strict=True)
    table = pa.Table.from_arrays(
        [pa.array(c, f.type) for c, f in zip(columns, schema, strict=True)], schema=schema
    )
    sink = io.BytesIO()
    pq.write_table(table, sink, compression="zstd", row_group_size=_ROWS)
    content = sink.getvalue()
    digest = hashlib.sha256(content).hexdigest()[:16]
    store.put(f"{INDEX}/{month}-{digest}.parquet", content)


def entries_schema() -> pa.Schema:
    """Return the columns of a table of entries."""
    import pyarrow as pa

    kinds = [pa.string(), pa.int64(), pa.string(), pa.int64()]
    names = ["path", "size_bytes", "pack", "offset"]
    return pa.schema([pa.field(n, k) for n, k in zip(names, kinds, strict=True)])
