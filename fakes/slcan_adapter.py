"""An slcan adapter that is not there: lines of text on a pty, frames on a CAN bus.

As LAWICEL's CAN232 manual has it (version 3): a command ends with a carriage return and is answered
with one, or with a bell where it cannot be carried out now.
"""

from __future__ import annotations

import os
import select

import can

OK, BELL, END = b"\r", b"\a", b"\r"
_BITRATES = b"012345678"
_NORMAL, _EXTENDED = b"t", b"T"


class FakeSlcanAdapter:
    """Passes frames between one end of a pty pair and a CAN bus.

    Parameters
    ----------
    descriptor : int
        One end of a pty pair, raw; it belongs to the caller.
    bus : can.BusABC
        The other side; it belongs to the caller.

    Attributes
    ----------
    misbehaviour : str
        What it does wrong from now on: ``bell`` (refuses every frame), ``garbage`` (what it sends
        is no slcan), ``short`` (frames lack their last byte), ``deaf`` (takes no bytes any more).
    opened, setup : bool, str
        Whether the channel is open, and the bitrate's digit; empty before it was set.
    """

    def __init__(self, descriptor: int, bus: can.BusABC) -> None:
        self.misbehaviour = ""
        self.opened = False
        self.setup = ""
        self._descriptor = descriptor
        self._bus = bus
        self._buffer = b""

    def step(self, wait_s: float) -> None:
        """Carry out what was commanded and pass on what came, waiting at most `wait_s`."""
        if self.misbehaviour != "deaf":
            self._take_commands()
        message = self._bus.recv(wait_s)
        while message is not None:
            if self.opened and not message.is_error_frame:
                self._say(self._line(message))
            message = self._bus.recv(0.0)

    def close(self) -> None:
        """Do nothing: descriptor and bus are the caller's."""

    def _take_commands(self) -> None:
        ready, _, _ = select.select([self._descriptor], [], [], 0.0)
        if not ready:
            return
        try:
            self._buffer += os.read(self._descriptor, 4096)
        except OSError:  # nobody has the other end open at the moment
            self._buffer = b""
            return
        *lines, self._buffer = self._buffer.split(END)
        for line in lines:
            self._say(OK if self._carried_out(line) else BELL)

    def _carried_out(self, line: bytes) -> bool:
        """Carry out one command; return whether that was possible."""
        command, rest = line[:1], line[1:]
        if not command:
            return True
        if command == b"C":
            was_open, self.opened = self.opened, False
            return was_open
        if command == b"O":
            can_open = bool(self.setup) and not self.opened
            self.opened = self.opened or can_open
            return can_open
        if command == b"S" and not self.opened and len(rest) == 1 and rest in _BITRATES:
            self.setup = rest.decode()
            return True
        if command in (_NORMAL, _EXTENDED):
            return self._sent(rest, digits=3 if command == _NORMAL else 8)
        return False

    def _sent(self, rest: bytes, digits: int) -> bool:
        """Put one frame on the bus; return whether it was one, and the channel open."""
        if not self.opened or self.misbehaviour == "bell":
            return False
        try:
            length = int(rest[digits : digits + 1])
            data = bytes.fromhex(rest[digits + 1 :].decode())
            can_id = int(rest[:digits], 16)
        except ValueError:
            return False
        if len(data) != length:
            return False
        self._bus.send(
            can.Message(arbitration_id=can_id, data=data, is_extended_id=digits > 3, check=True)
        )
        return True

    def _line(self, message: can.Message) -> bytes:
        """Return a frame as the adapter says it."""
        letter, digits = ("T", 8) if message.is_extended_id else ("t", 3)
        data = bytes(message.data).hex().upper()
        if self.misbehaviour == "short":
            data = data[:-2]
        if self.misbehaviour == "garbage":
            return b"t\xff\xfe!?" + END
        return f"{letter}{message.arbitration_id:0{digits}X}{message.dlc}{data}".encode() + END

    def _say(self, text: bytes) -> None:
        try:
            os.write(self._descriptor, text)
        except OSError:  # nobody has the other end open at the moment
            return
