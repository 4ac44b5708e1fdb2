"""CSV in and out: commas, points, a header of names, and NAME.json with the metadata beside it.

A semicolon or a decimal comma is refused rather than guessed: "1,234" is two different numbers in
two countries. Types are read from the text, because CSV has none: a column whose first cell is
quoted is text, otherwise integers, booleans, floats and text are tried in this order. Contract
columns are always numbers (`phase`: text), quoted or not.
"""

from __future__ import annotations

import bisect
import csv
import io
from pathlib import Path
from typing import Any, Literal

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pacsv

from agent.errors import InputError
from agent.record.recording import FLOAT_COLUMNS, TEXT_COLUMNS

_PREFIX_LETTERS = 1 << 16  # the header and the first row are looked for in this much of the file
_GAPS = ("", "nan", "na", "n/a", "null", "none")


def read_table(path: Path, where: str) -> pa.Table:
    """Return the columns of a CSV file, typed by their text.

    Raises
    ------
    InputError
        Another separator, a ragged row, a cell that is not a number: with row and column.
    """
    content = path.read_bytes()
    names, quoted = _head(_decoded(content, where), where)
    text = _read_text(content, names, where)
    columns = []
    for name, values, is_quoted in zip(names, text.columns, quoted, strict=True):
        if name in FLOAT_COLUMNS:
            columns.append(_numbers(values, name, where))
        elif name in TEXT_COLUMNS or is_quoted:
            columns.append(values)
        else:
            columns.append(_guessed(values))
    return pa.Table.from_arrays(columns, names=names)


def to_bytes(table: pa.Table) -> bytes:
    """Return the table as CSV: a header, then one line a row, text quoted, gaps empty.

    Raises
    ------
    ValueError
        When a column is of a type that CSV cannot hold.
    """
    sink = pa.BufferOutputStream()
    try:
        pacsv.write_csv(table, sink)
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
        raise ValueError(f"a column cannot be written as CSV, write Parquet ({error})") from error
    return sink.getvalue().to_pybytes()


def _decoded(content: bytes, where: str) -> str:
    """Return the beginning of the file as text, when all of it is text."""
    try:
        return content.decode("utf-8-sig")[:_PREFIX_LETTERS]
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(f"{where}: line {line} is not text in UTF-8.") from error


def _head(prefix: str, where: str) -> tuple[list[str], list[bool]]:
    """Return the header's names, and which of the first row's cells are quoted."""
    header = next(csv.reader(io.StringIO(prefix)), [])
    names = [name.strip() for name in header]
    for separator, word in ((";", "semicolons"), ("\t", "tabs")):
        if len(names) == 1 and separator in names[0]:
            raise InputError(
                f"{where}: the columns are separated by {word}; expected commas, and points in "
                "decimal numbers."
            )
    if names and all(_is_number(name) for name in names):
        raise InputError(f"{where}: the first line must name the columns, but it holds numbers.")
    cells = _first_row_quoted(prefix)
    return names, (cells + [False] * len(names))[: len(names)]


def _first_row_quoted(prefix: str) -> list[bool]:
    """Tell, for each cell of the first row behind the header, whether it is quoted."""
    rows: list[list[bool]] = [[]]
    inside, at_start = False, True
    for character in prefix:
        if at_start:
            rows[-1].append(character == '"')
            at_start = False
        if character == '"':
            inside = not inside
        elif character == "," and not inside:
            at_start = True
        elif character == "\n" and not inside:
            if len(rows) == 2:
                break
            rows.append([])
            at_start = True
    return rows[1] if len(rows) > 1 else []


def _read_text(content: bytes, names: list[str], where: str) -> pa.Table:
    """Return every cell as text; an empty cell that is not quoted is a gap."""
    ragged: list[pacsv.InvalidRow] = []

    def remember(row: pacsv.InvalidRow) -> Literal["skip", "error"]:
        ragged.append(row)
        return "error"

    try:
        return pacsv.read_csv(
            io.BytesIO(content),
            # one thread: only then does Arrow know the number of a row that it cannot read
            read_options=pacsv.ReadOptions(use_threads=False, column_names=names, skip_rows=1),
            parse_options=pacsv.ParseOptions(newlines_in_values=True, invalid_row_handler=remember),
            convert_options=pacsv.ConvertOptions(
                column_types={name: pa.string() for name in names},
                strings_can_be_null=True,
                quoted_strings_can_be_null=False,
                null_values=[""],
            ),
        )
    except pa.ArrowInvalid as error:
        if ragged:
            row = ragged[0]
            raise InputError(
                f"{where}: line {row.number} has {row.actual_columns} cells, but the header "
                f"names {row.expected_columns} columns."
            ) from error
        if "Empty CSV" in str(error):  # a header, and nothing behind it
            return pa.table({name: pa.array([], pa.string()) for name in names})
        reason = " ".join(str(error).split())[:160]
        raise InputError(f"{where}: cannot be read as CSV ({reason}).") from error


def _numbers(values: pa.ChunkedArray[Any], name: str, where: str) -> pa.ChunkedArray[Any]:
    """Return a contract column's cells as float64."""
    floats = _as_floats(values)
    if floats is not None:
        return floats
    prefixes = range(len(values) + 1)
    row = bisect.bisect_left(prefixes, True, key=lambda n: _as_floats(values.slice(0, n)) is None)
    cell = str(values[row - 1].as_py())
    hint = " (the decimal mark must be a point)" if "," in cell else ""
    raise InputError(
        f"{where}: column {name} must hold numbers ({FLOAT_COLUMNS[name]}), but row {row} holds "
        f"{cell[:40]!r}{hint}."
    )


def _as_floats(values: pa.ChunkedArray[Any]) -> pa.ChunkedArray[Any] | None:
    """Return cells as float64, words for a gap as gaps; None when a cell is no number."""
    try:
        return values.cast(pa.float64())
    except pa.ArrowInvalid:  # blanks around a number, or a word for a gap
        trimmed = pc.utf8_trim_whitespace(values)
        is_gap = pc.is_in(pc.utf8_lower(trimmed), value_set=pa.array(_GAPS))
        try:
            floats: pa.ChunkedArray[Any] = pc.if_else(is_gap, None, trimmed).cast(pa.float64())
        except pa.ArrowInvalid:
            return None
        return floats


def _guessed(values: pa.ChunkedArray[Any]) -> pa.ChunkedArray[Any]:
    """Return a column that the contract does not know as the first type that all cells have."""
    if values.null_count == len(values):
        return values
    for kind in (pa.int64(), pa.bool_()):
        try:
            return values.cast(kind)
        except pa.ArrowInvalid:
            continue
    floats = _as_floats(values)
    return values if floats is None else floats


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
