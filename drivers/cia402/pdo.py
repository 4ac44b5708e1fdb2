"""PDO mapping as data: written in PRE-OPERATIONAL only, read back, compared, restored.

CiA 301's order is kept: invalidate the PDO, set the count to 0, write the entries, set the count,
set the transmission type, make the PDO valid. A wrong layout would read plausible values, so every
entry is read back before anything relies on it. What stands already is not written: some drives
have mappings, or identifiers, that are fixed.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass

from drivers.cia402.objects import (
    TYPES,
    DriveObject,
    pdo_communication,
    pdo_mapping,
)
from drivers.cia402.sdo import READ_ONLY, SdoAccess
from drivers.errors import ConfigurationError, SdoError

_INVALID = 1 << 31
_NO_REMOTE = 1 << 30
"""Whether the PDO may be asked for by a remote frame: some drives fix this bit, so it is kept."""

MAPPING_OFFSET = 0x200
"""From a PDO's communication parameters to its mapping."""

EVERY_SYNC = 1
AT_ONCE = 255


@dataclass(frozen=True)
class PdoMap:
    """One PDO: where its parameters are, its identifier, when it is sent, what it carries.

    Parameters
    ----------
    communication_index : int
        0x1400 for RPDO1, 0x1800 for TPDO1 ...; the mapping is `MAPPING_OFFSET` above it.
    cob_id : int
        Identifier on the bus, without flag bits.
    transmission_type : int
        `EVERY_SYNC` or `AT_ONCE`.
    entries : tuple of DriveObject
        At most 8 bytes together.
    """

    communication_index: int
    cob_id: int
    transmission_type: int
    entries: tuple[DriveObject, ...]

    def __post_init__(self) -> None:
        bits = sum(entry.bits for entry in self.entries)
        if not 0 < bits <= 64:
            raise ValueError(f"a PDO carries 1 to 64 bits, got {bits}")

    @property
    def mapping_index(self) -> int:
        """Return 0x1600 for RPDO1, 0x1A00 for TPDO1 ..."""
        return self.communication_index + MAPPING_OFFSET

    def codec(self) -> struct.Struct:
        """Return the compiled decoder of its data bytes."""
        return struct.Struct("<" + "".join(TYPES[e.kind].format[1:] for e in self.entries))

    def wanted(self, found: Mapping[str, int]) -> dict[str, int]:
        """Return every object that this map sets, with its value.

        Parameters
        ----------
        found : mapping
            A snapshot; the identifier's remote bit is taken over from it.
        """
        cob = pdo_communication(self.communication_index, 1)
        values = {
            cob.key: self.cob_id | (found.get(cob.key, 0) & _NO_REMOTE),
            pdo_communication(self.communication_index, 2).key: self.transmission_type,
            pdo_mapping(self.mapping_index, 0).key: len(self.entries),
        }
        for number, entry in enumerate(self.entries, start=1):
            values[pdo_mapping(self.mapping_index, number).key] = entry.mapping_word
        return values


def snapshot_pdo(sdo: SdoAccess, communication_index: int) -> dict[str, int]:
    """Return a PDO's parameters as they are: identifier, type, count, mapped entries."""
    communication = [pdo_communication(communication_index, sub) for sub in (1, 2)]
    count = pdo_mapping(communication_index + MAPPING_OFFSET, 0)
    found = {item.key: sdo.read(item) for item in (*communication, count)}
    for number in range(1, found[count.key] + 1):
        entry = pdo_mapping(communication_index + MAPPING_OFFSET, number)
        found[entry.key] = sdo.read(entry)
    return found


def ignored_bits(item: DriveObject) -> int:
    """Return the bits of an object that a drive may give another value than was written."""
    identifier = item.index & 0xFE00 in (0x1400, 0x1800) and item.subindex == 1
    return _NO_REMOTE if identifier else 0


def write_pdo(
    sdo: SdoAccess,
    communication_index: int,
    values: Mapping[str, int],
    stands: Mapping[str, int] | None = None,
) -> dict[str, int]:
    """Bring a PDO to `values` by CiA 301's order and compare what reads back.

    A mapping that stands as it should is not written, nor is a whole PDO that does.

    Parameters
    ----------
    sdo : SdoAccess
        Of a node in PRE-OPERATIONAL.
    communication_index : int
        Which PDO: 0x1400 for RPDO1, 0x1800 for TPDO1 ...
    values : mapping
        As `PdoMap.wanted` or `snapshot_pdo` give them.
    stands : mapping, optional
        What it is now, as `snapshot_pdo` has just given it; read where it is not said.

    Returns
    -------
    dict
        What was read back, "0x1A00:01" -> value.

    Raises
    ------
    ConfigurationError
        When the mapping read back is another, naming expected and read.
    SdoError
        When the drive refuses a step.
    """
    mapping_index = communication_index + MAPPING_OFFSET
    cob = pdo_communication(communication_index, 1)
    kind = pdo_communication(communication_index, 2)
    count = pdo_mapping(mapping_index, 0)
    entries = [pdo_mapping(mapping_index, number) for number in range(1, values[count.key] + 1)]
    if stands is None:
        stands = snapshot_pdo(sdo, communication_index)
    mapped = all(stands.get(item.key) == values[item.key] for item in (count, *entries))
    sent = stands.get(kind.key) == values[kind.key] and not _unlike(cob, stands, values)
    if not (mapped and sent):
        sdo.write(cob, values[cob.key] | _INVALID)
        if not mapped:
            _map(sdo, count, entries, values)
        sdo.write(kind, values[kind.key])
        sdo.write(cob, values[cob.key])
    return _read_back(sdo, (cob, kind, count, *entries), values)


def _map(
    sdo: SdoAccess, count: DriveObject, entries: list[DriveObject], values: Mapping[str, int]
) -> None:
    """Write a mapping: none, its entries, their number."""
    try:
        sdo.write(count, 0)
    except SdoError as error:
        if error.abort_code not in READ_ONLY:
            raise
        wanted = ", ".join(f"0x{values[entry.key] >> 16:04X}" for entry in entries)
        raise SdoError(
            error.what,
            f"This drive's mapping is fixed: map {wanted} there with its maker's software, or take "
            "another mode (docs/drives.md).",
            error.abort_code,
        ) from error
    for entry in entries:
        sdo.write(entry, values[entry.key])
    sdo.write(count, values[count.key])


def _unlike(item: DriveObject, read: Mapping[str, int], values: Mapping[str, int]) -> int:
    """Return the bits in which an object is not as it should be, but for those that are ignored."""
    return (read.get(item.key, ~values[item.key]) ^ values[item.key]) & ~ignored_bits(item)


def _read_back(
    sdo: SdoAccess, items: tuple[DriveObject, ...], values: Mapping[str, int]
) -> dict[str, int]:
    """Read every object of a PDO and compare all of them before complaining about any."""
    read = {item.key: sdo.read(item) for item in items}
    wrong = [
        f"{item} expected 0x{values[item.key]:08X}, read 0x{read[item.key]:08X}"
        for item in items
        if _unlike(item, read, values)
    ]
    if wrong:
        raise ConfigurationError(
            f"A PDO mapping does not read back as it was set: {'; '.join(wrong)}.",
            "Compare the mapping with the drive's manual; nothing moves until it holds.",
        )
    return read
