"""Every word of the page in English and German: one table, both complete (tests hold it to that).

What the engine itself decides is said in German by `agent.web.words.verdict`; where that has no
words for it, it stays as it was said, in English, and is marked so for screen readers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from agent.web.words.cycle import CYCLE_WORDS
from agent.web.words.frame import FRAME_WORDS
from agent.web.words.result import RESULT_WORDS
from trajectories import lasting

LANGUAGES: Mapping[str, str] = MappingProxyType({"en": "English", "de": "Deutsch"})

WORDS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {**FRAME_WORDS, **CYCLE_WORDS, **RESULT_WORDS}
)
"""Key to (English, German); names in braces are filled in."""


def say(language: str, key: str, /, **values: object) -> str:
    """Return one entry of the table.

    Parameters
    ----------
    language : str
        One of `LANGUAGES`.
    key : str
        Of `WORDS`; another one is a KeyError.
    **values
        What goes into its braces.
    """
    text = WORDS[key][list(LANGUAGES).index(language)]
    return text.format(**values) if values else text


def language_of(chosen: str, accepted: str) -> str:
    """Return the language to speak.

    Parameters
    ----------
    chosen : str
        As the reader chose it; empty, or anything, where nobody did.
    accepted : str
        The browser's Accept-Language.
    """
    if chosen in LANGUAGES:
        return chosen
    for part in accepted.split(",")[:20]:
        word = part.partition(";")[0].strip().lower()[:2]
        if word in LANGUAGES:
            return word
    return "en"


def fine(language: str, value: float) -> str:
    """Return a number with the digits that its size asks for."""
    return number(language, value, max(0, 3 - len(str(int(abs(value))))))


def lasts(language: str, seconds: float) -> str:
    """Return a length of time, to the second at most, as the language writes it."""
    text = lasting(math.ceil(seconds))
    return text.replace(".", ",") if language == "de" else text


def number(language: str, value: float | None, digits: int, *, sign: bool = False) -> str:
    """Return a number as the language writes it; a dash where there is none."""
    if value is None:
        return "–"
    nothing = round(value, digits) == 0.0  # which has no sign
    shown = 0.0 if nothing else value
    text = f"{shown:{'+' if sign and not nothing else ''}.{digits}f}".replace("-", "−")
    return text.replace(".", ",") if language == "de" else text
