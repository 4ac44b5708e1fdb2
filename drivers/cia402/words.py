"""CiA 402's words, decoded and explained: statusword, controlword, modes, error codes. Pure.

Source: IEC 61800-7-201 (CiA 402-2), statusword 0x6041 and controlword 0x6040; error code ranges
as CiA 301 and CiA 402-2 give them.
"""

from __future__ import annotations

import enum

from drivers.ports import DriveState


class State(enum.Enum):
    """The drive's own state, by CiA 402's names."""

    NOT_READY = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY = "ready to switch on"
    SWITCHED_ON = "switched on"
    ENABLED = "operation enabled"
    QUICK_STOP = "quick stop active"
    FAULT_REACTION = "fault reaction active"
    FAULT = "fault"


class Controlword(enum.IntEnum):
    """The orders that we give. Fault reset (0x80) is missing on purpose: a person clears faults."""

    DISABLE_VOLTAGE = 0x0000
    QUICK_STOP = 0x0002
    SHUTDOWN = 0x0006
    SWITCH_ON = 0x0007  # also: disable operation, when operation is enabled
    ENABLE_OPERATION = 0x000F


class Mode(enum.IntEnum):
    """Modes of operation (0x6060, 0x6061)."""

    NONE = 0
    PROFILE_POSITION = 1
    VELOCITY = 2
    PROFILE_VELOCITY = 3
    PROFILE_TORQUE = 4
    HOMING = 6
    INTERPOLATED_POSITION = 7
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9
    CYCLIC_TORQUE = 10


REMOTE_BIT = 1 << 9
"""Set while the drive obeys controlwords from the network; some drives never set it."""

INTERNAL_LIMIT_BIT = 1 << 11

_PATTERNS: tuple[tuple[int, int, State], ...] = (
    # mask, value, state
    (0x4F, 0x00, State.NOT_READY),
    (0x4F, 0x40, State.SWITCH_ON_DISABLED),
    (0x6F, 0x21, State.READY),
    (0x6F, 0x23, State.SWITCHED_ON),
    (0x6F, 0x27, State.ENABLED),
    (0x6F, 0x07, State.QUICK_STOP),
    (0x4F, 0x0F, State.FAULT_REACTION),
    (0x4F, 0x08, State.FAULT),
)


def _state_of_low_bits(bits: int) -> State | None:
    """Return the state that the low seven bits spell, or None when they spell nothing."""
    return next((state for mask, value, state in _PATTERNS if bits & mask == value), None)


_STATES: tuple[State | None, ...] = tuple(_state_of_low_bits(bits) for bits in range(128))

REDUCED: dict[State, DriveState] = {
    State.NOT_READY: DriveState.OFF,
    State.SWITCH_ON_DISABLED: DriveState.OFF,
    State.READY: DriveState.OFF,
    State.SWITCHED_ON: DriveState.OFF,
    State.ENABLED: DriveState.ON,
    State.QUICK_STOP: DriveState.QUICK_STOP,
    State.FAULT_REACTION: DriveState.FAULT,
    State.FAULT: DriveState.FAULT,
}
"""What decisions need to know of each state."""


def state_of(statusword: int) -> State | None:
    """Return the state that a statusword spells; None for a pattern that CiA 402 does not know."""
    return _STATES[statusword & 0x7F]


def supports_mode(supported_modes: int, mode: Mode) -> bool:
    """Return whether 0x6502 lists `mode`: mode n is bit n - 1."""
    return mode > 0 and bool(supported_modes >> (mode - 1) & 1)


def supported_mode_names(supported_modes: int) -> str:
    """Return the modes that 0x6502 lists, in words."""
    names = [
        mode.name.lower().replace("_", " ")
        for mode in Mode
        if mode > 0 and supports_mode(supported_modes, mode)
    ]
    return ", ".join(names) or "none"


_ERROR_CODES: dict[int, str] = {
    0x2310: "continuous over-current at the output",
    0x2320: "short circuit or earth leakage at the output",
    0x2350: "overload of the drive or motor (I2t)",
    0x3110: "mains over-voltage",
    0x3120: "mains under-voltage",
    0x3210: "over-voltage of the DC link",
    0x3220: "under-voltage of the DC link",
    0x4210: "drive too hot",
    0x4310: "power stage too hot",
    0x4410: "motor too hot",
    0x5113: "5 V supply failed",
    0x6100: "internal software error",
    0x6320: "parameter error",
    0x7121: "motor blocked",
    0x7122: "commutation or motor error",
    0x7300: "sensor failed",
    0x7305: "position encoder failed",
    0x7306: "second position encoder failed",
    0x8110: "CAN overrun, messages lost",
    0x8120: "CAN in error passive",
    0x8130: "heartbeat or life guard of the master missed",
    0x8140: "recovered from bus off",
    0x8150: "identifiers collide on the bus",
    0x8210: "PDO with a wrong length",
    0x8220: "PDO longer than mapped",
    0x8240: "SYNC with a wrong length",
    0x8250: "RPDO time-out",
    0x8400: "velocity error too large",
    0x8500: "position control error",
    0x8611: "following error too large",
    0x8612: "position limit reached",
}

_ERROR_CLASSES: tuple[tuple[int, int, str], ...] = (
    # mask, value, words; the first that fits
    (0xFF00, 0x0000, "no error"),
    (0xFF00, 0x1000, "generic error"),
    (0xF000, 0x2000, "current"),
    (0xF000, 0x3000, "voltage"),
    (0xF000, 0x4000, "temperature"),
    (0xF000, 0x5000, "drive hardware"),
    (0xF000, 0x6000, "drive software"),
    (0xF000, 0x7000, "additional module or sensor"),
    (0xFF00, 0x8100, "communication"),
    (0xFF00, 0x8200, "protocol"),
    (0xF000, 0x8000, "monitoring"),
    (0xFF00, 0x9000, "external error"),
    (0xFF00, 0xF000, "additional function"),
)


def error_words(code: int) -> str:
    """Return what an EMCY or 0x603F code means, with the code.

    Returns
    -------
    str
        For example ``0x8611 (following error too large)``; codes that only the vendor knows are
        given by their class.
    """
    words = _ERROR_CODES.get(code)
    if words is None:
        words = next(
            (text for mask, value, text in _ERROR_CLASSES if code & mask == value),
            "vendor's own code, see the drive's manual",
        )
    return f"0x{code:04X} ({words})"
