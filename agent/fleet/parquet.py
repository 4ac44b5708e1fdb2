"""Read of a Parquet file in the lake only what is asked for: some columns, a range of its key.

The key is the schema's first column. Files are read without Arrow's threads: its pool was once
still at work when the interpreter ended.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from agent.errors import InputError

if TYPE_CHECKING:
    import pyarrow as pa

    from agent.fleet.store import Store


def read_table(
    store: Store, path: str, schema: pa.Schema, low: str | None = None, high: str | None = None
) -> pa.Table:
    """Return a file's columns, and of its rows those whose key is within the range.

    Parameters
    ----------
    store : Store
    path : str
    schema : pyarrow.Schema
        What to read; the key first.
    low, high : str, optional
        Row groups that hold nothing between them are not read.

    Raises
    ------
    InputError
        The file is damaged.
    """
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    try:
        # Reading ahead is done by Arrow's own threads, which need Python for a store's file; one
        # that is still letting go of it when the command ends aborts the process.
        with store.opened(path) as file, pq.ParquetFile(file, pre_buffer=False) as parquet:
            groups = [
                i
                for i in range(parquet.metadata.num_row_groups)
                if _overlaps(parquet.metadata.row_group(i), schema.names[0], low, high)
            ]
            table = parquet.read_row_groups(groups, schema.names, use_threads=False).cast(schema)
    except pa.ArrowException as error:
        raise InputError(
            f"{store.url}/{path}: is damaged ({error}).",
            "Delete it; what it held of results is computed again.",
        ) from error
    key = table.column(0)
    if low is not None:
        table = table.filter(pc.greater_equal(key, pa.scalar(low)))
    if high is not None:
        table = table.filter(pc.less_equal(table.column(0), pa.scalar(high)))
    return table


def without_repeats(schema: pa.Schema, tables: Sequence[pa.Table]) -> pa.Table:
    """Join tables in order of their key, each key once; of equal keys the first is taken."""
    import pyarrow as pa
    import pyarrow.compute as pc

    table = pa.concat_tables([schema.empty_table(), *tables])
    if table.num_rows < 2:
        return table.combine_chunks()
    table = table.take(pc.sort_indices(table, [(schema.names[0], "ascending")])).combine_chunks()
    key = table.column(0).chunk(0)
    new = pc.not_equal(key.slice(1), key.slice(0, len(key) - 1))
    return table.filter(pa.concat_arrays([pa.array([True]), new]))


def without_keys(table: pa.Table, keys: pa.Array[Any]) -> pa.Table:
    """Return the rows whose keys are none of those."""
    import pyarrow.compute as pc

    return table.filter(pc.invert(pc.is_in(table.column(0), value_set=keys)))


def _overlaps(group: Any, key: str, low: str | None, high: str | None) -> bool:
    """Tell from a row group's own account whether it may hold keys of the range."""
    column = next(
        c for c in (group.column(i) for i in range(group.num_columns)) if c.path_in_schema == key
    )
    found = column.statistics
    if found is None or not found.has_min_max:
        return True
    return (low is None or str(found.max) >= low) and (high is None or str(found.min) <= high)
