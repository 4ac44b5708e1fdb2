"""How a drive studio's CSV is to be read: which column is what, in which unit. TOML, validated."""

from __future__ import annotations

import codecs
import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from agent.errors import InputError
from agent.record.recording import FLOAT_COLUMNS
from drivers.errors import why_unreadable

SCHEMA = "stribeck.import/1"
_SUFFIX = ".toml"

DATE = "ISO 8601"
WALL_CLOCKS: Mapping[str, float] = {
    "unix s": 1.0,
    "unix ms": 1e-3,
    "unix ns": 1e-9,
    DATE: 1.0,
}
"""Units of time that also say when it was: seconds since 1970 in one of them."""

UNITS: Mapping[str, float] = {
    **WALL_CLOCKS,
    "s": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "µs": 1e-6,
    "ns": 1e-9,
    "rad": 1.0,
    "mrad": 1e-3,
    "deg": math.pi / 180.0,
    "°": math.pi / 180.0,
    "rev": 2.0 * math.pi,
    "m": 1.0,
    "mm": 1e-3,
    "um": 1e-6,
    "µm": 1e-6,
    "rad/s": 1.0,
    "deg/s": math.pi / 180.0,
    "°/s": math.pi / 180.0,
    "m/s": 1.0,
    "mm/s": 1e-3,
    "m/min": 1.0 / 60.0,
    "rpm": 2.0 * math.pi / 60.0,
    "1/min": 2.0 * math.pi / 60.0,
    "rev/s": 2.0 * math.pi,
    "N m": 1.0,
    "Nm": 1.0,
    "mN m": 1e-3,
    "mNm": 1e-3,
    "N": 1.0,
    "kN": 1e3,
    "%": 1e-2,
    "per mille": 1e-3,
    "A": 1.0,
    "mA": 1e-3,
    "V": 1.0,
    "degC": 1.0,
    "°C": 1.0,
    "inc": 1.0,
    "counts": 1.0,
    "1": 1.0,
}
"""What one of a unit is in SI; of per cent, currents and counts the mapping's `scale` says more.

Of a linear axis 1 rad stands for 1 m, and 1 N m for 1 N.
"""

_ACROSS_THE_GEAR: Mapping[str, int] = {
    "position_rad": 1,
    "velocity_rad_s": 1,
    "position_command_rad": 1,
    "velocity_command_rad_s": 1,
    "torque_nm": -1,
    "torque_simulated_nm": -1,
}
NEEDS_SCALE = ("%", "per mille", "A", "mA", "V", "inc", "counts")
SIDES = ("motor", "arm")
AXIS = "{axis}"


@dataclass(frozen=True)
class ColumnMapping:
    """One column of the file: where it is found, what it becomes.

    SI value = number x unit x scale + offset. `scale` may be the name of a parameter that is said
    when a file is imported. What is told on the arm's side is brought to the motor's by the gear.
    ``{axis}`` in a name stands for the number of the axis that is imported.
    """

    to: str
    unit: str
    name: str = ""
    position: int = 0
    scale: float | str = 1.0
    offset: float = 0.0
    side: str = "motor"

    def of_axis(self, axis: int) -> ColumnMapping:
        """Return the column of one axis, whose number its name may hold."""
        return replace(self, name=self.name.replace(AXIS, str(axis)))

    def across(self, gear_ratio: float) -> float:
        """Return what the column's numbers are multiplied by to be the motor's."""
        return gear_ratio ** _ACROSS_THE_GEAR[self.to] if self.side == "arm" else 1.0

    @property
    def shown(self) -> str:
        """Return how the file calls it."""
        return f"column {self.position}" if self.position else repr(self.name)


@dataclass(frozen=True)
class ImportMapping:
    """How the files of one studio are read."""

    name: str
    delimiter: str
    decimal: str
    encoding: str
    columns: tuple[ColumnMapping, ...]
    skip_lines: int = 0
    names_line: str = ""
    unnamed: bool = False
    units_line: bool = False
    header: Mapping[str, str] = field(default_factory=dict)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Return the names of what must be said when a file has the columns that need it."""
        return tuple(dict.fromkeys(c.scale for c in self.columns if isinstance(c.scale, str)))


def shipped() -> tuple[str, ...]:
    """Return the names of the mappings that come with the product."""
    folder = files("agent.record.importing.mappings")
    names = (entry.name for entry in folder.iterdir() if entry.name.endswith(_SUFFIX))
    return tuple(sorted(name.removesuffix(_SUFFIX) for name in names))


def load_mapping(name_or_path: str) -> ImportMapping:
    """Return a shipped mapping, or one from a file that ends in ``.toml``.

    Raises
    ------
    agent.errors.InputError
        There is none of this name, or with every mistake in it.
    """
    if name_or_path in shipped():
        text = (
            files("agent.record.importing.mappings")
            .joinpath(name_or_path + _SUFFIX)
            .read_text("utf-8")
        )
        return parse_mapping(text, name_or_path)
    if not name_or_path.endswith(_SUFFIX):
        raise InputError(
            f"There is no mapping {name_or_path!r}; shipped: {', '.join(shipped())}.",
            "A mapping of your own is a file that ends in .toml (docs/record.md).",
        )
    try:
        return parse_mapping(Path(name_or_path).read_text(encoding="utf-8-sig"), name_or_path)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"The mapping {name_or_path} cannot be read: {why_unreadable(error)}."
        ) from error


def parse_mapping(text: str, where: str) -> ImportMapping:
    """Parse and check a mapping; see `load_mapping`."""
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{where} is not TOML: {error}.") from error
    problems: list[str] = []
    mapping = _mapping(data, problems)
    if problems or mapping is None:
        raise InputError("\n  - ".join([f"{where} is no mapping:", *problems]))
    return mapping


_KEYS = {"schema", "name", "delimiter", "decimal", "encoding", "lines", "header", "column"}
_LINES = {"skip", "names", "units"}
_COLUMN = {"from", "position", "to", "unit", "scale", "offset", "side"}


def _mapping(data: Mapping[str, Any], problems: list[str]) -> ImportMapping | None:
    lines, header = data.get("lines", {}), data.get("header", {})
    columns = data.get("column", [])
    if data.get("schema") != SCHEMA:
        problems.append(f'schema must be "{SCHEMA}"')
    kinds = (("lines", lines, dict), ("header", header, dict), ("column", columns, list))
    wrong = [name for name, value, kind in kinds if not isinstance(value, kind)]
    if wrong:
        problems.append(f"{wrong[0]} is of the wrong kind")
        return None
    problems += [f"{key}: unknown key" for key in sorted(set(data) - _KEYS)]
    problems += [f"lines.{key}: unknown key" for key in sorted(set(lines) - _LINES)]
    delimiter, decimal = data.get("delimiter", ";"), data.get("decimal", ".")
    if not (isinstance(delimiter, str) and len(delimiter) == 1):
        problems.append("delimiter must be one character")
    if decimal not in (".", ",") or decimal == delimiter:
        problems.append('decimal must be "." or ",", and not the delimiter')
    encoding = str(data.get("encoding", "utf-8-sig"))
    try:
        codecs.lookup(encoding)
    except LookupError:
        problems.append(f"encoding {encoding!r} is not known")
    unnamed = lines.get("names", "") is False
    names_line = "" if unnamed else lines.get("names", "")
    if unnamed and lines.get("units", False):
        problems.append("lines.units: a file without a line of names has none of units")
    for place, pattern in (("lines.names", names_line), *header.items()):
        problems += _bad_pattern(place, pattern)
    skip = lines.get("skip", 0)
    if not isinstance(skip, int) or isinstance(skip, bool) or skip < 0:
        problems.append("lines.skip must be a number of lines, 0 or more")
    found = [_column(i, c, problems) for i, c in enumerate(columns, 1)]
    targets = {c.to for c in found if c is not None}
    problems += [f"no column becomes {n}" for n in ("time_s", "torque_nm") if n not in targets]
    return ImportMapping(
        name=str(data.get("name", "a drive studio")),
        delimiter=str(delimiter),
        decimal=str(decimal),
        encoding=encoding,
        columns=tuple(c for c in found if c is not None),
        skip_lines=skip if isinstance(skip, int) else 0,
        names_line=str(names_line),
        unnamed=unnamed,
        units_line=bool(lines.get("units", False)),
        header={str(k): str(v) for k, v in header.items()},
    )


def _bad_pattern(place: str, pattern: object) -> list[str]:
    try:
        re.compile(str(pattern))
    except re.error as error:
        return [f"{place}: is no regular expression ({error})"]
    return []


def _column(number: int, said: object, problems: list[str]) -> ColumnMapping | None:
    where = f"column {number}"
    if not isinstance(said, dict):
        problems.append(f"{where}: is no table")
        return None
    problems += [f"{where}: {key}: unknown key" for key in sorted(set(said) - _COLUMN)]
    to, unit, scale = said.get("to"), said.get("unit"), said.get("scale", 1.0)
    position, offset = said.get("position", 0), said.get("offset", 0.0)
    before = len(problems)
    if to not in FLOAT_COLUMNS:
        problems.append(f"{where}: to must be one of {', '.join(FLOAT_COLUMNS)}")
    if unit not in UNITS:
        problems.append(f"{where}: unit {unit!r} is not one of {', '.join(UNITS)}")
    if ("from" in said) == (position != 0) or not isinstance(position, int) or position < 0:
        problems.append(f"{where}: give either from (its name) or position (1 is the first)")
    if not isinstance(scale, int | float | str) or not isinstance(offset, int | float):
        problems.append(f"{where}: scale is a number or a parameter's name, offset a number")
    if (unit in WALL_CLOCKS) > (to == "time_s"):
        problems.append(f"{where}: {unit} is a unit of time_s alone")
    if said.get("side", "motor") not in SIDES or ("side" in said and to not in _ACROSS_THE_GEAR):
        problems.append(
            f'{where}: side is "motor" or "arm", of a motor angle, a velocity or a torque'
        )
    if unit in NEEDS_SCALE and "scale" not in said:
        problems.append(f"{where}: {unit} is no SI unit: say by scale what one of it is")
    if len(problems) > before:
        return None
    factor = scale if isinstance(scale, str) else float(scale)
    name = str(said.get("from", "")).strip()
    side = str(said.get("side", "motor"))
    return ColumnMapping(str(to), str(unit), name, int(position), factor, float(offset), side)
