"""What an EDS or DCF says of a drive: its objects, and what of a drive profile it decides.

An EDS is what a vendor promises, and the promise ages: what a drive answers is asked of the drive.
A file is never refused for its dirt; what cannot be understood is a warning with its line.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from drivers.cia402.eds_lines import Option, Section, Warned, decode, sections_of
from drivers.cia402.modes import LADDER
from drivers.cia402.words import Mode, supports_mode

_OBJECT = re.compile(r"([0-9a-f]{4})(?:\s*sub\s*([0-9a-f]{1,2}))?")
_NODE_ID = re.compile(r"\$NODEID", re.IGNORECASE)
_HEX = re.compile(r"[+-]?0x[0-9a-f]+", re.IGNORECASE)
_DECIMAL = re.compile(r"[+-]?[0-9]+")
_TEMPERATURE = re.compile(r"temperatur|\btemp\b|thermal|celsius", re.IGNORECASE)
_ACCESS = ("ro", "wo", "rw", "rwr", "rww", "const")
_TYPE_NAMES = {
    0x02: "i8",
    0x03: "i16",
    0x04: "i32",
    0x05: "u8",
    0x06: "u16",
    0x07: "u32",
    0x08: "f32",
}
_VARIABLE = 0x7


@dataclass(frozen=True)
class EdsObject:
    """One entry as the file describes it; what it leaves out is None or empty."""

    index: int
    subindex: int
    name: str
    data_type: int | None
    access: str
    default: int | None
    mappable: bool
    line: int

    @property
    def key(self) -> str:
        """Return how evidence and journals call it, for example ``0x6007:00``."""
        return f"0x{self.index:04X}:{self.subindex:02X}"

    @property
    def type_name(self) -> str:
        """Return the type as a cell has it, or the file's number."""
        if self.data_type is None:
            return "?"
        return _TYPE_NAMES.get(self.data_type, f"type 0x{self.data_type:X}")


@dataclass(frozen=True)
class Eds:
    """A file that has been read: the device, its objects, and everything that was odd."""

    device: Mapping[str, str]
    objects: Mapping[tuple[int, int], EdsObject]
    warnings: tuple[Warned, ...]

    def get(self, index: int, subindex: int = 0) -> EdsObject | None:
        """Return an entry, None where the file has none."""
        return self.objects.get((index, subindex))


@dataclass(frozen=True)
class Decided:
    """What of a drive profile a file decides.

    Parameters
    ----------
    modes : tuple of str or None
        Of the ladder; None where the file gives 0x6502 no default.
    abort_connection, heartbeat_consumer : int or None
        Defaults of 0x6007 and of the first 0x1016 entry; None where there is no such object.
    rated_torque : int or None
        Default of 0x6076 in mN m; None where there is none.
    software_limits : bool
        Whether 0x607D has both entries.
    temperatures : tuple of EdsObject
        Entries whose name speaks of a temperature.
    warnings : tuple of str
        What this means for a cell.
    """

    modes: tuple[str, ...] | None
    abort_connection: int | None
    heartbeat_consumer: int | None
    rated_torque: int | None
    software_limits: bool
    temperatures: tuple[EdsObject, ...]
    warnings: tuple[str, ...]


def read_eds(data: bytes) -> Eds:
    """Read a file's bytes; never raises for what they hold.

    Parameters
    ----------
    data : bytes
        The whole file.
    """
    text, warned = decode(data)
    sections, more = sections_of(text)
    warned += more
    objects: dict[tuple[int, int], EdsObject] = {}
    for key, section in sections.items():
        match = _OBJECT.fullmatch(key)
        if match is None:
            continue
        index, subindex = int(match[1], 16), int(match[2] or "0", 16)
        entry = _object(section, index, subindex, warned)
        if entry is not None and ((index, subindex) not in objects or match[2]):
            objects[index, subindex] = entry
    if not objects:
        warned.append(Warned(0, "no object of a device is described here: is this an EDS?"))
    device = sections.get("deviceinfo")
    return Eds(
        device=MappingProxyType(
            {n: o.text for n, o in device.options.items()} if device is not None else {}
        ),
        objects=MappingProxyType(objects),
        warnings=tuple(sorted(warned, key=lambda w: w.line)),
    )


def decide(eds: Eds) -> Decided:
    """Return what of a drive profile a file decides, and what to beware of."""
    supported = _default(eds, 0x6502)
    modes = None
    if supported:
        modes = tuple(r.word for r in LADDER if supports_mode(supported, r.mode))
    consumer = eds.get(0x1016, 1)
    decided = Decided(
        modes=modes,
        abort_connection=_default_or_zero(eds, 0x6007),
        heartbeat_consumer=None if consumer is None else (consumer.default or 0),
        rated_torque=_default_or_zero(eds, 0x6076),
        software_limits=eds.get(0x607D, 1) is not None and eds.get(0x607D, 2) is not None,
        temperatures=tuple(
            o
            for o in eds.objects.values()
            if _TEMPERATURE.search(o.name) and o.data_type in _TYPE_NAMES and o.access != "wo"
        ),
        warnings=(),
    )
    return replace(decided, warnings=tuple(_beware(eds, decided, supported)))


def _beware(eds: Eds, decided: Decided, supported: int | None) -> list[str]:
    """Return what the file means for a cell, in sentences."""
    said: list[str] = []
    if eds.get(0x6502) is None or not supported:
        said.append("0x6502 is missing or has no default: the modes must be asked of the drive")
    elif not decided.modes:
        names = [m.name for m in Mode if m and supports_mode(supported, m)]
        said.append(f"no mode of the ladder is offered, only {', '.join(names).lower()}")
    if decided.abort_connection is None:
        said.append("0x6007 is missing: what the drive does when the agent dies must be proven")
    elif decided.abort_connection == 0:
        said.append("0x6007 ships as 0: unless it is set, the drive goes on when the agent dies")
    if decided.heartbeat_consumer is None:
        said.append("0x1016 is missing: the drive cannot miss the agent; bounded moves (pp) only")
    elif decided.heartbeat_consumer == 0:
        said.append("0x1016 ships as 0: it watches nobody until it is set")
    if not decided.rated_torque:
        said.append("0x6076 is missing or 0: the rated torque must come from the cell")
    if eds.get(0x6077) is None:
        said.append("0x6077 is missing: the drive gives no torque")
    if not decided.temperatures:
        said.append("no temperature is named: a probe beside the drive is needed")
    else:
        said.append("no temperature here need be the gearbox's: ask the vendor, or use a probe")
    return said


def _object(section: Section, index: int, subindex: int, warned: list[Warned]) -> EdsObject | None:
    """Return the entry that a section describes, None for the heading of an array or record."""
    options = section.options
    kind = _number(options.get("objecttype"), section, "ObjectType", warned)
    if "datatype" not in options:
        if kind in (None, _VARIABLE) and "subnumber" not in options:
            warned.append(Warned(section.line, f"[{section.name}] has no DataType; skipped"))
        return None
    data_type = _number(options["datatype"], section, "DataType", warned)
    name = options.get("parametername", Option("", section.line))
    if not name.text:
        warned.append(Warned(section.line, f"[{section.name}] has no ParameterName"))
    access = options.get("accesstype", Option("", section.line)).text.lower()
    if access not in _ACCESS:
        warned.append(Warned(section.line, f"[{section.name}] has AccessType {access!r}"))
    value = options.get("parametervalue") or options.get("defaultvalue")
    is_number = data_type in _TYPE_NAMES and data_type != 0x08
    default = _number(value, section, "DefaultValue", warned) if is_number else None
    mapping = _number(options.get("pdomapping"), section, "PDOMapping", warned)
    return EdsObject(
        index=index,
        subindex=subindex,
        name=name.text,
        data_type=data_type,
        access=access,
        default=default,
        mappable=bool(mapping),
        line=section.line,
    )


def _number(option: Option | None, section: Section, what: str, warned: list[Warned]) -> int | None:
    """Return a number as EDS files write it, None with a warning where it is none.

    Hexadecimal may have spaces in it, `$NODEID` counts as 0, and a leading zero is no octal.
    """
    if option is None or not option.text:
        return None
    text = re.sub(r"\s+", "", _NODE_ID.sub("0", option.text))
    total = 0
    for part in re.findall(r"[+-]?[^+-]+", text) or [text]:
        bare = part.rstrip("uUlL") if not _HEX.fullmatch(part) else part
        if _HEX.fullmatch(bare):
            total += int(bare, 16)
        elif _DECIMAL.fullmatch(bare) and len(bare) < 40:
            total += int(bare, 10)
        else:
            warned.append(
                Warned(option.line, f"[{section.name}] {what} is no number: {option.text[:40]!r}")
            )
            return None
    return total


def _default(eds: Eds, index: int) -> int | None:
    entry = eds.get(index)
    return None if entry is None else entry.default


def _default_or_zero(eds: Eds, index: int) -> int | None:
    """Return a default, 0 where the object has none, None where there is no object."""
    entry = eds.get(index)
    return None if entry is None else entry.default or 0
