"""What a fake Modbus device holds, and how it answers one request: bytes in, bytes out.

Written from the Modbus application protocol, apart from the library that the agent uses, so that
the two do not share a mistake.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3
_COILS, _DISCRETE, _HOLDING, _INPUT = 1, 2, 3, 4
_WRITE_COIL, _WRITE_REGISTER, WRITE_REGISTERS = 5, 6, 16


class RefusedError(Exception):
    """The device answers with a Modbus exception."""

    def __init__(self, code: int) -> None:
        super().__init__(f"exception {code}")
        self.code = code


class Registers:
    """What a device holds: four tables of address to value; other addresses do not exist.

    `before_read` is called before every read, `on_write(function, address, value)` after every
    value written; function 1 is a coil, 3 a holding register.
    """

    def __init__(self) -> None:
        self.tables: dict[int, dict[int, int]] = {f: {} for f in (1, 2, 3, 4)}
        self.before_read: Callable[[], None] = lambda: None
        self.on_write: Callable[[int, int, int], None] = lambda _f, _a, _v: None

    def put(self, function: int, address: int, *words: int) -> None:
        """Set registers or bits from `address` on."""
        for offset, word in enumerate(words):
            self.tables[function][address + offset] = word & 0xFFFF

    def get(self, function: int, address: int, count: int = 1) -> tuple[int, ...]:
        """Return registers or bits."""
        table = self.tables[function]
        return tuple(table[address + k] for k in range(count))

    def answer(self, pdu: bytes) -> bytes:
        """Return the answer to one request, exceptions included."""
        try:
            return self._answer(pdu)
        except RefusedError as refused:
            return bytes([pdu[0] | 0x80, refused.code])
        except (KeyError, struct.error, IndexError):
            return bytes([pdu[0] | 0x80, ILLEGAL_ADDRESS])

    def _answer(self, pdu: bytes) -> bytes:
        function = pdu[0]
        if function in (_COILS, _DISCRETE, _HOLDING, _INPUT):
            address, count = struct.unpack(">HH", pdu[1:5])
            if not 1 <= count <= (125 if function >= _HOLDING else 2000):
                raise RefusedError(ILLEGAL_VALUE)
            self.before_read()
            values = self.get(function, address, count)
            data = struct.pack(f">{count}H", *values) if function >= _HOLDING else _bits(values)
            return bytes([function, len(data)]) + data
        if function == _WRITE_COIL:
            address, raw = struct.unpack(">HH", pdu[1:5])
            self._write(_COILS, address, int(raw == 0xFF00))
            return pdu[:5]
        if function == _WRITE_REGISTER:
            address, raw = struct.unpack(">HH", pdu[1:5])
            self._write(_HOLDING, address, raw)
            return pdu[:5]
        if function == WRITE_REGISTERS:
            address, count, size = struct.unpack(">HHB", pdu[1:6])
            if size != 2 * count:
                raise RefusedError(ILLEGAL_VALUE)
            words = struct.unpack(f">{count}H", pdu[6 : 6 + size])
            for offset, word in enumerate(words):
                self._write(_HOLDING, address + offset, word)
            return pdu[:5]
        raise RefusedError(ILLEGAL_FUNCTION)

    def _write(self, function: int, address: int, value: int) -> None:
        if address not in self.tables[function]:
            raise RefusedError(ILLEGAL_ADDRESS)
        self.tables[function][address] = value
        self.on_write(function, address, value)


def _bits(values: tuple[int, ...]) -> bytes:
    data = bytearray((len(values) + 7) // 8)
    for at, value in enumerate(values):
        data[at // 8] |= bool(value) << at % 8
    return bytes(data)
