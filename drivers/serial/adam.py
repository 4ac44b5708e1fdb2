"""The ASCII protocol of ADAM-4000 modules and their many cousins: one question, one number. Pure.

``#AAN`` asks module AA (hexadecimal) for channel N; ``>+025.12`` is the answer in engineering
units. With checksums on, two hexadecimal digits stand before the carriage return: the sum of all
characters before them, modulo 256. A channel that is over or under its range, or open, reads
``+9999`` or ``-0000`` (unconfirmed; the vendor's manual names both for its thermocouple modules).
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from drivers.errors import AnswerError
from drivers.ports import Quality

_NUMBER = re.compile(r"[+-]\d{1,7}(?:\.\d{0,6})?")
OVER_RANGE, UNDER_RANGE = "+9999", "-0000"


class AdamValue(NamedTuple):
    """One answer: NaN, with the reason, where it is no number to be believed."""

    value: float
    quality: Quality
    reason: str


def question(address: int, channel: int, *, checksum: bool) -> bytes:
    """Return the line that asks a module for one channel, without its carriage return.

    Parameters
    ----------
    address : int
        0 to 255.
    channel : int
        0 to 7.
    checksum : bool
        Whether the module is configured for checksums.
    """
    if not (0 <= address <= 0xFF and 0 <= channel <= 7):
        raise ValueError(f"expected address 0 to 255 and channel 0 to 7, got {address}, {channel}")
    text = f"#{address:02X}{channel}".encode()
    return text + check_of(text) if checksum else text


def check_of(text: bytes) -> bytes:
    """Return the two digits that stand behind `text`."""
    return f"{sum(text) & 0xFF:02X}".encode()


def answer(line: bytes, *, checksum: bool) -> AdamValue:
    """Return what a module's answer says.

    Parameters
    ----------
    line : bytes
        Without its carriage return.
    checksum : bool
        Whether the module is configured for checksums.

    Raises
    ------
    AnswerError
        A wrong checksum, a refusal (``?AA``), or what is no answer at all.
    """
    text = line
    if checksum:
        text, digits = line[:-2], line[-2:]
        if len(line) < 3 or digits.upper() != check_of(text):
            raise AnswerError(
                f"An answer has a wrong checksum: {line!r}.",
                "Check wiring and termination, and that the module has its checksum enabled.",
            )
    if text.startswith(b"?"):
        raise AnswerError(
            f"The module refuses the question: {line!r}.",
            "Check that the channel exists and is enabled.",
        )
    words = text[1:].decode("ascii", errors="replace")
    if not text.startswith(b">") or _NUMBER.fullmatch(words) is None:
        raise AnswerError(
            f"An answer is no number: {line!r}.",
            "Check that the module sends engineering units, and its checksum setting.",
        )
    if words in (OVER_RANGE, UNDER_RANGE):
        which = "above" if words == OVER_RANGE else "below"
        return AdamValue(
            math.nan, Quality.ABSENT, f"the channel is open, or {which} its range ({words})"
        )
    return AdamValue(float(words), Quality.GOOD, "")
