"""From 16-bit registers to numbers and back: every type in every order. Pure.

Modbus fixes the order of the bytes in one register (high byte first) and nothing else. What
vendors do with a number of several registers is theirs: which word comes first, and whether the
bytes of each word are swapped, are two separate questions, and both are asked here.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

NumberType = Literal["u16", "i16", "u32", "i32", "f32", "u64", "i64", "f64"]
WordOrder = Literal["high-first", "low-first"]
ByteOrder = Literal["big", "little"]

_FORMATS: dict[str, struct.Struct] = {
    "u16": struct.Struct(">H"),
    "i16": struct.Struct(">h"),
    "u32": struct.Struct(">I"),
    "i32": struct.Struct(">i"),
    "f32": struct.Struct(">f"),
    "u64": struct.Struct(">Q"),
    "i64": struct.Struct(">q"),
    "f64": struct.Struct(">d"),
}

SIGNED_TWIN: dict[NumberType, NumberType] = {
    "u16": "i16",
    "i16": "u16",
    "u32": "i32",
    "i32": "u32",
    "u64": "i64",
    "i64": "u64",
}
"""Each integer type with the one of the same length and the other sign."""


@dataclass(frozen=True)
class Layout:
    """How one number lies in registers.

    Parameters
    ----------
    kind : str
        ``u16``, ``i16``, ``u32``, ``i32``, ``f32``, ``u64``, ``i64`` or ``f64``.
    word_order : str
        ``high-first``: the most significant register has the lowest address.
    byte_order : str
        ``big``: the high byte of each register is sent first, as Modbus has it.
    """

    kind: NumberType
    word_order: WordOrder = "high-first"
    byte_order: ByteOrder = "big"

    @property
    def registers(self) -> int:
        """Return how many registers the number takes."""
        return _FORMATS[self.kind].size // 2

    @property
    def is_float(self) -> bool:
        """Return whether the number is a floating-point one."""
        return self.kind.startswith("f")

    def decode(self, registers: Sequence[int]) -> int | float:
        """Return the number in `registers`.

        Parameters
        ----------
        registers : sequence of int
            `self.registers` values of 0 to 65535, in the order of their addresses.
        """
        if len(registers) != self.registers:
            raise ValueError(f"{self.kind} takes {self.registers} registers, got {len(registers)}")
        data = b"".join(_swapped(struct.pack(">H", r), self.byte_order) for r in registers)
        number: int | float = _FORMATS[self.kind].unpack(_words(data, self.word_order))[0]
        return number

    def encode(self, number: float) -> tuple[int, ...]:
        """Return the registers that hold `number`, in the order of their addresses.

        Raises
        ------
        ValueError
            For a number that the type cannot hold.
        """
        value = number if self.is_float else int(number)
        try:
            packed = _FORMATS[self.kind].pack(value)
        except (struct.error, OverflowError) as error:
            raise ValueError(f"{number} does not fit {self.kind}") from error
        data = _words(packed, self.word_order)
        return tuple(
            int.from_bytes(_swapped(data[at : at + 2], self.byte_order), "big")
            for at in range(0, len(data), 2)
        )

    def holds(self, number: float) -> bool:
        """Return whether the type can hold `number` exactly enough to be compared with."""
        try:
            self.encode(number)
        except ValueError:
            return False
        return self.is_float or float(number).is_integer()


def _words(data: bytes, order: WordOrder) -> bytes:
    """Return the 16-bit words of `data` in the other order where `order` says so."""
    if order == "high-first":
        return data
    return b"".join(data[at : at + 2] for at in range(len(data) - 2, -1, -2))


def _swapped(word: bytes, order: ByteOrder) -> bytes:
    return word if order == "big" else word[::-1]
