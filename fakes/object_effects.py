"""What a write to an object does at once, and which values are refused there."""

from __future__ import annotations

from fakes.drive_loop import DriveLoop
from fakes.drive_modes import offered
from fakes.object_dictionary import VALUE_RANGE, Entry, ObjectDictionary, SdoAbortError, Value
from fakes.state_machine import StateMachine

CONTROLWORD, MODE, MODE_DISPLAY = 0x6040, 0x6060, 0x6061
SYNC_ID, EMERGENCY_ID = 0x1005, 0x1014


def connect_motion(
    dictionary: ObjectDictionary, machine: StateMachine, loop: DriveLoop, supported_modes: int
) -> None:
    """Let state machine and loop hear the controlword, and the mode if 0x6502 lists it."""
    modes = offered(supported_modes)

    def take_controlword(controlword: int) -> None:
        machine.command(controlword)
        loop.command(controlword)

    def take_mode(mode: int) -> None:
        loop.set_mode(mode)
        dictionary.set(MODE_DISPLAY, 0, mode)

    def check_mode(entry: Entry, value: Value) -> None:
        if entry.index == MODE and value not in modes:
            raise SdoAbortError(VALUE_RANGE)

    dictionary.on_write(CONTROLWORD, 0, take_controlword)
    dictionary.on_write(MODE, 0, take_mode)
    dictionary.guard(check_mode)
    take_mode(dictionary.number(MODE))


def refuse_long_identifiers(dictionary: ObjectDictionary) -> None:
    """Refuse an identifier of 29 bits for SYNC and EMCY."""

    def check(entry: Entry, value: Value) -> None:
        if entry.index in (SYNC_ID, EMERGENCY_ID) and int(value) & 0x7FFFF800:
            raise SdoAbortError(VALUE_RANGE)

    dictionary.guard(check)
