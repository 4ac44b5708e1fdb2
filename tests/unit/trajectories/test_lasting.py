"""A length of time as people say it, in one form wherever it is told."""

from __future__ import annotations

import math

import pytest

from agent.web.words.language import lasts
from trajectories import lasting


@pytest.mark.parametrize(
    ("seconds", "said"),
    [
        (0.0, "0 s"),
        (0.456, "0.456 s"),
        (12.34, "12.3 s"),
        (40.0, "40 s"),
        (119.0, "119 s"),
        (150.0, "2.5 min"),
        (180.0, "3 min"),
        (1480.0, "25 min"),
        (7200.0, "2 h"),
        (9000.0, "2.5 h"),
        (360_000.0, "100 h"),
        (math.inf, "–"),
        (math.nan, "–"),
    ],
)
def test_seconds_become_minutes_and_hours(seconds: float, said: str) -> None:
    assert lasting(seconds) == said


def test_the_page_says_it_to_the_second_in_its_own_language() -> None:
    assert lasts("en", 11.2) == lasts("de", 11.2) == "12 s"
    assert (lasts("en", 150.0), lasts("de", 150.0)) == ("2.5 min", "2,5 min")
