"""What is in a lake now, a month at a time: months are the unit in which a fleet is worked through.

What lies by itself is listed once, and of it no more than path and size is kept; what is packed is
read from its month's index when that month's turn comes. No step holds more than a month of it.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from agent.fleet.entry import RECORDINGS, Entry, entry_of, is_recording, month_of
from agent.fleet.index import entries_schema, packed, packed_months
from agent.fleet.parquet import without_keys, without_repeats

if TYPE_CHECKING:
    import pyarrow as pa

    from agent.fleet.store import Store

_LEVELS = 2  # of an object store listed one by one: sites, then robots


@dataclass
class Loose:
    """The recordings of one month that lie by themselves: paths, and their sizes in bytes."""

    paths: list[str] = field(default_factory=list)
    sizes: array[int] = field(default_factory=lambda: array("q"))


@dataclass(frozen=True)
class Listing:
    """A lake's recordings as they were when it was listed.

    Parameters
    ----------
    store : Store
    loose : mapping of str to Loose
        By month.
    indices : mapping of str to tuple of str
        Each packed month's index files.
    others : tuple of str
        Paths among the recordings that are none.
    """

    store: Store
    loose: dict[str, Loose]
    indices: dict[str, tuple[str, ...]]
    others: tuple[str, ...]

    @property
    def months(self) -> tuple[str, ...]:
        """Return the months that there is a recording of, in order; ``unknown`` last."""
        return tuple(sorted({*self.loose, *self.indices}))

    def table(self, month: str) -> pa.Table:
        """Return a month's recordings, each once, in order: path, size_bytes, pack, offset.

        What is packed and lies there too (delivered again, or not deleted yet) is taken as packed.
        """
        import pyarrow as pa

        schema = entries_schema()
        own = self.loose.get(month, Loose())
        none = len(own.paths)
        loose = pa.table([own.paths, own.sizes, [""] * none, [0] * none], schema=schema)
        return without_repeats(
            schema, [packed(self.store, self.indices.get(month, ())), loose.cast(schema)]
        )

    def entries(self, month: str, without: pa.Array[Any] | None = None) -> Iterator[Entry]:
        """Yield a month's recordings in order, but for those whose paths are in `without`."""
        table = self.table(month)
        if without is not None:
            table = without_keys(table, without)
        for batch in table.to_batches(max_chunksize=1024):
            for path, size, pack, offset in zip(
                *(column.to_pylist() for column in batch.columns), strict=True
            ):
                entry = entry_of(path, size, pack, offset)
                assert entry is not None
                yield entry


def listed(store: Store) -> Listing:
    """List a lake.

    Raises
    ------
    agent.errors.StorageError
        The store does not answer.
    """
    loose: dict[str, Loose] = {}
    others = []
    for path, size in store.walk(RECORDINGS, _LEVELS):
        if is_recording(path):
            month = loose.setdefault(month_of(path), Loose())
            month.paths.append(path)
            month.sizes.append(size)
        else:
            others.append(path)
    return Listing(store, loose, packed_months(store), tuple(sorted(others)))
