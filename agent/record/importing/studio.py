"""A drive studio's CSV becomes a recording: every bad line by its number, nothing guessed."""

from __future__ import annotations

import datetime
import hashlib
import re
import zoneinfo
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.errors import InputError, UsageError
from agent.record.checks import check
from agent.record.importing.mapping import (
    DATE,
    UNITS,
    WALL_CLOCKS,
    ColumnMapping,
    ImportMapping,
)
from agent.record.importing.table import StudioTable, read_lines
from agent.record.recording import Column, Metadata, Recording


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
    table = read_lines(path, mapping)
    chosen = _chosen(table, mapping, joint, path)
    dates = [i for i, column in chosen.items() if column.unit == DATE]
    cells = table.columns(chosen, dates, joint.time_zone, path)
    columns = _columns(cells, table, chosen, joint, path)
    began_s = _began(columns, chosen)
    columns["time_s"] = columns["time_s"] - columns["time_s"][:1].sum()
    _insist_on_time(columns["time_s"], table.first, path)
    check(columns, str(path))
    return Recording(columns, _metadata(table.header, mapping, joint, began_s, path), str(path))


def _chosen(
    table: StudioTable, mapping: ImportMapping, joint: Joint, path: Path
) -> dict[int, ColumnMapping]:
    """Return which column of the file becomes which of ours; the mapping's first match counts."""
    chosen: dict[int, ColumnMapping] = {}
    taken: set[str] = set()
    columns = [column.of_axis(joint.axis) for column in mapping.columns]
    for column in columns:
        index = _place(table.names, column)
        if column.to in taken or index is None:
            continue
        if mapping.units_line and table.unit(index) != column.unit:
            raise InputError(
                f"{path}: line {table.first}: {column.shown} is in {table.unit(index)!r}, the "
                f"mapping expects {column.unit!r}.",
                "Change the unit in a mapping of your own.",
            )
        chosen[index] = column
        taken.add(column.to)
    for needed in ("time_s", "torque_nm"):
        if needed not in taken:
            wanted = " or ".join(c.shown for c in columns if c.to == needed)
            have = ", ".join(name for name in table.names if name) or "no names"
            raise InputError(f"{path}: needs {wanted} for {needed}; the file has {have}.")
    return chosen


def _place(names: Sequence[str], column: ColumnMapping) -> int | None:
    """Return where in the file a column stands; None where it does not."""
    if column.position:
        return column.position - 1 if column.position <= len(names) else None
    return next((i for i, name in enumerate(names) if name == column.name), None)


def _columns(
    cells: Sequence[Column],
    table: StudioTable,
    chosen: Mapping[int, ColumnMapping],
    joint: Joint,
    path: Path,
) -> dict[str, Column]:
    """Return our columns in SI, then the file's others under their own names and units."""
    columns: dict[str, Column] = {}
    for index, column in chosen.items():
        factor = _scale(column, joint, path) * column.across(joint.gear_ratio)
        columns[column.to] = cells[index] * UNITS[column.unit] * factor + column.offset
    for index, name in enumerate(table.names):
        if index not in chosen and name:
            unit = f" [{table.unit(index)}]" if table.unit(index) else ""
            columns.setdefault(f"{name}{unit}", cells[index])
    return columns


def _began(columns: Mapping[str, Column], chosen: Mapping[int, ColumnMapping]) -> float | None:
    """Return when the first sample was taken, seconds since 1970, where the stamps tell it."""
    told = any(c.to == "time_s" and c.unit in WALL_CLOCKS for c in chosen.values())
    first = columns["time_s"][:1]
    return float(first[0]) if told and first.size and np.isfinite(first[0]) else None


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


def _metadata(
    header: Sequence[str],
    mapping: ImportMapping,
    joint: Joint,
    began_s: float | None,
    path: Path,
) -> Metadata:
    found = {}
    for key, pattern in mapping.header.items():
        match = next((m for line in header if (m := re.search(pattern, line))), None)
        if match is not None:
            found[key] = match[1].strip()
    started_at = _in_utc(found.pop("started_at", ""), joint.time_zone, path)
    if began_s is not None:
        started_at = _utc(datetime.datetime.fromtimestamp(began_s, datetime.UTC))
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
        raise UsageError(f"--time-zone: {zone!r} is not known.") from error
    except ValueError as error:
        raise InputError(f"{path}: {text!r} is no date and time.") from error
    return _utc(aware.astimezone(datetime.UTC))


def _utc(moment: datetime.datetime) -> str:
    return moment.isoformat(timespec="seconds").replace("+00:00", "Z")
