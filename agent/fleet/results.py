"""What was computed of a lake, beside it, in Parquet parts that are written whole or not at all.

::

    LAKE/results/KIND/version=V/part-UUID.parquet

One row for each item, with the item's own key: a run that was ended, or a worker that was killed,
loses the rows of its last unwritten part and nothing else. Two runs at once may both compute an
item; its rows are then equal, and the first in order of the parts' names is taken. Another version
of the code has another folder, so that nothing that it computed is mixed in.
"""

from __future__ import annotations

import io
import uuid
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from agent.errors import InputError

if TYPE_CHECKING:
    import pyarrow as pa

    from agent.fleet.lake import Lake

KEY = "key"


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
        So many rows are written together.
    """

    lake: Lake
    kind: str
    version: str
    columns: Mapping[str, str]
    part_rows: int = 256
    _waiting: list[dict[str, Any]] = field(default_factory=list)

    @property
    def folder(self) -> str:
        """Return where they are, below the lake's root."""
        return f"results/{self.kind}/version={self.version}"

    def add(self, row: Mapping[str, Any]) -> None:
        """Take one row; write a part when there are enough."""
        self._waiting.append(dict(row))
        if len(self._waiting) >= self.part_rows:
            self.flush()

    def flush(self) -> None:
        """Write what waits."""
        if not self._waiting:
            return
        import pyarrow as pa
        import pyarrow.parquet as pq

        sink = io.BytesIO()
        pq.write_table(
            pa.Table.from_pylist(self._waiting, schema=self._schema()), sink, compression="zstd"
        )
        self.lake.put(f"{self.folder}/part-{uuid.uuid4().hex}.parquet", sink.getvalue())
        self._waiting.clear()

    def keys(self) -> set[str]:
        """Return the keys of all rows written."""
        return {str(k) for k in self._table((KEY,)).column(KEY).to_pylist()}

    def rows(self, columns: Iterable[str] | None = None) -> list[dict[str, Any]]:
        """Return the rows written, each key once, in order of the keys."""
        wanted = None if columns is None else (KEY, *columns)
        found: dict[str, dict[str, Any]] = {}
        for row in self._table(wanted).to_pylist():
            found.setdefault(str(row[KEY]), row)
        return [found[key] for key in sorted(found)]

    def _schema(self) -> pa.Schema:
        import pyarrow as pa

        fields = [(KEY, "string"), *self.columns.items()]
        types: Mapping[str, pa.DataType] = {
            "string": pa.string(),
            "double": pa.float64(),
            "int64": pa.int64(),
            "bool": pa.bool_(),
        }
        return pa.schema([pa.field(name, types[kind]) for name, kind in fields])

    def _table(self, columns: Sequence[str] | None) -> pa.Table:
        import pyarrow as pa
        import pyarrow.parquet as pq

        names = [KEY, *self.columns] if columns is None else list(columns)
        schema = pa.schema([self._schema().field(name) for name in names])
        tables = [schema.empty_table()]
        for path in self.lake.files(self.folder):
            try:
                # without threads: Arrow's pool was once still at work when the interpreter ended
                with pq.ParquetFile(io.BytesIO(self.lake.get(path))) as part:
                    tables.append(part.read(schema.names, use_threads=False).cast(schema))
            except pa.ArrowException as error:
                raise InputError(
                    f"{self.lake.url}/{path}: is a damaged part of the results ({error}).",
                    "Delete it; what it held is computed again.",
                ) from error
        return pa.concat_tables(tables)
