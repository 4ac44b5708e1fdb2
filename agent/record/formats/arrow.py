"""Arrow tables to columns and back: types, gaps and refusals.

Contract columns become float64 (or text for `phase`), wherever that loses nothing. A column that
the contract does not know comes back as it went in; what NumPy has no exact type for is carried
as opaque Arrow scalars.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from agent.errors import InputError
from agent.record.metadata import KEY, Metadata
from agent.record.recording import FLOAT_COLUMNS, TEXT_COLUMNS, Column, Recording

_EXACT_INTEGER = 2**53  # the largest magnitude up to which float64 holds every integer


def to_columns(table: pa.Table, where: str) -> dict[str, Column]:
    """Return the table's columns as arrays of shape (n,), in order.

    Parameters
    ----------
    table : pyarrow.Table
        As read from a file.
    where : str
        The file, for messages.

    Raises
    ------
    InputError
        A name that occurs twice, or a contract column of the wrong type, with its first such row.
    """
    names = table.column_names
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"{where}: column {twice[0]} occurs more than once.")
    columns: dict[str, Column] = {}
    for name in names:
        values = _decoded(table[name])
        if name in FLOAT_COLUMNS:
            columns[name] = _floats(values, name, where)
        elif name in TEXT_COLUMNS:
            columns[name] = _labels(values, name, where)
        else:
            columns[name] = _kept(values)
    return columns


def to_table(recording: Recording) -> pa.Table:
    """Return the recording as an Arrow table whose schema carries the metadata."""
    arrays = [to_array(values) for values in recording.columns.values()]
    table = pa.Table.from_arrays(arrays, names=list(recording.columns))
    return table.replace_schema_metadata({KEY: recording.metadata.dumps()})


def to_array(values: Column) -> pa.Array[Any]:
    """Return one column as an Arrow array of the type that it came from.

    Raises
    ------
    ValueError
        When the values of an object column are of different kinds.
    """
    if values.dtype.kind != "O":
        native = values.astype(values.dtype.newbyteorder("="), copy=False)
        array: pa.Array[Any] = pa.array(native)
        return array
    items = values.tolist()
    carrier = next((item for item in items if isinstance(item, pa.Scalar)), None)
    if carrier is not None:
        items = [item if item is not None and item.is_valid else None for item in items]
        array = pa.array(items, type=carrier.type)
    else:
        array = _inferred(items)
    return array


def _inferred(items: list[Any]) -> pa.Array[Any]:
    """Return values of one kind, and gaps, as the Arrow array of that kind."""
    try:
        array: pa.Array[Any] = pa.array(items)
    except (pa.ArrowInvalid, pa.ArrowTypeError) as error:
        raise ValueError(f"a column's values must be of one kind ({error})") from error
    return array


def metadata_of(table: pa.Table, where: str) -> Metadata:
    """Return what the schema's key-value metadata says about the run.

    Raises
    ------
    InputError
        When the key is missing or holds something else than the contract's JSON.
    """
    found: Mapping[bytes, bytes] = table.schema.metadata or {}
    text = found.get(KEY.encode())
    if text is None:
        raise InputError(
            f"{where}: the file's key-value metadata has no key {KEY!r}, so that robot, axis and "
            "gear ratio are not known.",
            "Write them there as JSON, or export to CSV with a side file.",
        )
    return Metadata.loads(text, where)


def _decoded(values: pa.ChunkedArray[Any]) -> pa.ChunkedArray[Any]:
    """Return a dictionary-encoded column as what its dictionary holds, others as they are."""
    if not pa.types.is_dictionary(values.type):
        return values
    return values.cast(values.type.value_type)


def _floats(values: pa.ChunkedArray[Any], name: str, where: str) -> Column:
    """Return a contract column as float64; gaps become NaN."""
    kind = values.type
    if pa.types.is_null(kind):
        return np.full(len(values), np.nan)
    if not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
        raise _wrong_type(values, name, where, f"numbers ({FLOAT_COLUMNS[name]})")
    try:
        floats = values.cast(pa.float64())
    except pa.ArrowInvalid as error:
        raise InputError(
            f"{where}: column {name} holds integers beyond 2^53, which cannot be "
            f"{FLOAT_COLUMNS[name]} ({error})."
        ) from error
    return _plain(floats)


def _plain(floats: pa.ChunkedArray[Any]) -> Column:
    """Return float64 values, gaps as NaN, without `to_numpy`, which loads pandas where it is."""
    gap: Any = float("nan")
    whole = floats.fill_null(gap) if floats.null_count else floats
    parts = [np.from_dlpack(chunk) for chunk in whole.chunks if len(chunk)]
    return np.concatenate(parts) if parts else np.zeros(0)


def _labels(values: pa.ChunkedArray[Any], name: str, where: str) -> Column:
    """Return a contract column of text; a gap becomes an empty label."""
    if pa.types.is_null(values.type):
        return np.full(len(values), "", dtype=np.str_)
    if not _is_text(values.type):
        raise _wrong_type(values, name, where, f"text ({TEXT_COLUMNS[name]})")
    encoded: Any = values.cast(pa.string()).combine_chunks().dictionary_encode()
    words = np.array([*encoded.dictionary.to_pylist(), ""], dtype=np.str_)
    codes = encoded.indices
    if codes.null_count:
        codes = codes.fill_null(len(words) - 1)
    labels: Column = words[np.from_dlpack(codes)] if len(codes) else words[:0]
    return labels


def _kept(values: pa.ChunkedArray[Any]) -> Column:
    """Return a column that the contract does not know, unharmed."""
    kind = values.type
    if pa.types.is_floating(kind):
        return np.asarray(values.to_numpy())
    if pa.types.is_integer(kind) and (values.null_count == 0 or _fits_floats(values)):
        return np.asarray(values.to_numpy())
    if pa.types.is_boolean(kind) and values.null_count == 0:
        return np.asarray(values.to_numpy(), dtype=np.bool_)
    plain = pa.types.is_boolean(kind) or pa.types.is_null(kind) or _is_text(kind)
    return _objects(values.to_pylist() if plain else [s for chunk in values.chunks for s in chunk])


def _objects(items: Sequence[object]) -> Column:
    """Return `items` as an object array, never as an array of their parts."""
    out = np.empty(len(items), dtype=object)
    for i, item in enumerate(items):
        out[i] = item
    return out


def _fits_floats(values: pa.ChunkedArray[Any]) -> bool:
    """Tell whether integers with gaps can stand as float64 with NaN and lose nothing."""
    integers: list[Any] = values.drop_null().to_pylist()
    return all(abs(v) <= _EXACT_INTEGER for v in integers)


def _is_text(kind: pa.DataType) -> bool:
    return (
        pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_string_view(kind)
    )


def _wrong_type(values: pa.ChunkedArray[Any], name: str, where: str, expected: str) -> InputError:
    """Return the refusal of a column, with the first row that holds something."""
    if values.null_count == len(values):
        return InputError(
            f"{where}: column {name} must hold {expected}, its type is {values.type}."
        )
    row = values.is_valid().index(True).as_py() + 1
    return InputError(
        f"{where}: column {name} must hold {expected}, but row {row} holds "
        f"{str(values[row - 1])[:40]!r} of type {values.type}."
    )
