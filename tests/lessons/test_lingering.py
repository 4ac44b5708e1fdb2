"""A push at one place where a slow pass lingers: a third of the mismatch in one block.

Shifted in time that third is a push somewhere else, and so the push was an accident; the search
ended with it, and a wobble that explains half of the rest was never asked for (310054).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import pytest

from agent.explain.choosing import entry
from agent.explain.choosing.candidate import Candidate, Scored
from agent.explain.choosing.choice import choose
from agent.explain.choosing.search import Library
from agent.explain.choosing.shifts import chance
from fakes.conceal.case import conceal
from tests.science.explain_joint import library_of
from tests.science.test_explain import runs_of, twin_of

PUSH, WOBBLE = "local-fault", "kinematic-error"


@cache
def library() -> Library:
    case = conceal(310054, effects=[PUSH, WOBBLE], design="rich", snr=1.0)
    return library_of(runs_of(case), twin_of(case))


def test_what_all_passes_agree_on_is_no_accident_of_the_slowest() -> None:
    push = next(s for s in library().rank([]) if s.form.effect == PUSH)
    assert chance(library(), [], push) > 0.01
    assert chance(library(), [], push, blocks_alike=True) < 0.01


def test_an_accident_ends_no_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the largest is refused, the next one is asked."""

    def refusing(asked: Library, terms: Sequence[Candidate], scored: Scored, **how: bool) -> float:
        return 1.0 if scored.form.effect == PUSH else chance(asked, terms, scored, **how)

    monkeypatch.setattr(entry, "chance", refusing)
    found = choose(library(), rivals=False).terms
    assert [term.scored.form.effect in {WOBBLE, "resolver-error"} for term in found] == [True]


def test_a_push_and_a_wobble_are_both_found() -> None:
    assert {term.scored.form.effect for term in choose(library()).terms} == {PUSH, WOBBLE}
