"""What people read of an alarm: the news in one short sentence, each cause once, no reason lost."""

from __future__ import annotations

import math

import pytest

from agent.monitor.change.outlook import Outlook, undecided
from agent.monitor.verdict.reasons import MEASUREMENT, OIL, OTHER, WEAR, WORDS, Cause, Reasons
from agent.monitor.verdict.words import dated, parts_of


def reasons(**shares: float) -> Reasons:
    causes = [Cause(name, share) for name, share in shares.items()]
    return Reasons(tuple(sorted(causes, key=lambda cause: -cause.probability)))


@pytest.mark.parametrize(
    ("shares", "likely", "others"),
    [
        (
            {WEAR: 0.995, OIL: 0.003, OTHER: 0.002},
            "Among the causes weighed, over 99 % for wear in the gearbox: friction rises most at "
            "low speed.",
            "Less likely, under 1 % each: another, thicker or aged lubricant; something else, such "
            "as a swap that nobody entered.",
        ),
        (
            {MEASUREMENT: 0.6, WEAR: 0.35, OIL: 0.046, OTHER: 0.004},
            "The curve's change cannot tell these apart: the torque measurement (60 %, torque "
            "constant, or a winding warmer than usual); wear in the gearbox (35 %, friction rises "
            "most at low speed).",
            "Less likely: another, thicker or aged lubricant (5 %); under 1 % each: something "
            "else, such as a swap that nobody entered.",
        ),
        (
            {OTHER: 0.9, WEAR: 0.1},
            "Among the causes weighed, 90 % for something else, such as a swap that nobody "
            "entered.",
            "Less likely: wear in the gearbox (10 %).",
        ),
    ],
)
def test_each_cause_is_said_once_and_those_of_next_to_nothing_together(
    shares: dict[str, float], likely: str, others: str
) -> None:
    found = reasons(**shares)
    assert (found.sentence, found.others) == (likely, others)
    assert not any("thesis" in words for words in WORDS.values())


@pytest.mark.parametrize(
    ("reason", "said"),
    [
        (
            "a rise of 50 % lies more than 68 days ahead, further than the trend bears",
            "no date can be given for +50 %: it is more than 68 days away",
        ),
        (
            "too few cycles in the baseline or after it",
            "no date can be given for +50 %: too few cycles in the baseline or after it",
        ),
    ],
)
def test_an_outlook_without_a_date_says_so_and_why(reason: str, said: str) -> None:
    assert dated(undecided(0.5, reason)).sentence == said


def test_an_outlook_with_a_date_stays_as_it_is() -> None:
    ahead = Outlook(True, 0.5, 1.0, math.inf, "if nothing changes, ...")
    assert dated(ahead) is ahead


def test_the_news_ends_at_the_first_full_stop_not_at_a_decimal_point() -> None:
    assert parts_of("Up 5.8 % at low speed: wear. Change +5.8 %.") == (
        "Up 5.8 % at low speed: wear.",
        "Change +5.8 %.",
    )
    assert parts_of("Not decidable yet: 4 of 8.") == ("Not decidable yet: 4 of 8.", "")
