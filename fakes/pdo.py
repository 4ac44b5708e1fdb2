"""PDOs of the fake: the mapping protocol as real drives want it, and fast packing."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import cast

from fakes.object_dictionary import (
    LENGTH_MISMATCH,
    NO_SUBINDEX,
    NOT_IN_THIS_STATE,
    NOT_MAPPABLE,
    PDO_TOO_LONG,
    SUBINDEX_ZERO_FIRST,
    VALUE_RANGE,
    Entry,
    ObjectDictionary,
    SdoAbortError,
    Value,
)

INVALID = 0x80000000
RPDO_RANGE, TPDO_RANGE = range(0x1400, 0x1800), range(0x1800, 0x1C00)
LARGEST_SYNC_TYPE = 240
EVENT_TYPES = (254, 255)
# Identifiers that CiA 301 keeps for NMT, SDO and error control: no PDO may take them.
RESTRICTED = (
    range(0x081),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x800),
)


def is_restricted(cob_id: int) -> bool:
    """Return whether a PDO may not have this 11-bit identifier."""
    return any(cob_id in ids for ids in RESTRICTED)


class Layout:
    """The mapped entries of one PDO, compiled: one `struct` call each way."""

    __slots__ = ("_keys", "_struct", "entries", "size")

    def __init__(self, entries: tuple[Entry, ...]) -> None:
        self.entries = entries
        self._keys = [e.key for e in entries]
        self._struct = struct.Struct("<" + "".join(e.format for e in entries))
        self.size = self._struct.size

    def pack(self, values: dict[int, Value]) -> bytes:
        """Return the PDO's bytes from the dictionary's values."""
        return self._struct.pack(*[values[k] for k in self._keys])

    def unpack(self, data: bytes | bytearray) -> tuple[int, ...]:
        """Return the numbers in a PDO's bytes; bytes beyond the mapping are ignored."""
        return self._struct.unpack_from(data)


class Pdo:
    """One PDO's state between two configurations."""

    __slots__ = ("cob_id", "event_timer_s", "inhibit_s", "layout", "transmission", "valid")

    def __init__(self, dictionary: ObjectDictionary, communication: int) -> None:
        raw = dictionary.number(communication, 1)
        self.valid = not raw & INVALID
        self.cob_id = raw & 0x7FF
        self.transmission = dictionary.number(communication, 2)
        is_transmit = communication in TPDO_RANGE
        self.inhibit_s = dictionary.number(communication, 3) * 1e-4 if is_transmit else 0.0
        self.event_timer_s = dictionary.number(communication, 5) * 1e-3 if is_transmit else 0.0
        mapping = communication + 0x200
        count = dictionary.number(mapping, 0)
        raws = [dictionary.number(mapping, i) for i in range(1, count + 1)]
        self.layout = Layout(tuple(_mapped(dictionary, r, communication) for r in raws))

    @property
    def synchronous(self) -> bool:
        """Return whether it waits for SYNC."""
        return self.transmission <= LARGEST_SYNC_TYPE


class TransmitPdo(Pdo):
    """A TPDO with what it needs to know about its last transmission."""

    __slots__ = ("last_data", "last_sent_s", "syncs")

    def __init__(self, dictionary: ObjectDictionary, communication: int) -> None:
        super().__init__(dictionary, communication)
        self.last_data: bytes | None = None
        self.last_sent_s = float("-inf")
        self.syncs = 0

    def on_sync(self, values: dict[int, Value]) -> bytes | None:
        """Return the frame's data when this SYNC is this PDO's; type 0 only on a change."""
        if self.transmission:
            self.syncs += 1
            if self.syncs < self.transmission:
                return None
            self.syncs = 0
            return self.layout.pack(values)
        data = self.layout.pack(values)
        if data == self.last_data:
            return None
        self.last_data = data
        return data

    def on_event(self, values: dict[int, Value], now_s: float) -> bytes | None:
        """Return the data when it has changed or its event timer is due, not inhibited."""
        elapsed = now_s - self.last_sent_s
        if elapsed < self.inhibit_s:
            return None
        data = self.layout.pack(values)
        due = 0.0 < self.event_timer_s <= elapsed
        if data == self.last_data and not due:
            return None
        self.last_data, self.last_sent_s = data, now_s
        return data


class ReceivePdo(Pdo):
    """An RPDO with the data that waits for the next SYNC."""

    __slots__ = ("waiting",)

    def __init__(self, dictionary: ObjectDictionary, communication: int) -> None:
        super().__init__(dictionary, communication)
        self.waiting: bytes | bytearray | None = None


class PdoConfiguration:
    """Refuses writes out of order, and compiles what is valid.

    The order that is accepted, in PRE-OPERATIONAL only: set bit 31 of the COB-ID, set the
    number of entries to 0, write the entries, set the number, clear bit 31.

    Parameters
    ----------
    dictionary : ObjectDictionary
        Holds 0x1400.. to 0x1BFF; this object installs its guard there.
    is_configurable : callable
        Whether the node is in PRE-OPERATIONAL.
    """

    def __init__(self, dictionary: ObjectDictionary, is_configurable: Callable[[], bool]) -> None:
        self._od = dictionary
        self._is_configurable = is_configurable
        indices = sorted({e.index for e in dictionary})
        self._receive = [i for i in indices if i in RPDO_RANGE and i < 0x1600]
        self._transmit = [i for i in indices if i in TPDO_RANGE and i < 0x1A00]
        dictionary.guard(self._check)

    def compile(self) -> tuple[list[ReceivePdo], list[TransmitPdo]]:
        """Return the valid PDOs as they are configured now."""
        receive = [ReceivePdo(self._od, i) for i in self._receive]
        transmit = [TransmitPdo(self._od, i) for i in self._transmit]
        return [p for p in receive if p.valid], [p for p in transmit if p.valid]

    def _check(self, entry: Entry, value: Value) -> None:
        index = entry.index
        if not 0x1400 <= index < 0x1C00:
            return
        if not self._is_configurable():
            raise SdoAbortError(NOT_IN_THIS_STATE)
        number = cast("int", value)
        if index & 0x200:
            self._check_mapping(entry, number)
        else:
            self._check_communication(entry, number)

    def _check_communication(self, entry: Entry, value: int) -> None:
        now_valid = not self._od.number(entry.index, 1) & INVALID
        if entry.subindex == 1:
            moved = (value ^ self._od.number(entry.index, 1)) & 0x1FFFFFFF
            stays_valid = now_valid and not value & INVALID
            usable = bool(value & INVALID) or not is_restricted(value & 0x7FF)
            if value & 0x3FFFF800 or (stays_valid and moved) or not usable:
                raise SdoAbortError(VALUE_RANGE)
        elif entry.subindex == 2:
            if value > LARGEST_SYNC_TYPE and value not in EVENT_TYPES:
                raise SdoAbortError(VALUE_RANGE)
        elif entry.subindex == 3 and now_valid:
            raise SdoAbortError(NOT_IN_THIS_STATE)

    def _check_mapping(self, entry: Entry, value: int) -> None:
        communication = entry.index - 0x200
        if not self._od.number(communication, 1) & INVALID:
            raise SdoAbortError(NOT_IN_THIS_STATE)
        if entry.subindex:
            if self._od.number(entry.index, 0):
                raise SdoAbortError(SUBINDEX_ZERO_FIRST)
            if value:
                _mapped(self._od, value, communication)
            return
        if value > 8:
            raise SdoAbortError(VALUE_RANGE)
        raws = [self._od.number(entry.index, i) for i in range(1, value + 1)]
        if sum(_mapped(self._od, raw, communication).size for raw in raws) > 8:
            raise SdoAbortError(PDO_TOO_LONG)


def _mapped(dictionary: ObjectDictionary, raw: int, communication: int) -> Entry:
    """Return the entry that a mapping value names, or refuse it."""
    try:
        entry = dictionary.entry(raw >> 16, raw >> 8 & 0xFF)
    except SdoAbortError as abort:
        if abort.code == NO_SUBINDEX:
            raise
        raise SdoAbortError(NOT_MAPPABLE) from abort
    receives = communication in RPDO_RANGE
    if not entry.pdo_mappable or (receives and not entry.writable):
        raise SdoAbortError(NOT_MAPPABLE)
    if raw & 0xFF != 8 * entry.size:
        raise SdoAbortError(LENGTH_MISMATCH)
    return entry
