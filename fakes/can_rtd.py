"""A CiA 404 RTD node that is not there: eight channels behind an SDO server on a real bus."""

from __future__ import annotations

import struct
from collections.abc import Callable

import can

_UPLOAD, _ABORT_FRAME = 0x40, struct.Struct("<BHBI")
_REQUEST = struct.Struct("<BHB4x")
_EXPEDITED = {1: 0x4F, 2: 0x4B, 4: 0x43}
NO_OBJECT, NO_SUBINDEX = 0x06020000, 0x06090011
CELSIUS = 0x002D0000
DEVICE_TYPE = 0x0002_0194  # analogue inputs of profile 404


class FakeRtd:
    """Answers SDO uploads; `step_to` handles what waits on the bus.

    Parameters
    ----------
    bus : can.BusABC
        Where it listens and speaks; it belongs to the caller.
    degc : callable
        The true temperature of channel 1 now; the others are not connected.
    node_id : int
        1 to 127.
    decimals : int
        Of the process value.

    Attributes
    ----------
    status : int
        Object 0x6150 of channel 1: bit 0 not valid, 1 too high, 2 too low.
    silent : bool
        Nothing is answered.
    unit : int
        Object 0x6131.
    """

    def __init__(
        self, bus: can.BusABC, degc: Callable[[], float], *, node_id: int = 21, decimals: int = 1
    ) -> None:
        self.node_id = node_id
        self.status = 0
        self.silent = False
        self.unit = CELSIUS
        self.device_type = DEVICE_TYPE
        self.answers = 0
        self._bus = bus
        self._degc = degc
        self._decimals = decimals

    def step_to(self, _now_s: float) -> None:
        """Answer every waiting request; time itself moves nothing here."""
        while (message := self._bus.recv(0.0)) is not None:
            if message.arbitration_id == 0x600 + self.node_id and len(message.data) == 8:
                self._answer(bytes(message.data))

    def _answer(self, request: bytes) -> None:
        if self.silent:
            return
        command, index, subindex = _REQUEST.unpack(request)
        if command != _UPLOAD:
            return
        self.answers += 1
        found = self._value(index, subindex)
        if isinstance(found, int):
            data = _ABORT_FRAME.pack(0x80, index, subindex, found)
        else:
            data = struct.pack("<BHB", _EXPEDITED[len(found)], index, subindex) + found.ljust(
                4, b"\x00"
            )
        self._bus.send(
            can.Message(arbitration_id=0x580 + self.node_id, data=data, is_extended_id=False)
        )

    def _value(self, index: int, subindex: int) -> bytes | int:
        """Return an object's bytes, or the abort code."""
        if index == 0x1000:
            return struct.pack("<I", self.device_type)
        if index == 0x1018 and subindex in (1, 3):
            return struct.pack("<I", {1: 0x0000_0F0F, 3: 4711}[subindex])
        if index not in (0x7130, 0x6131, 0x6132, 0x6150):
            return NO_OBJECT
        if not 1 <= subindex <= 8:
            return NO_SUBINDEX
        connected = subindex == 1
        if index == 0x6131:
            return struct.pack("<I", self.unit)
        if index == 0x6132:
            return struct.pack("<B", self._decimals)
        if index == 0x6150:
            return struct.pack("<B", self.status if connected else 0x01)
        raw = round(self._degc() * 10**self._decimals) if connected else 0x7FFF
        return struct.pack("<h", raw)
