"""Columns are there whenever they are asked for, and never take more memory than they may."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from weakref import ref

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.explain.numbers.resting import on_scene
from agent.explain.rows import kept
from agent.explain.rows.kept import Kept, kept_bytes, new_round
from agent.identify.result import Floats
from tests.science.explain_joint import Conditions, library_of, nothing, record, stair

SIZE = np.zeros(64).nbytes


@pytest.fixture(autouse=True)
def room_for_eight(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let eight laws' columns be kept, apart from what other tests of this process keep."""
    monkeypatch.setattr(kept, "_SHELF", kept._Shelf())
    monkeypatch.setattr(kept, "MOST_BYTES", 8 * SIZE)


def laws(count: int) -> tuple[list[Kept], Counter[int]]:
    """Return laws' columns, each its number throughout, and how often each was made."""
    made: Counter[int] = Counter()

    def maker(number: int) -> Callable[[], Floats]:
        def make() -> Floats:
            made[number] += 1
            return np.full((64, 1), float(number))

        return make

    return [Kept(maker(number)) for number in range(count)], made


@given(asked=st.lists(st.one_of(st.integers(0, 19), st.none()), max_size=60))
def test_columns_are_the_same_whenever_they_are_asked_for(asked: list[int | None]) -> None:
    own, _ = laws(20)
    for number in asked:
        if number is None:
            new_round()
        else:
            assert own[number].columns[0, 0] == number
            assert own[number].gram[0, 0] == 64.0 * number**2
    del own
    assert kept_bytes() == 0  # nothing is held for laws that are gone


def test_what_was_asked_for_longest_ago_is_made_again_and_the_rest_is_not() -> None:
    first, made_first = laws(6)
    for law in first:
        _ = law.columns
    new_round()
    second, made_second = laws(6)
    for law in second:
        _ = law.columns
    assert kept_bytes() <= 8 * SIZE
    new_round()
    for law in (*second, *second):
        _ = law.columns
    assert set(made_second.values()) == {1}
    for law in first:
        _ = law.columns
    assert sorted(made_first.values()) == [1, 1, 2, 2, 2, 2]


def test_one_search_may_take_more_than_there_is_room_for() -> None:
    own, made = laws(12)
    for _ in range(5):
        new_round()
        for law in own:
            _ = law.columns
    assert made.total() < 2 * 12  # in turn, again and again: not each of them every time


def test_columns_that_were_given_stay() -> None:
    given_ones = [Kept(None, np.full((64, 1), 1.0)) for _ in range(20)]
    others, _ = laws(20)
    for law in others:
        _ = law.columns
    assert all(law.at_hand is not None for law in given_ones)


def test_columns_come_back_as_they_were_whatever_scene_has_taken_them_over() -> None:
    """A soft gear rests on none of the twin's numbers, and yet on the share that its arm has."""
    run = record(stair((3, 10, 30)), nothing, Conditions(), 1)
    library = library_of([run], asked={"joint-flexibility"})
    gear = library.candidates[0]
    before = gear.columns.copy()
    tried = on_scene(library, replace(library.scene, arm_share=0.3))
    gear.kept.put_away()
    assert tried.candidate(gear.form, gear.point) is gear
    np.testing.assert_array_equal(gear.columns, before)


def test_what_laws_are_mixed_of_is_kept_with_them_and_goes_with_its_scene() -> None:
    run = record(stair((3, 10, 30)), nothing, Conditions(), 1)
    library = library_of([run], asked={"torque-ripple", "load-dependent-friction"})
    scene = library.scene
    wave = scene.wave(6.0).copy()
    new_round()
    made = [c.columns.copy() for c in library.candidates]
    assert scene.parts
    assert kept_bytes() > sum(c.columns.nbytes for c in library.candidates)
    for candidate in library.candidates:
        candidate.kept.put_away()
    new_round()
    new_round()
    np.testing.assert_array_equal(scene.wave(6.0), wave)
    for candidate, columns in zip(library.candidates, made, strict=True):
        np.testing.assert_array_equal(candidate.columns, columns)
    here = ref(scene)
    del library, scene, candidate
    assert here() is None
    assert kept_bytes() == 0
