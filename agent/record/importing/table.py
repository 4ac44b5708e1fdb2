"""The lines of a studio's file, and their cells as numbers: every bad line by its number."""

from __future__ import annotations

import csv
import datetime
import math
import re
import zoneinfo
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.errors import InputError
from agent.record.importing.mapping import ImportMapping
from agent.record.recording import Column

_SHOWN = 5  # bad lines that are named; the others are counted
_LONGEST_HEADER = 200
_GAPS = ("", "nan", "n/a", "-")


@dataclass(frozen=True)
class StudioTable:
    """A file's lines, and where in them the samples begin.

    Parameters
    ----------
    lines : sequence of str
        All of them.
    header : sequence of str
        Those before the names.
    names, units : sequence of str
        Of the columns; no units where the file has no line of them.
    first : int
        Index of the first line with samples.
    mapping : ImportMapping
    """

    lines: Sequence[str]
    header: Sequence[str]
    names: Sequence[str]
    units: Sequence[str]
    first: int
    mapping: ImportMapping

    def unit(self, index: int) -> str:
        """Return the unit that the file tells of a column; empty where it tells none."""
        return self.units[index] if index < len(self.units) else ""

    def columns(
        self, wanted: Collection[int], dates: Collection[int], time_zone: str, path: Path
    ) -> list[Column]:
        """Return the columns, each of shape (n,): numbers, or what was written.

        Parameters
        ----------
        wanted : collection of int
            Columns that must be numbers.
        dates : collection of int
            Those of them that hold date and time: seconds since 1970 come back.
        time_zone : str
            In which a date without an offset is told.
        path : pathlib.Path
            The file, for messages.

        Raises
        ------
        agent.errors.InputError
            With the numbers of all lines that are bad.
        """
        zone = _zone(time_zone) if dates else datetime.UTC
        width, bad = len(self.names), list[str]()
        rows: list[list[str]] = []
        numbers: list[list[float]] = []
        for number, cells in enumerate(_rows(self.lines[self.first :], self.mapping), 1):
            line = self.first + number
            if len(cells) == width + 1 and not cells[-1].strip():
                cells.pop()  # some studios end each line with the delimiter
            if len(cells) != width:
                bad.append(f"line {line} has {len(cells)} cells, not {width}")
                continue
            try:
                numbers.append(
                    [
                        _moment(cells[i], zone)
                        if i in dates
                        else _number(cells[i], self.mapping.decimal)
                        for i in wanted
                    ]
                )
            except ValueError as error:
                bad.append(f"line {line} holds {error}")
                continue
            rows.append(cells)
        if bad:
            more = f" and {len(bad) - _SHOWN} more" if len(bad) > _SHOWN else ""
            raise InputError(
                f"{path}: {len(bad)} of {len(self.lines) - self.first} lines are bad: "
                f"{'; '.join(bad[:_SHOWN])}{more}."
            )
        table = np.array(numbers, dtype=np.float64).reshape(-1, len(wanted))
        found = dict(zip(wanted, table.T, strict=True))
        return [
            found[i] if i in found else self._kept([row[i] for row in rows]) for i in range(width)
        ]

    def _kept(self, cells: Sequence[str]) -> Column:
        """Return a column that nobody asked for: numbers where all of it is, else its text."""
        try:
            return np.array([_number(cell, self.mapping.decimal) for cell in cells])
        except ValueError:
            return np.array([cell.strip() for cell in cells], dtype=object)


def read_lines(path: Path, mapping: ImportMapping) -> StudioTable:
    """Read a file's lines, and find names, units and the first sample.

    Raises
    ------
    agent.errors.InputError
        It cannot be read, is no text in the mapping's encoding, is empty, or no line names the
        columns.
    """
    lines = _lines(path, mapping.encoding)
    at = _names_at(lines, mapping, path)
    if mapping.unnamed:
        width = len(_cells(lines[at], mapping))
        names = [f"column {i}" for i in range(1, width + 1)]
        return StudioTable(lines, lines[:at], names, (), at, mapping)
    first = at + 1
    units: list[str] = []
    if mapping.units_line:
        units = _cells(lines[first], mapping) if first < len(lines) else []
        first += 1
    return StudioTable(lines, lines[:at], _cells(lines[at], mapping), units, first, mapping)


def _lines(path: Path, encoding: str) -> list[str]:
    try:
        text = path.read_bytes().decode(encoding)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}).") from error
    except UnicodeDecodeError as error:
        number = path.read_bytes()[: error.start].count(b"\n") + 1
        raise InputError(
            f"{path}: line {number} is not text in {encoding}.", "Say its encoding in the mapping."
        ) from error
    lines = text.splitlines()
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise InputError(f"{path}: is empty.")
    return lines


def _names_at(lines: Sequence[str], mapping: ImportMapping, path: Path) -> int:
    """Return the index of the line that names the columns."""
    if not mapping.names_line:
        what = "samples" if mapping.unnamed else "names"
        if mapping.skip_lines >= len(lines):
            raise InputError(
                f"{path}: has {len(lines)} lines, and the {what} should follow "
                f"{mapping.skip_lines} others."
            )
        return mapping.skip_lines
    pattern = re.compile(mapping.names_line)
    for index in range(mapping.skip_lines, min(len(lines), _LONGEST_HEADER)):
        if pattern.search(lines[index]):
            return index
    raise InputError(
        f"{path}: none of the first {min(len(lines), _LONGEST_HEADER)} lines names the columns as "
        f"{mapping.name} does (expected {mapping.names_line!r})."
    )


def _cells(line: str, mapping: ImportMapping) -> list[str]:
    return [cell.strip() for cell in next(_rows([line], mapping), [])]


def _rows(lines: Sequence[str], mapping: ImportMapping) -> Iterator[list[str]]:
    """Return the cells of each line; any number of blanks in a row is one delimiter."""
    if mapping.delimiter == " ":
        return (line.split() for line in lines)
    return csv.reader(lines, delimiter=mapping.delimiter)


def _number(cell: str, decimal: str) -> float:
    """Return a cell's number, a gap as NaN; ValueError with what it is otherwise."""
    text = cell.strip()
    if text.lower() in _GAPS:
        return math.nan
    other = "," if decimal == "." else "."
    plain = text.replace(decimal, ".")
    if other in text or not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", plain):
        hint = f" (the decimal mark is {decimal!r})" if other in text else ""
        raise ValueError(f"{text[:40]!r}, which is no number{hint}")
    return float(plain)


def _moment(cell: str, zone: datetime.tzinfo) -> float:
    """Return seconds since 1970 of a date and time; ValueError where it is none."""
    try:
        told = datetime.datetime.fromisoformat(cell.strip())
    except ValueError as error:
        raise ValueError(f"{cell.strip()[:40]!r}, which is no date and time") from error
    return (told if told.tzinfo else told.replace(tzinfo=zone)).timestamp()


def _zone(name: str) -> datetime.tzinfo:
    try:
        return zoneinfo.ZoneInfo(name)
    except (zoneinfo.ZoneInfoNotFoundError, OSError, ValueError) as error:
        raise InputError(f"The time zone {name!r} is not known.") from error
