"""The fake's object dictionary, built from our own generic EDS (CiA 306) alone."""

from __future__ import annotations

import configparser
import re
import struct
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources

Value = int | bytes

VISIBLE_STRING = 0x09
STRING_TYPES = (VISIBLE_STRING, 0x0A, 0x0F)
LONGEST_STRING = 256
NUMBER_FORMATS = {0x02: "b", 0x03: "h", 0x04: "i", 0x05: "B", 0x06: "H", 0x07: "I"}

TOGGLE_NOT_ALTERNATED = 0x05030000
COMMAND_UNKNOWN = 0x05040001
OUT_OF_MEMORY = 0x05040005
WRITE_ONLY = 0x06010001
READ_ONLY = 0x06010002
SUBINDEX_ZERO_FIRST = 0x06010003
NO_OBJECT = 0x06020000
NOT_MAPPABLE = 0x06040041
PDO_TOO_LONG = 0x06040042
LENGTH_MISMATCH = 0x06070010
NO_SUBINDEX = 0x06090011
VALUE_RANGE = 0x06090030
NOT_IN_THIS_STATE = 0x08000022
NO_DATA = 0x08000024

_SECTION = re.compile(r"([0-9A-Fa-f]{4})(?:sub([0-9A-Fa-f]+))?")
_NODE_ID = re.compile(r"\+?\$NODEID\+?", re.IGNORECASE)


class SdoAbortError(Exception):
    """An access that the dictionary refuses, with CiA 301's abort code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"SDO abort 0x{code:08X}")
        self.code = code


@dataclass(frozen=True, slots=True)
class Entry:
    """One sub-object as the EDS describes it; `default` has the node id already added."""

    index: int
    subindex: int
    name: str
    data_type: int
    access: str
    default: Value
    low: int
    high: int
    pdo_mappable: bool

    @property
    def key(self) -> int:
        """Return the dictionary's key: index and sub-index in one number."""
        return self.index << 8 | self.subindex

    @property
    def format(self) -> str:
        """Return the struct code of a number; empty for a string."""
        return NUMBER_FORMATS.get(self.data_type, "")

    @property
    def size(self) -> int:
        """Return a number's size in bytes; 0 for a string, which may have any."""
        return struct.calcsize(self.format) if self.format else 0

    @property
    def writable(self) -> bool:
        """Return whether an SDO may write it."""
        return self.access in ("rw", "wo", "rww", "rwr")


class ObjectDictionary:
    """Entries, their present values, and who wants to know of a write.

    Parameters
    ----------
    node_id : int
        Replaces `$NODEID` in the defaults.

    Attributes
    ----------
    values : dict
        (index << 8 | sub-index) -> number or bytes.
    before_read : callable
        Called with the entry ahead of every upload: brings live values up to date, or refuses.
    """

    def __init__(self, node_id: int) -> None:
        self.node_id = node_id
        self._entries = {e.key: e for e in load_entries(node_id)}
        self._indices = {e.index for e in self._entries.values()}
        self.values: dict[int, Value] = {k: e.default for k, e in self._entries.items()}
        self._factory: dict[int, Value] = dict(self.values)
        self._guards: list[Callable[[Entry, Value], None]] = []
        self._listeners: dict[int, Callable[[int], None]] = {}
        self.shown: dict[int, Value] = {}  # what an upload carries in place of the value
        self.before_read: Callable[[Entry], None] = lambda _entry: None

    def __iter__(self) -> Iterator[Entry]:
        return iter(self._entries.values())

    def entry(self, index: int, subindex: int = 0) -> Entry:
        """Return the description of a sub-object, or refuse as CiA 301 says."""
        found = self._entries.get(index << 8 | subindex)
        if found is None:
            raise SdoAbortError(NO_SUBINDEX if index in self._indices else NO_OBJECT)
        return found

    def hide(self, indices: Iterable[int]) -> None:
        """Refuse access to objects as a drive without them does; their values still act inside."""
        absent = set(indices)
        self._entries = {k: e for k, e in self._entries.items() if e.index not in absent}
        self._indices -= absent

    def shows(self, index: int) -> bool:
        """Return whether a master can reach an object."""
        return index in self._indices

    def number(self, index: int, subindex: int = 0) -> int:
        """Return a number that is known to be in the EDS."""
        value = self.values[index << 8 | subindex]
        assert isinstance(value, int)
        return value

    def set(self, index: int, subindex: int, value: Value) -> None:
        """Set a value from inside the device: no access check, nobody is told."""
        self.values[index << 8 | subindex] = value

    def set_factory(self, index: int, subindex: int, value: Value) -> None:
        """Set a value as the factory would: it survives every reset."""
        self._factory[index << 8 | subindex] = self.values[index << 8 | subindex] = value

    def reset(self, lowest: int, highest: int) -> None:
        """Bring the values of an index range back to the factory's."""
        for key, value in self._factory.items():
            if lowest <= key >> 8 <= highest:
                self.values[key] = value

    def guard(self, check: Callable[[Entry, Value], None]) -> None:
        """Let `check(entry, value)` refuse a write from the bus with `SdoAbortError`."""
        self._guards.append(check)

    def on_write(self, index: int, subindex: int, listener: Callable[[int], None]) -> None:
        """Let `listener(value)` hear of a number written from the bus."""
        self._listeners[index << 8 | subindex] = listener

    def read_bytes(self, index: int, subindex: int) -> bytes:
        """Return what an SDO upload carries."""
        entry = self.entry(index, subindex)
        if entry.access == "wo":
            raise SdoAbortError(WRITE_ONLY)
        self.before_read(entry)
        value = self.shown.get(entry.key, self.values[entry.key])
        if isinstance(value, bytes):
            return value
        return struct.pack("<" + entry.format, value)

    def check_writable(self, index: int, subindex: int) -> Entry:
        """Return the entry of an SDO download, or refuse it before any data flows."""
        entry = self.entry(index, subindex)
        if not entry.writable:
            raise SdoAbortError(READ_ONLY)
        return entry

    def write_bytes(self, index: int, subindex: int, data: bytes) -> None:
        """Take what an SDO download carried: check, store, tell."""
        entry = self.check_writable(index, subindex)
        if not entry.format:
            if len(data) > LONGEST_STRING:
                raise SdoAbortError(OUT_OF_MEMORY)
            self._guard(entry, data)
            self.values[entry.key] = data
            return
        if len(data) != entry.size:
            raise SdoAbortError(LENGTH_MISMATCH)
        self.write_number(entry, struct.unpack("<" + entry.format, data)[0])

    def write_number(self, entry: Entry, value: int) -> None:
        """Take a number from the bus: range, guards, store, tell."""
        if not entry.low <= value <= entry.high:
            raise SdoAbortError(VALUE_RANGE)
        self._guard(entry, value)
        self.values[entry.key] = value
        listener = self._listeners.get(entry.key)
        if listener is not None:
            listener(value)

    def _guard(self, entry: Entry, value: Value) -> None:
        for check in self._guards:
            check(entry, value)


def eds_text() -> str:
    """Return our generic EDS as it is shipped."""
    return (resources.files("fakes") / "generic-drive.eds").read_text(encoding="utf-8")


@cache
def load_entries(node_id: int) -> tuple[Entry, ...]:
    """Return every sub-object of the shipped EDS for a node id."""
    eds = configparser.RawConfigParser(inline_comment_prefixes=(";",))
    eds.read_string(eds_text())
    entries = []
    for section in eds.sections():
        match = _SECTION.fullmatch(section)
        if match is not None and eds.has_option(section, "DataType"):
            index, subindex = int(match[1], 16), int(match[2] or "0", 16)
            entries.append(_entry(index, subindex, eds[section], node_id))
    return tuple(entries)


def _entry(index: int, subindex: int, s: configparser.SectionProxy, node_id: int) -> Entry:
    data_type = int(s["DataType"], 0)
    low = high = 0
    default: Value
    if data_type in STRING_TYPES:
        default = s.get("DefaultValue", "").encode("ascii")
    else:
        code = NUMBER_FORMATS[data_type]
        bits = 8 * struct.calcsize(code)
        low, high = (
            (0, 2**bits - 1) if code.isupper() else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        )
        low = int(s.get("LowLimit", str(low)), 0)
        high = int(s.get("HighLimit", str(high)), 0)
        text = s.get("DefaultValue", "0")
        default = int(_NODE_ID.sub("", text), 0) + (node_id if "$" in text else 0)
    return Entry(
        index=index,
        subindex=subindex,
        name=s["ParameterName"],
        data_type=data_type,
        access=s["AccessType"].lower(),
        default=default,
        low=low,
        high=high,
        pdo_mappable=s.get("PDOMapping", "0") == "1",
    )
