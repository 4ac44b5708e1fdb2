"""Rows in, Arrow batches out: one buffer, allocated once, so that a tick costs a microsecond."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from agent.record.recording import NEEDED_COLUMNS, TEXT_COLUMNS

Kind = Literal["float", "integer", "boolean", "text"]

CAPACITY_ROWS = 8192  # half a second at 16 kHz


class _Form(NamedTuple):
    """How a kind of value is packed, seen by NumPy, and written by Arrow."""

    code: str
    dtype: str
    arrow: pa.DataType


_FORMS: Mapping[Kind, _Form] = {
    "float": _Form("d", "<f8", pa.float64()),
    "integer": _Form("q", "<i8", pa.int64()),
    "boolean": _Form("?", "?", pa.bool_()),
    "text": _Form("I", "<u4", pa.string()),  # packed as the number of the word
}


class PackedRows(NamedTuple):
    """Rows on their way to a batch."""

    content: bytes
    words: tuple[str, ...]  # what the numbers in text columns stand for
    rows: int
    first_s: float  # time of the first row; NaN where nobody asked for it


class RowBuffer:
    """Packs rows until they leave as one batch.

    Parameters
    ----------
    columns : sequence of str
        Names in the order of a row's values.
    kinds : mapping of str to str
        "float", "integer", "boolean" or "text"; what is not named is text where the contract
        says so (`phase`), and float otherwise.

    Raises
    ------
    ValueError
        When names or kinds cannot make a recording.
    """

    def __init__(self, columns: Sequence[str], kinds: Mapping[str, Kind]) -> None:
        _check(columns, kinds)
        self.kinds: dict[str, Kind] = {
            name: kinds.get(name, "text" if name in TEXT_COLUMNS else "float") for name in columns
        }
        forms = {name: _FORMS[kind] for name, kind in self.kinds.items()}
        layout = struct.Struct("<" + "".join(form.code for form in forms.values()))
        self.schema = pa.schema([(name, form.arrow) for name, form in forms.items()])
        self._pack_into = layout.pack_into
        self._row_bytes = layout.size
        self._dtype = np.dtype([(name, form.dtype) for name, form in forms.items()])
        self._texts = tuple(i for i, kind in enumerate(self.kinds.values()) if kind == "text")
        self._words: dict[str, int] = {}
        self._bytes = bytearray(CAPACITY_ROWS * self._row_bytes)
        self._fill = 0
        self._warm_up()

    def __len__(self) -> int:
        """Return how many rows wait."""
        return self._fill // self._row_bytes

    @property
    def full(self) -> bool:
        """Tell whether the next row would find no room."""
        return self._fill == len(self._bytes)

    def append(self, row: Sequence[Any]) -> None:
        """Pack one row; there must be room for it.

        Raises
        ------
        ValueError
            When the row has another length, or a value is of another kind than its column.
        """
        values = list(row)
        try:
            for i in self._texts:
                values[i] = self._words[values[i]]
            self._pack_into(self._bytes, self._fill, *values)
        except (KeyError, IndexError, TypeError, struct.error) as error:
            self._append_slowly(row, error)
        self._fill += self._row_bytes

    def packed(self, first_s: float = math.nan) -> PackedRows:
        """Return a copy of all rows, cheaply; they stay until `clear`."""
        content = bytes(memoryview(self._bytes)[: self._fill])
        return PackedRows(content, tuple(self._words), len(self), first_s)

    def batch(self, rows: PackedRows) -> pa.RecordBatch:
        """Return packed rows of this buffer as one batch; any thread may ask."""
        packed = np.frombuffer(rows.content, dtype=self._dtype)
        arrays = [_array(kind, packed[name], rows.words) for name, kind in self.kinds.items()]
        return pa.RecordBatch.from_arrays(arrays, schema=self.schema)

    def clear(self) -> None:
        """Start again with no rows, and with no words, so that free text cannot pile up."""
        self._fill = 0
        self._words.clear()

    def _warm_up(self) -> None:
        """Make one batch for nothing: Arrow's first costs a tenth of a second.

        The control tick that appends the first row feeds the drive's watchdog as well.
        """
        blank: dict[Kind, Any] = {"float": 0.0, "integer": 0, "boolean": False, "text": ""}
        self.append([blank[kind] for kind in self.kinds.values()])
        self.batch(self.packed()).serialize()
        self.clear()

    def _append_slowly(self, row: Sequence[Any], cause: Exception) -> None:
        """Pack a row in which a word is new, or say what is wrong with it."""
        if len(row) != len(self.kinds):
            raise ValueError(f"expected a row of {len(self.kinds)} values, got {len(row)}")
        values = list(row)
        for i in self._texts:
            if not isinstance(values[i], str):
                break
            values[i] = self._words.setdefault(values[i], len(self._words))
        else:
            try:
                self._pack_into(self._bytes, self._fill, *values)
            except struct.error as error:
                cause = error
            else:
                return
        got = ", ".join(f"{name}={value!r}" for name, value in zip(self.kinds, row, strict=True))
        raise ValueError(f"a value is not of its column's kind: {got} ({cause})") from cause


def _check(columns: Sequence[str], kinds: Mapping[str, Kind]) -> None:
    """Refuse names and kinds that cannot make a recording."""
    if len(set(columns)) != len(columns):
        raise ValueError(f"expected every column once, got {list(columns)}")
    missing = [name for name in NEEDED_COLUMNS if name not in columns]
    if missing:
        raise ValueError(f"expected columns {', '.join(missing)}, got {list(columns)}")
    unknown = sorted(set(kinds) - set(columns))
    if unknown:
        raise ValueError(f"kinds are given for columns that are not there: {unknown}")
    if kinds.get("time_s", "float") != "float":
        raise ValueError(f"time_s must be float, got {kinds['time_s']}")


def _array(kind: Kind, values: NDArray[Any], words: Sequence[str]) -> pa.Array[Any]:
    """Return a column as Arrow has it in memory, made without `pa.array`.

    That loads pandas where it is, which takes a second, on a busy machine twenty: with the device
    open, and nobody counting up what says that we are alive.
    """
    if kind != "text":
        content = np.packbits(values, bitorder="little") if kind == "boolean" else values
        return _of(_FORMS[kind].arrow, values.shape[0], content.tobytes())
    encoded = [word.encode() for word in words]
    ends = np.cumsum([0, *map(len, encoded)], dtype="<i4")
    known = _of(pa.string(), len(encoded), ends.tobytes(), b"".join(encoded))
    return known.take(_of(pa.uint32(), values.shape[0], values.tobytes()))


def _of(of: pa.DataType, rows: int, *contents: bytes) -> pa.Array[Any]:
    """Return an array without gaps, of `rows` values that are in memory already."""
    return pa.Array.from_buffers(of, rows, [None, *map(pa.py_buffer, contents)])
