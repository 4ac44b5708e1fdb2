"""Every type in every order: what is encoded is decoded, and orders are what they are called."""

from __future__ import annotations

import struct
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.modbus.codec import ByteOrder, Layout, NumberType, WordOrder

LAYOUTS = st.builds(
    Layout,
    st.sampled_from(get_args(NumberType)),
    st.sampled_from(get_args(WordOrder)),
    st.sampled_from(get_args(ByteOrder)),
)


@given(LAYOUTS, st.data())
def test_registers_survive_decoding_and_encoding(layout: Layout, data: st.DataObject) -> None:
    words = tuple(
        data.draw(st.integers(0, 0xFFFF), label="register") for _ in range(layout.registers)
    )
    number = layout.decode(words)
    if number == number:  # a NaN need not come back bit by bit
        assert layout.encode(number) == words
    else:
        again = layout.decode(layout.encode(number))
        assert again != again


@given(LAYOUTS, st.integers(0, 2**64 - 1))
def test_the_other_orders_read_the_other_bytes(layout: Layout, bits: int) -> None:
    """Low-first reverses the registers, little swaps the bytes in each: and nothing else."""
    count = layout.registers
    words = [bits >> 16 * k & 0xFFFF for k in range(count)]
    plain = Layout(layout.kind)
    shown = words if layout.word_order == "high-first" else words[::-1]
    if layout.byte_order == "little":
        shown = [(w & 0xFF) << 8 | w >> 8 for w in shown]
    expected, found = plain.decode(shown), layout.decode(words)
    assert found == expected or (found != found and expected != expected)


@pytest.mark.parametrize(
    ("layout", "registers", "number"),
    [
        (Layout("i16"), (0xFFFE,), -2),
        (Layout("u16"), (0xFFFE,), 65534),
        (Layout("i32"), (0x0001, 0x0002), 0x10002),
        (Layout("i32", "low-first"), (0x0002, 0x0001), 0x10002),
        (Layout("f32"), struct.unpack(">HH", struct.pack(">f", 21.5)), 21.5),
        (Layout("f32", "low-first"), struct.unpack(">HH", struct.pack(">f", 21.5))[::-1], 21.5),
        (Layout("u32", "high-first", "little"), (0x0100, 0x0200), 0x10002),
        (Layout("f64"), struct.unpack(">4H", struct.pack(">d", -1e-9)), -1e-9),
    ],
)
def test_known_numbers(layout: Layout, registers: tuple[int, ...], number: float) -> None:
    assert layout.decode(registers) == number
    assert layout.encode(number) == registers


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match="70000 does not fit u16"):
        Layout("u16").encode(70000)
    with pytest.raises(ValueError, match="does not fit f32"):
        Layout("f32").encode(1e300)
    with pytest.raises(ValueError, match="takes 2 registers, got 1"):
        Layout("i32").decode((1,))
    assert not Layout("i16").holds(32768)
    assert not Layout("i16").holds(0.5)
