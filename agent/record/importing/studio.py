"""A drive studio's CSV becomes a recording: every bad line by its number, nothing guessed."""

from __future__ import annotations

import csv
import datetime
import hashlib
import math
import re
import zoneinfo
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from agent.errors import InputError
from agent.record.checks import check
from agent.record.importing.mapping import UNITS, ColumnMapping, ImportMapping
from agent.record.recording import Column, Metadata, Recording

_SHOWN = 5  # bad lines that are named; the others are counted
_LONGEST_HEADER = 200
_GAPS = ("", "nan", "n/a", "-")


@dataclass(frozen=True)
class Joint:
    """What a studio's file does not say of itself.

    Parameters
    ----------
    robot, axis, gear_ratio
        Whose joint.
    parameters : mapping of str to float
        What the mapping's scales are called: rated torque, counts ...
    time_zone : str
        In which the studio's computer tells the time.
    payload_kg : float, optional
    notes : str
    """

    robot: str
    axis: int
    gear_ratio: float
    parameters: Mapping[str, float]
    time_zone: str = "UTC"
    payload_kg: float | None = None
    notes: str = ""


def import_csv(path: Path, mapping: ImportMapping, joint: Joint) -> Recording:
    """Read a studio's file as a recording.

    Parameters
    ----------
    path : pathlib.Path
        The file as the studio has saved it.
    mapping : ImportMapping
        How it is to be read.
    joint : Joint
        What it does not say.

    Raises
    ------
    agent.errors.InputError
        The file cannot be read, a needed column or parameter is missing, a unit is another than
        the mapping's, or lines are bad: each with its number.
    """
    lines = _lines(path, mapping.encoding)
    names_at = _names_at(lines, mapping, path)
    names = _cells(lines[names_at], mapping)
    first = names_at + 1
    units: list[str] = []
    if mapping.units_line:
        units = _cells(lines[first], mapping) if first < len(lines) else []
        first += 1
    chosen = _chosen(names, units, mapping, path, first)
    table = _numbers(lines, first, len(names), mapping, path)
    columns = _columns(table, names, units, chosen, joint, path)
    _insist_on_time(columns["time_s"], first, path)
    check(columns, str(path))
    return Recording(columns, _metadata(lines[:names_at], mapping, joint, path), str(path))


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
        if mapping.skip_lines >= len(lines):
            raise InputError(
                f"{path}: has {len(lines)} lines, and the names should follow "
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
    row = next(csv.reader([line], delimiter=mapping.delimiter), [])
    return [cell.strip() for cell in row]


def _chosen(
    names: Sequence[str],
    units: Sequence[str],
    mapping: ImportMapping,
    path: Path,
    first: int,
) -> dict[int, ColumnMapping]:
    """Return which column of the file becomes which of ours; the mapping's first match counts."""
    chosen: dict[int, ColumnMapping] = {}
    taken: set[str] = set()
    for column in mapping.columns:
        if column.to in taken:
            continue
        if column.position:
            index = column.position - 1 if column.position <= len(names) else None
        else:
            index = next((i for i, name in enumerate(names) if name == column.name), None)
        if index is None:
            continue
        found = units[index] if index < len(units) else ""
        if mapping.units_line and found != column.unit:
            raise InputError(
                f"{path}: line {first}: {column.shown} is in {found!r}, the mapping expects "
                f"{column.unit!r}.",
                "Change the unit in a mapping of your own.",
            )
        chosen[index] = column
        taken.add(column.to)
    for needed in ("time_s", "torque_nm"):
        if needed not in taken:
            wanted = " or ".join(c.shown for c in mapping.columns if c.to == needed)
            have = ", ".join(name for name in names if name) or "no names"
            raise InputError(f"{path}: needs {wanted} for {needed}; the file has {have}.")
    return chosen


def _numbers(
    lines: Sequence[str], first: int, width: int, mapping: ImportMapping, path: Path
) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the samples, shape (n, width); refuse with the numbers of all lines that are none."""
    bad: list[str] = []
    rows: list[list[float]] = []
    reader = csv.reader(lines[first:], delimiter=mapping.delimiter)
    for number, cells in enumerate(reader, first + 1):
        if len(cells) == width + 1 and not cells[-1].strip():
            cells.pop()  # some studios end each line with the delimiter
        if len(cells) != width:
            bad.append(f"line {number} has {len(cells)} cells, not {width}")
            continue
        try:
            rows.append([_number(cell, mapping.decimal) for cell in cells])
        except ValueError as error:
            bad.append(f"line {number} holds {error}")
    if bad:
        more = f" and {len(bad) - _SHOWN} more" if len(bad) > _SHOWN else ""
        raise InputError(
            f"{path}: {len(bad)} of {len(lines) - first} lines are bad: "
            f"{'; '.join(bad[:_SHOWN])}{more}."
        )
    return np.array(rows, dtype=np.float64).reshape(-1, width)


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


def _columns(
    table: np.ndarray[Any, np.dtype[np.float64]],
    names: Sequence[str],
    units: Sequence[str],
    chosen: Mapping[int, ColumnMapping],
    joint: Joint,
    path: Path,
) -> dict[str, Column]:
    """Return our columns in SI, then the file's others under their own names and units."""
    columns: dict[str, Column] = {}
    for index, column in chosen.items():
        values = table[:, index] * UNITS[column.unit] * _scale(column, joint, path) + column.offset
        columns[column.to] = values
    columns["time_s"] = columns["time_s"] - columns["time_s"][:1].sum()
    for index, name in enumerate(names):
        if index not in chosen and name:
            unit = f" [{units[index]}]" if index < len(units) and units[index] else ""
            columns.setdefault(f"{name}{unit}", table[:, index])
    return columns


def _scale(column: ColumnMapping, joint: Joint, path: Path) -> float:
    if not isinstance(column.scale, str):
        return column.scale
    value = joint.parameters.get(column.scale)
    if value is None:
        raise InputError(
            f"{path}: {column.shown} is in {column.unit}, and nobody has said {column.scale}.",
            f"Say --set {column.scale}=NUMBER.",
        )
    return value


def _insist_on_time(time_s: Column, first: int, path: Path) -> None:
    """Refuse time that stands still, by the file's own line."""
    wrong = np.flatnonzero(np.diff(time_s) <= 0.0)
    if wrong.size:
        raise InputError(
            f"{path}: line {first + int(wrong[0]) + 2}: time must increase, but it does not "
            f"({wrong.size} such lines)."
        )


def _metadata(header: Sequence[str], mapping: ImportMapping, joint: Joint, path: Path) -> Metadata:
    found = {}
    for key, pattern in mapping.header.items():
        match = next((m for line in header if (m := re.search(pattern, line))), None)
        if match is not None:
            found[key] = match[1].strip()
    started_at = _in_utc(found.pop("started_at", ""), joint.time_zone, path)
    parameters = {name: joint.parameters[name] for name in sorted(joint.parameters)}
    try:
        return Metadata(
            robot=joint.robot,
            axis=joint.axis,
            gear_ratio=joint.gear_ratio,
            started_at=started_at,
            payload_kg=joint.payload_kg,
            notes=joint.notes,
            extra={
                "imported": {
                    "file": path.name,
                    "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
                    "mapping": mapping.name,
                    "parameters": parameters,
                    "header": [line[:200] for line in header],
                    **found,
                }
            },
        )
    except ValueError as error:
        raise InputError(f"{path}: {error}.") from error


def _in_utc(text: str, zone: str, path: Path) -> str:
    """Return a studio's local time in UTC; empty where it says none."""
    if not text:
        return ""
    try:
        local = datetime.datetime.fromisoformat(text)
        aware = local if local.tzinfo else local.replace(tzinfo=zoneinfo.ZoneInfo(zone))
    except (zoneinfo.ZoneInfoNotFoundError, OSError) as error:
        raise InputError(f"The time zone {zone!r} is not known.") from error
    except ValueError as error:
        raise InputError(f"{path}: {text!r} is no date and time.") from error
    return aware.astimezone(datetime.UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
