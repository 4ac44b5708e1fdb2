"""A wrong map is told from a right one by what it reads, and the right one is named."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from drivers.modbus.codec import ByteOrder, Layout, NumberType, WordOrder
from drivers.modbus.plausibility import Finding, RegisterVerdict, judge_map
from drivers.modbus.register_map import Block, RegisterMap, decode_block


def register_map(kind: str, **more: object) -> RegisterMap:
    return RegisterMap.model_validate(
        {
            "schema": "stribeck.registers/1",
            "device": "d",
            "source": "s",
            "confirmed": "own",
            "register": [{"name": "t", "address": 0, "type": kind, "unit": "degC", **more}],
        }
    )


def verdict(believed: RegisterMap, series: Sequence[tuple[int, ...]]) -> RegisterVerdict:
    size = believed["t"].size
    rounds = [decode_block(believed, Block(3, 0, size, ("t",)), words) for words in series]
    (found,) = judge_map(believed, rounds, {})
    return found


@given(
    st.sampled_from(("f32", "i32", "f64")),
    st.sampled_from(("high-first", "low-first")),
    st.floats(15.0, 95.0),
)
@example("f32", "high-first", 32.3515625)  # the other way round its last reading is no number
@example("f64", "high-first", 16.417318636596164)  # nor is this one, beside others next to nothing
def test_the_other_word_order_is_found_and_named(
    kind: NumberType, order: WordOrder, degc: float
) -> None:
    other: WordOrder = "low-first" if order == "high-first" else "high-first"
    scale = 1.0 if kind.startswith("f") else 0.001
    truth = Layout(kind, order)
    series = [truth.encode((degc + 0.037 * k) / scale) for k in range(5)]
    right = verdict(register_map(kind, word_order=order, scale=scale), series)
    assert right.finding is Finding.PLAUSIBLE
    wrong = verdict(register_map(kind, word_order=other, scale=scale), series)
    assert wrong.finding in (Finding.WRONG, Finding.DOUBTFUL)
    if wrong.finding is Finding.WRONG:
        assert any(f'word_order = "{order}"' in reason for reason in wrong.reasons)


def test_an_integer_that_moves_at_its_high_end_is_doubted_without_any_range() -> None:
    truth = Layout("i32", "low-first")
    series = [truth.encode(20_000 + 7 * k) for k in range(5)]
    believed = register_map("i32", unit="", word_order="high-first")
    found = verdict(believed, series)
    assert found.finding is Finding.DOUBTFUL
    assert "word order" in found.reasons[0]


def test_a_negative_temperature_in_an_unsigned_register_is_called_signed() -> None:
    series = [(65536 - 31 + k,) for k in range(3)]
    found = verdict(register_map("u16", scale=0.1), series)
    assert found.finding is Finding.WRONG
    assert any('type = "i16" it would be -2.9 degC' in reason for reason in found.reasons)
    around_zero = verdict(register_map("u16", unit=""), [(65534,), (3,), (1,)])
    assert around_zero.finding is Finding.DOUBTFUL
    assert "signed" in around_zero.reasons[0]


def test_swapped_bytes_are_named() -> None:
    byte_order: ByteOrder = "little"
    series = [Layout("i16", byte_order=byte_order).encode(253 + k) for k in range(3)]
    found = verdict(register_map("i16", scale=0.1, range=[0, 120]), series)
    assert found.finding is Finding.WRONG
    assert any('byte_order = "little" it would be 25.5' in reason for reason in found.reasons)


def test_a_sentinel_is_no_value_and_not_the_maps_fault() -> None:
    found = verdict(register_map("i16", sentinels=[-32768]), [(0x8000,)] * 3)
    assert found.finding is Finding.NO_VALUE
    assert not found.finding.is_bad
    assert math.isnan(found.value)
    assert found.to_json()["value"] is None


@pytest.mark.parametrize(("rounds", "frozen"), [(2, False), (3, True)])
def test_a_number_that_never_moves_is_remarked_on(rounds: int, frozen: bool) -> None:
    found = verdict(register_map("i16", scale=0.1), [(250,)] * rounds)
    assert found.finding is Finding.PLAUSIBLE
    assert bool(found.reasons) is frozen


def test_what_the_device_refuses_is_said_in_its_words() -> None:
    (found,) = judge_map(register_map("i16"), [{}], {"t": "it has no such address"})
    assert found.finding is Finding.REFUSED
    assert found.finding.is_bad
