"""The objects of a drive that we read or write, by index, type and plain name. Data only.

No EDS is needed: these are CiA 301's and CiA 402's own definitions. A vendor's object, such as a
temperature, is made by `DriveObject` from the configuration.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass

TYPES: dict[str, struct.Struct] = {
    "u8": struct.Struct("<B"),
    "i8": struct.Struct("<b"),
    "u16": struct.Struct("<H"),
    "i16": struct.Struct("<h"),
    "u32": struct.Struct("<I"),
    "i32": struct.Struct("<i"),
    "f32": struct.Struct("<f"),
}
"""Numeric CANopen types that we use; CANopen is little-endian."""


@dataclass(frozen=True)
class DriveObject:
    """One entry of a drive's object dictionary.

    Parameters
    ----------
    index, subindex : int
        Where it is.
    kind : str
        A key of `TYPES`.
    name : str
        What messages call it.
    """

    index: int
    subindex: int
    kind: str
    name: str

    def __post_init__(self) -> None:
        if self.kind not in TYPES:
            raise ValueError(
                f"{self.key} {self.name}: type must be one of {sorted(TYPES)}, got {self.kind!r}"
            )
        if not 0 < self.index <= 0xFFFF or not 0 <= self.subindex <= 0xFF:
            raise ValueError(f"{self.name}: there is no object {self.key}")

    @property
    def key(self) -> str:
        """Return how evidence and journals call it, for example ``0x6007:00``."""
        return f"0x{self.index:04X}:{self.subindex:02X}"

    @property
    def bits(self) -> int:
        """Return its length in a PDO."""
        return 8 * TYPES[self.kind].size

    @property
    def mapping_word(self) -> int:
        """Return CiA 301's word for it in a PDO mapping: index, subindex, bits."""
        return self.index << 16 | self.subindex << 8 | self.bits

    def shown(self, value: int) -> str:
        """Return a value as manuals print it: what is mapped and identifiers in hexadecimal."""
        return f"0x{value:X}" if 0x1400 <= self.index < 0x1C00 else str(value)

    def __str__(self) -> str:
        return f"{self.name} ({self.key})"


DEVICE_TYPE = DriveObject(0x1000, 0, "u32", "device type")
HEARTBEAT_PRODUCER = DriveObject(0x1017, 0, "u16", "heartbeat producer time")
VENDOR_ID = DriveObject(0x1018, 1, "u32", "vendor id")
PRODUCT_CODE = DriveObject(0x1018, 2, "u32", "product code")
REVISION = DriveObject(0x1018, 3, "u32", "revision")
SERIAL_NUMBER = DriveObject(0x1018, 4, "u32", "serial number")
ABORT_CONNECTION = DriveObject(0x6007, 0, "i16", "abort connection option")
ERROR_CODE = DriveObject(0x603F, 0, "u16", "error code")
CONTROLWORD = DriveObject(0x6040, 0, "u16", "controlword")
STATUSWORD = DriveObject(0x6041, 0, "u16", "statusword")
QUICK_STOP_OPTION = DriveObject(0x605A, 0, "i16", "quick stop option")
MODE = DriveObject(0x6060, 0, "i8", "mode of operation")
MODE_DISPLAY = DriveObject(0x6061, 0, "i8", "mode of operation as reported")
POSITION = DriveObject(0x6064, 0, "i32", "position")
VELOCITY = DriveObject(0x606C, 0, "i32", "velocity")
RATED_TORQUE = DriveObject(0x6076, 0, "u32", "rated torque")
TORQUE = DriveObject(0x6077, 0, "i16", "torque")
SOFTWARE_LIMIT_MIN = DriveObject(0x607D, 1, "i32", "software position limit, minimum")
SOFTWARE_LIMIT_MAX = DriveObject(0x607D, 2, "i32", "software position limit, maximum")
SOFTWARE_LIMITS = (SOFTWARE_LIMIT_MIN, SOFTWARE_LIMIT_MAX)
PROFILE_ACCELERATION = DriveObject(0x6083, 0, "u32", "profile acceleration")
PROFILE_DECELERATION = DriveObject(0x6084, 0, "u32", "profile deceleration")
QUICK_STOP_DECELERATION = DriveObject(0x6085, 0, "u32", "quick stop deceleration")
TARGET_VELOCITY = DriveObject(0x60FF, 0, "i32", "target velocity")
TARGET_POSITION = DriveObject(0x607A, 0, "i32", "target position")
PROFILE_VELOCITY = DriveObject(0x6081, 0, "u32", "profile velocity")
VL_TARGET = DriveObject(0x6042, 0, "i16", "vl target velocity")
VL_MIN = DriveObject(0x6046, 1, "u32", "vl velocity, minimum amount")
VL_MAX = DriveObject(0x6046, 2, "u32", "vl velocity, maximum amount")
VL_RISE_SPEED = DriveObject(0x6048, 1, "u32", "vl acceleration, change of speed")
VL_RISE_TIME = DriveObject(0x6048, 2, "u16", "vl acceleration, time")
VL_FALL_SPEED = DriveObject(0x6049, 1, "u32", "vl deceleration, change of speed")
VL_FALL_TIME = DriveObject(0x6049, 2, "u16", "vl deceleration, time")
INTERPOLATION_SUBMODE = DriveObject(0x60C0, 0, "i16", "interpolation sub mode")
INTERPOLATION_DATA = DriveObject(0x60C1, 1, "i32", "interpolation data record")
INTERPOLATION_TIME = DriveObject(0x60C2, 1, "u8", "interpolation time")
INTERPOLATION_EXPONENT = DriveObject(0x60C2, 2, "i8", "interpolation time, power of ten")
SUPPORTED_MODES = DriveObject(0x6502, 0, "u32", "supported modes")

UNITS = (
    DriveObject(0x607E, 0, "u8", "polarity"),
    DriveObject(0x608F, 1, "u32", "position encoder resolution, increments"),
    DriveObject(0x608F, 2, "u32", "position encoder resolution, motor revolutions"),
    DriveObject(0x6091, 1, "u32", "gear ratio, motor revolutions"),
    DriveObject(0x6091, 2, "u32", "gear ratio, shaft revolutions"),
    DriveObject(0x6092, 1, "u32", "feed constant, feed"),
    DriveObject(0x6092, 2, "u32", "feed constant, shaft revolutions"),
    DriveObject(0x6093, 1, "u32", "position factor, numerator"),
    DriveObject(0x6093, 2, "u32", "position factor, divisor"),
    DriveObject(0x6096, 1, "u32", "velocity factor, numerator"),
    DriveObject(0x6096, 2, "u32", "velocity factor, divisor"),
    DriveObject(0x6097, 1, "u32", "acceleration factor, numerator"),
    DriveObject(0x6097, 2, "u32", "acceleration factor, divisor"),
    DriveObject(0x60A8, 0, "u32", "unit of positions"),
    DriveObject(0x60A9, 0, "u32", "unit of velocities"),
)
"""What the drive's own units depend on, as far as CiA 402 has a word for it: read, never written.

Few drives have many of them. 0x6093 is that of older drives.
"""

DEVICE_NAME = (0x1008, 0)
"""The manufacturer's device name: text, so no `DriveObject`."""


def heartbeat_consumer(subindex: int) -> DriveObject:
    """Return an entry of the list of nodes whose heartbeat the drive watches."""
    return DriveObject(0x1016, subindex, "u32", "heartbeat consumer time")


def pdo_communication(index: int, subindex: int) -> DriveObject:
    """Return an entry of a PDO's communication parameters (0x1400.., 0x1800..)."""
    kinds = {1: ("u32", "identifier"), 2: ("u8", "transmission type")}
    kind, name = kinds[subindex]
    return DriveObject(index, subindex, kind, f"{_pdo_name(index)} {name}")


def pdo_mapping(index: int, subindex: int) -> DriveObject:
    """Return an entry of a PDO's mapping (0x1600.., 0x1A00..); subindex 0 is the count."""
    if subindex == 0:
        return DriveObject(index, 0, "u8", f"{_pdo_name(index)} number of mapped objects")
    return DriveObject(index, subindex, "u32", f"{_pdo_name(index)} mapped object {subindex}")


_SETTINGS = {
    item.key: item
    for item in (
        HEARTBEAT_PRODUCER,
        ABORT_CONNECTION,
        QUICK_STOP_OPTION,
        MODE,
        SOFTWARE_LIMIT_MIN,
        SOFTWARE_LIMIT_MAX,
        PROFILE_ACCELERATION,
        PROFILE_DECELERATION,
        QUICK_STOP_DECELERATION,
        PROFILE_VELOCITY,
        VL_MIN,
        VL_MAX,
        VL_RISE_SPEED,
        VL_RISE_TIME,
        VL_FALL_SPEED,
        VL_FALL_TIME,
        INTERPOLATION_SUBMODE,
        INTERPOLATION_TIME,
        INTERPOLATION_EXPONENT,
    )
}


_UNITS = {item.key: item for item in UNITS}


def setting_of(key: str) -> DriveObject:
    """Return the object that a key of a snapshot means, one of the drive's units included.

    Raises
    ------
    ValueError
        When the key is malformed or names an object that we never write.
    """
    match = re.fullmatch(r"0x([0-9A-Fa-f]{4}):([0-9A-Fa-f]{2})", key)
    if match is None:
        raise ValueError(f"expected an object as 0x6007:00, got {key!r}")
    index, subindex = int(match[1], 16), int(match[2], 16)
    if index == 0x1016:
        return heartbeat_consumer(subindex)
    if index & 0xFE00 in (0x1400, 0x1800) and subindex in (1, 2):
        return pdo_communication(index, subindex)
    if index & 0xFE00 in (0x1600, 0x1A00):
        return pdo_mapping(index, subindex)
    canonical = f"0x{index:04X}:{subindex:02X}"
    found = _SETTINGS.get(canonical) or _UNITS.get(canonical)
    if found is None:
        raise ValueError(f"{key} is not an object that this driver sets")
    return found


def _pdo_name(index: int) -> str:
    """Return RPDO or TPDO with its number."""
    return f"{'TPDO' if index & 0x0800 else 'RPDO'}{(index & 0x1FF) + 1}"
