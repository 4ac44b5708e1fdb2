"""The ASCII protocol of ADAM-style modules: questions, checksums, numbers, and what is none."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import AnswerError
from drivers.ports import Quality
from drivers.serial.adam import answer, check_of, question


def test_known_lines() -> None:
    assert question(0x12, 3, checksum=False) == b"#123"
    # '#' + '0' + '1' + '2' = 0x23 + 0x30 + 0x31 + 0x32 = 0xB6
    assert question(1, 2, checksum=True) == b"#012B6"
    assert answer(b">+025.12", checksum=False).value == 25.12
    assert answer(b">-003.50" + check_of(b">-003.50"), checksum=True).value == -3.5


@given(st.floats(-200.0, 850.0), st.booleans())
def test_a_number_comes_through(value: float, checksum: bool) -> None:
    text = f">{value:+08.3f}".encode()
    found = answer(text + check_of(text) if checksum else text, checksum=checksum)
    assert found.quality is Quality.GOOD
    assert found.value == pytest.approx(value, abs=5e-4)


@given(st.integers(0, 9), st.integers(1, 255))
def test_no_changed_byte_passes_the_checksum(at: int, change: int) -> None:
    text = b">+025.123"
    line = bytearray(text + check_of(text))
    line[at] ^= change
    with pytest.raises(AnswerError):
        answer(bytes(line), checksum=True)


@pytest.mark.parametrize("words", [b">+9999", b">-0000"])
def test_an_open_channel_is_no_number(words: bytes) -> None:
    found = answer(words, checksum=False)
    assert math.isnan(found.value)
    assert found.quality is Quality.ABSENT


@pytest.mark.parametrize(
    "line", [b"", b">", b"?01", b"!01", b">25.1", b">+2x.1", b"\xff\xfe", b">+"]
)
def test_what_is_no_answer_is_refused(line: bytes) -> None:
    with pytest.raises(AnswerError):
        answer(line, checksum=False)


def test_an_address_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ValueError, match="address 0 to 255"):
        question(256, 0, checksum=False)
