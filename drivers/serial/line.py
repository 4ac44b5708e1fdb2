"""A serial line with a device that answers one line of text to one line of text.

One try, one deadline; what was left over from before is thrown away, so that a late answer is
never taken for the answer to the next question.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import serial  # type: ignore[import-untyped]  # pyserial has no types

from drivers.clock import Clock
from drivers.errors import (
    AnswerError,
    BusError,
    NodeMissingError,
    terminal_errors,
    words_of,
)

LONGEST_LINE = 256
END = b"\r"


@dataclass(frozen=True)
class SerialConfig:
    """How a serial port is opened; 8 data bits.

    Parameters
    ----------
    port : str
        ``/dev/ttyUSB0``, ``COM3``, or one of pyserial's URLs.
    baudrate : int
        Bit/s.
    parity : str
        ``N``, ``E`` or ``O``.
    stopbits : int
        1 or 2.
    """

    port: str
    baudrate: int = 9600
    parity: Literal["N", "E", "O"] = "N"
    stopbits: Literal[1, 2] = 1


class SerialLine:
    """Asks and is answered; opens the port when it has to. One owner, not thread-safe.

    Parameters
    ----------
    config : SerialConfig
        The port.
    clock : Clock
        Deadlines are on it.
    """

    def __init__(self, config: SerialConfig, clock: Clock) -> None:
        self.config = config
        self._clock = clock
        self._port: serial.Serial | None = None

    def ask(self, request: bytes, deadline_s: float) -> bytes:
        """Send a request and return the answer without its carriage return.

        Parameters
        ----------
        request : bytes
            Without the carriage return.
        deadline_s : float
            On the injected clock.

        Raises
        ------
        BusError
            The port cannot be opened, or is gone.
        NodeMissingError
            Silence.
        AnswerError
            Bytes that do not end with a carriage return in time, or far too many of them.
        """
        port = self._opened(deadline_s)
        try:
            port.reset_input_buffer()
            port.write_timeout = self._left_s(deadline_s)
            port.write(request + END)
            return self._line(port, deadline_s)
        except (OSError, ValueError) as error:
            self.close()
            raise BusError(
                f"The serial port {self.config.port} failed: {words_of(error)}.",
                "Check the adapter and its cable.",
            ) from error

    def close(self) -> None:
        """Let the port go; the next question takes it up again."""
        port, self._port = self._port, None
        if port is not None:
            port.close()

    def _line(self, port: serial.Serial, deadline_s: float) -> bytes:
        received = bytearray()
        while True:
            port.timeout = self._left_s(deadline_s)
            received += port.read(max(1, port.in_waiting))
            line, end, _ = bytes(received).partition(END)
            if end:
                return line
            if len(received) > LONGEST_LINE:
                raise AnswerError(
                    f"On {self.config.port} {len(received)} bytes came without an end of line.",
                    "Check baud rate and parity.",
                )
            if self._clock.now() >= deadline_s or not received:
                raise self._too_late(received)

    def _too_late(self, received: bytearray) -> AnswerError | NodeMissingError:
        if not received:
            return NodeMissingError(
                f"Nobody answers on {self.config.port}.",
                "Check power, wiring, baud rate and the module's address.",
            )
        return AnswerError(
            f"On {self.config.port} an answer broke off after {len(received)} bytes.",
            "Check baud rate, parity and wiring.",
        )

    def _opened(self, deadline_s: float) -> serial.Serial:
        if self._port is None:
            try:
                self._port = serial.serial_for_url(
                    self.config.port,
                    baudrate=self.config.baudrate,
                    parity=self.config.parity,
                    stopbits=self.config.stopbits,
                    timeout=self._left_s(deadline_s),
                    exclusive=True,
                )
            except OPENING_FAILURES as error:
                raise BusError(
                    f"The serial port {self.config.port} cannot be opened: {words_of(error)}.",
                    "Is the adapter plugged in, and does no other program hold it?",
                ) from error
        return self._port

    def _left_s(self, deadline_s: float) -> float:
        return max(deadline_s - self._clock.now(), 1e-3)


OPENING_FAILURES: tuple[type[Exception], ...] = (OSError, ValueError, *terminal_errors())
"""What opening a port may raise: `SerialException` is an OSError, a wrong rate a ValueError."""
