"""An ADAM-style RTD module that is not there: lines of text on one end of a serial line."""

from __future__ import annotations

import os
import select
from collections.abc import Callable

END = b"\r"


class FakeAdam:
    """Answers ``#AAN`` with the temperature of channel N.

    Parameters
    ----------
    descriptor : int
        One end of a pty pair, raw; it belongs to the caller.
    degc : callable
        The true temperature now.
    address : int
        The module's own; others are not answered.
    checksum : bool
        Whether it wants and sends checksums.

    Attributes
    ----------
    misbehaviour : str
        What it does wrong from now on: ``silent``, ``half``, ``garbled`` (wrong checksum),
        ``open`` (the sensor is broken), ``refuses``, ``endless`` (no carriage return).
    """

    def __init__(
        self, descriptor: int, degc: Callable[[], float], *, address: int = 1, checksum: bool = True
    ) -> None:
        self.misbehaviour = ""
        self.questions = 0
        self._descriptor = descriptor
        self._degc = degc
        self._address = address
        self._checksum = checksum
        self._buffer = b""

    def step(self, wait_s: float) -> None:
        """Answer what has been asked, waiting at most `wait_s`."""
        ready, _, _ = select.select([self._descriptor], [], [], wait_s)
        if not ready:
            return
        try:
            self._buffer += os.read(self._descriptor, 256)
        except OSError:  # nobody has the other end open at the moment
            return
        *lines, self._buffer = self._buffer.split(END)
        for line in lines:
            self._answer(line)

    def close(self) -> None:
        """Do nothing: the descriptor is the caller's."""

    def _answer(self, line: bytes) -> None:
        text = line
        if self._checksum:
            text, digits = line[:-2], line[-2:]
            if digits != _check(text):
                return  # a real module is silent when it is asked wrongly
        if not text.startswith(b"#%02X" % self._address) or len(text) != 4:
            return
        self.questions += 1
        kind = self.misbehaviour
        if kind == "silent":
            return
        body = b">" + f"{self._degc():+08.3f}".encode()
        if kind == "open":
            body = b">+9999"
        if kind == "refuses":
            body = b"?%02X" % self._address
        answer = body + (_check(body) if self._checksum else b"")
        if kind == "garbled":
            answer = answer[:-1] + (b"0" if answer[-1:] != b"0" else b"1")
        if kind == "half":
            os.write(self._descriptor, answer[: len(answer) // 2])
        elif kind == "endless":
            os.write(self._descriptor, b"x" * 400)
        else:
            os.write(self._descriptor, answer + END)


def _check(text: bytes) -> bytes:
    return b"%02X" % (sum(text) % 256)
