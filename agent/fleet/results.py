"""What was computed of a lake, beside it, in Parquet files that are written whole or not at all.

::

    LAKE/results/KIND/version=V/month=2026-11/{part,whole}-UUID.parquet

One row for each item, with the item's own key, in the month of the item: a run that was ended, or a
worker that was killed, loses the rows that are not written yet (`part_rows` twice at most). Two at
once may both compute an item; its rows are then equal, and one of them is taken. Another version of
the code has another folder, so that nothing that it computed is mixed in.

A month with many parts is put together: rows in order of the key, in files of `WHOLE_ROWS`. The old
parts are deleted when all of the new files are there; until then a row may be there twice, which
counts as once. To know what is done, and to read one joint, only columns and row groups are read.
"""

from __future__ import annotations

import io
import uuid
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from agent.errors import StorageError
from agent.fleet.parquet import read_table, without_repeats

if TYPE_CHECKING:
    import pyarrow as pa

    from agent.fleet.lake import Lake

KEY = "key"
WHOLE_ROWS = 8192
_GROUP_ROWS = 512
_PARTS = 32  # of a month, from which on they are put together


@dataclass
class Results:
    """The rows of one kind and version, in a lake.

    Parameters
    ----------
    lake : Lake
    kind : str
        ``estimate``, ``monitor`` or ``explain``.
    version : str
        Of the code (`agent.fleet.version`).
    columns : mapping of str to str
        Arrow's name of each column's type; ``key`` is added.
    part_rows : int
        So many rows of a month are written together.
    """

    lake: Lake
    kind: str
    version: str
    columns: Mapping[str, str]
    part_rows: int = 1024
    _waiting: dict[str, list[dict[str, Any]]] = field(default_factory=dict)

    @property
    def folder(self) -> str:
        """Return where they are, below the lake's root."""
        return f"results/{self.kind}/version={self.version}"

    def add(self, month: str, row: Mapping[str, Any]) -> None:
        """Take one row; write a part when its month has enough, or all months have twice that."""
        waiting = self._waiting.setdefault(month, [])
        waiting.append(dict(row))
        if len(waiting) >= self.part_rows:
            self._write(month)
        elif sum(map(len, self._waiting.values())) >= 2 * self.part_rows:
            self._write(max(self._waiting, key=lambda m: len(self._waiting[m])))

    def flush(self) -> None:
        """Write what waits."""
        for month in list(self._waiting):
            self._write(month)

    def months(self) -> dict[str, tuple[str, ...]]:
        """Return the months that there are rows of, in order, each with its files."""
        found: dict[str, list[str]] = {}
        for path in self.lake.files(self.folder):
            month = path.removeprefix(f"{self.folder}/").partition("/")[0]
            found.setdefault(month.removeprefix("month="), []).append(path)
        return {month: tuple(found[month]) for month in sorted(found)}

    def table(
        self,
        month: str,
        columns: Iterable[str] | None = None,
        low: str | None = None,
        high: str | None = None,
    ) -> pa.Table:
        """Return a month's rows, each once, in order of their keys.

        Parameters
        ----------
        month : str
        columns : iterable of str, optional
            Beside the key; all without it.
        low, high : str, optional
            Only rows whose keys are not below one, nor above the other.
        """
        names = [KEY, *(self.columns if columns is None else columns)]
        schema = self._schema(names)
        try:
            tables = [read_table(self.lake, p, schema, low, high) for p in self._files(month)]
        except StorageError:  # a month may just have been put together: its parts are gone
            tables = [read_table(self.lake, p, schema, low, high) for p in self._files(month)]
        return without_repeats(schema, tables)

    def keys(self, month: str) -> pa.Array[Any]:
        """Return the keys of a month's rows, in order."""
        return self.table(month, ()).column(KEY).combine_chunks()

    def rows(
        self, columns: Iterable[str] | None = None, months: Iterable[str] | None = None
    ) -> Iterator[dict[str, Any]]:
        """Yield the rows, month by month, each month's in order of the keys."""
        for month in self.months() if months is None else months:
            for batch in self.table(month, columns).to_batches(max_chunksize=_GROUP_ROWS):
                yield from batch.to_pylist()

    def tidy(self, month: str, most_parts: int = _PARTS) -> bool:
        """Put a month's rows together where it has more than so many parts; tell whether it was."""
        files = self._files(month)
        if sum("/part-" in path for path in files) <= most_parts:
            return False
        keys = self.keys(month)
        for start in range(0, len(keys), WHOLE_ROWS):
            last = min(start + WHOLE_ROWS, len(keys)) - 1
            table = self.table(month, None, keys[start].as_py(), keys[last].as_py())
            self._put(month, "whole", table)
        self.lake.delete(
            sorted(files, reverse=True)
        )  # parts last: while one is there, so is this due
        return True

    def _files(self, month: str) -> tuple[str, ...]:
        return self.lake.files(f"{self.folder}/month={month}")

    def _write(self, month: str) -> None:
        import pyarrow as pa

        rows = sorted(self._waiting[month], key=lambda row: str(row[KEY]))
        self._put(month, "part", pa.Table.from_pylist(rows, self._schema([KEY, *self.columns])))
        del self._waiting[month]

    def _put(self, month: str, what: str, table: pa.Table) -> None:
        import pyarrow.parquet as pq

        sink = io.BytesIO()
        pq.write_table(table, sink, compression="zstd", row_group_size=_GROUP_ROWS)
        name = f"{what}-{uuid.uuid4().hex}.parquet"
        self.lake.put(f"{self.folder}/month={month}/{name}", sink.getvalue())

    def _schema(self, names: Iterable[str]) -> pa.Schema:
        import pyarrow as pa

        types: Mapping[str, pa.DataType] = {
            "string": pa.string(),
            "double": pa.float64(),
            "int64": pa.int64(),
            "bool": pa.bool_(),
        }
        kinds = {KEY: "string", **self.columns}
        return pa.schema([pa.field(name, types[kinds[name]]) for name in names])
