"""slcan adapters: python-can's bus, which tells nobody when the adapter refuses, lies or hangs.

LAWICEL's ASCII protocol (CAN232 manual, version 3): a line ends with a carriage return; an adapter
answers a command that it cannot carry out with a bell instead. python-can drops bells, takes
half a line for a frame, and waits for ever for an adapter that takes no more bytes.
"""

from __future__ import annotations

import re
from typing import Any

import can
import serial  # type: ignore[import-untyped]  # pyserial has no types
from can.exceptions import error_check
from can.interfaces.slcan import slcanBus

from drivers.can.failures import AdapterError

_SETTLED_S = 0.05
"""No answer for so long, and those to the opening commands have been told."""

_ANSWERS_MAX = 64
"""On a busy bus frames follow the answers without a pause."""

_SEND_TIMEOUT_S = 0.1
"""A frame is 22 characters at most, 2 ms at 115200 baud; fifty frames would have to wait."""

_READ_TIMEOUT_S = 0.01
"""A byte that comes is taken at once; python-can's own millisecond only looks more often."""

BELL = "\a"
_LINE_END = re.compile(rb"[\r\a]")


class SlcanBus(slcanBus):
    """An slcan adapter that fails aloud; the arguments are python-can's.

    The bells that answer the opening commands are passed over: python-can closes a channel that may
    not be open and opens it twice, and an adapter is right to refuse that.
    """

    def __init__(self, **arguments: Any) -> None:
        self._opened = False
        super().__init__(**{"timeout": _READ_TIMEOUT_S, **arguments})
        self.serialPortOrig.write_timeout = _SEND_TIMEOUT_S
        for _ in range(_ANSWERS_MAX):
            if self._read(_SETTLED_S) is None:
                break
        self._opened = True

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand a frame to the adapter within a tenth of a second, or say that it takes none."""
        try:
            super().send(msg, _SEND_TIMEOUT_S if timeout is None else timeout)
        except OSError as error:  # the port refuses another `timeout`
            raise _lost(error) from error

    def shutdown(self) -> None:
        """Close the channel and let go of the port, also when the adapter is gone."""
        try:
            super().shutdown()
        except (can.CanError, OSError):
            # The adapter does not take the command to close. Whoever used the bus has been told
            # that it is gone; what is left to do is to let go of the port.
            self.serialPortOrig.close()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        try:
            message, filtered = super()._recv_internal(timeout)
        except (ValueError, IndexError) as error:
            raise _garbage(str(error)) from error
        if message is not None and len(message.data) != message.dlc and not message.is_remote_frame:
            raise _garbage(f"{len(message.data)} of {message.dlc} data bytes")
        return message, filtered

    def _read(self, timeout: float | None) -> str | None:
        """Return the next line with its end, or None after `timeout` seconds.

        What waits is taken with one call. python-can asks the system for each byte by itself: 22
        times a frame, and on Windows each of these is three calls.
        """
        try:
            with error_check():  # pyserial raises what it likes when the port is pulled out
                line = self._next_line(serial.Timeout(timeout))
        except can.CanOperationError as error:
            raise _lost(error.__cause__) from error
        if line is not None and line.endswith(BELL) and self._opened:
            raise AdapterError(
                "refused a frame with a bell",
                "Is the drive powered and the bus terminated? Check the bitrate, then start again.",
            )
        return line

    def _next_line(self, patience: serial.Timeout) -> str | None:
        end = _LINE_END.search(self._buffer)
        while end is None:
            self._buffer += self.serialPortOrig.read(max(1, self.serialPortOrig.in_waiting))
            end = _LINE_END.search(self._buffer)
            if end is None and patience.expired():
                return None
        line = self._buffer[: end.end()].decode()
        del self._buffer[: end.end()]
        return line

    def _write(self, string: str) -> None:
        """Write one line; unlike python-can's, without waiting until it has left the computer."""
        try:
            self.serialPortOrig.write(string.encode() + self.LINE_TERMINATOR)
        except OSError as error:
            raise _lost(error) from error


def _lost(error: BaseException | None) -> AdapterError:
    """Return what a failed read or write of the serial port means."""
    if isinstance(error, UnicodeDecodeError):
        return _garbage(str(error))
    if isinstance(error, serial.SerialTimeoutException):
        return AdapterError(
            "takes no more frames",
            "Unplug it, plug it in again, and let no other program use it.",
        )
    return AdapterError(
        "is gone", "Is it plugged in? Look at the cable and the hub, then start again."
    )


def _garbage(what: str) -> AdapterError:
    return AdapterError(
        f"sends what is no slcan ({what.splitlines()[0] if what else 'empty'})",
        "Check that the channel is an slcan adapter, its baud rate (options.tty_baudrate) and its "
        "cable.",
    )
