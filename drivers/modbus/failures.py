"""pymodbus's and the line's ways to fail, mapped once to ours, each with what to do now.

::

    OSError, termios.error while connecting    BusError          nobody takes the connection
    ConnectionException, OSError               BusError          the socket or the line is gone
    ModbusIOException, no byte came            NodeMissingError  silence
    ModbusIOException, bytes came              AnswerError       CRC, half a reply, noise
    ExceptionResponse (returned, not raised)   AnswerError       refused, with its code
    struct.error, IndexError, ValueError       AnswerError       a frame that decodes to nonsense
"""

from __future__ import annotations

import struct

from pymodbus import exceptions
from pymodbus.exceptions import ModbusException

from drivers.errors import (
    AnswerError,
    BusError,
    DriverError,
    NodeMissingError,
    terminal_errors,
    words_of,
)

LIBRARY_ERRORS: dict[type[Exception], type[DriverError]] = {
    exceptions.ConnectionException: BusError,
    exceptions.ModbusIOException: NodeMissingError,
    exceptions.ParameterException: AnswerError,
    exceptions.NoSuchIdException: AnswerError,
    exceptions.NotImplementedException: AnswerError,
    exceptions.MessageRegisterException: AnswerError,
}
"""pymodbus's exceptions, and what each becomes when nothing more is known."""

FAILURES: tuple[type[Exception], ...] = (
    ModbusException,
    OSError,
    struct.error,
    IndexError,
    ValueError,
)
"""What a request may raise; the last three come from decoding a broken frame."""

CONNECTING_FAILURES: tuple[type[Exception], ...] = (OSError, ValueError, *terminal_errors())
"""What opening a socket or a serial line may raise; pyserial lets termios' own error through."""

EXCEPTION_WORDS = {
    1: "it does not know this function",
    2: "it has no such address",
    3: "it does not take this value or this number of registers",
    4: "it failed while doing it",
    5: "it has accepted and needs more time",
    6: "it is busy",
    8: "its memory has a parity error",
    10: "the gateway has no path to it",
    11: "the device behind the gateway does not answer",
}


def not_connected(error: Exception, where: str) -> BusError:
    """Return the sentence for a connection that could not be made."""
    return BusError(
        f"No connection to {where}: {words_of(error)}.",
        "Check power, address and cable, and that no other program holds the line.",
    )


def refused(where: str, doing: str, code: int) -> AnswerError:
    """Return the sentence for a Modbus exception that a device answered with."""
    words = EXCEPTION_WORDS.get(code, "with a code of its vendor")
    return AnswerError(
        f"{where} refused ({doing}): {words} (exception {code}).",
        "Compare the register map with the device's manual.",
        exception_code=code,
    )


def failed(
    error: Exception, where: str, doing: str, bytes_received: int, *, on_a_line: bool
) -> DriverError:
    """Return our error for one of `FAILURES`.

    Parameters
    ----------
    error : Exception
        What was raised.
    where, doing : str
        Which device, and what was being done.
    bytes_received : int
        How many bytes had come since the request: silence and noise are different matters.
    on_a_line : bool
        Whether it is a serial line, and no network.
    """
    if bytes_received and not isinstance(error, (exceptions.ConnectionException, OSError)):
        return AnswerError(
            f"{where} answered {bytes_received} bytes that are no valid reply ({doing}).",
            "Check baud rate, parity, termination, and that no two devices share an address."
            if on_a_line
            else "Check the unit, which a reply has to name, and that Modbus TCP is spoken there.",
        )
    if isinstance(error, exceptions.ModbusIOException):
        return NodeMissingError(
            f"{where} does not answer ({doing}).",
            "Check that the device has power, its address, and the wiring.",
        )
    if isinstance(error, (exceptions.ConnectionException, OSError)):
        return BusError(
            f"The connection to {where} broke ({doing}).", "Check the cable and the device's power."
        )
    ours = next((LIBRARY_ERRORS[c] for c in type(error).__mro__ if c in LIBRARY_ERRORS), None)
    if ours is None:
        ours = AnswerError
    return ours(f"{where}: {words_of(error)} ({doing}).")
