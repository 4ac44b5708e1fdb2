"""Intervals under a known truth: noise alone, recordings that differ, a small law left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.explain.choosing.candidate import Candidate
from agent.explain.forms.form import Form
from agent.explain.numbers.reach import reach_of
from agent.explain.rows.evidence import Weighing
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

RECORDINGS, BLOCKS, ROWS = 6, 4, 25
COUNT = RECORDINGS * BLOCKS * ROWS


def _not_needed(_scene: Scene, _point: tuple[float, ...]) -> Floats:
    raise AssertionError("columns are given")


SMALL = Form("cable-force", "small", ("stiffness",), _not_needed)


def weighing() -> Weighing:
    run = np.repeat(np.arange(RECORDINGS), BLOCKS * ROWS)
    return Weighing(
        rows=np.arange(COUNT),
        weight=np.ones(COUNT),
        starts=np.arange(0, COUNT, ROWS),
        fold=np.repeat(np.arange(RECORDINGS), BLOCKS),
        run=run,
        by_run=True,
    )


def covered(
    column: Floats, target: Floats, truth: float, candidates: Sequence[Candidate] = ()
) -> tuple[bool, float]:
    """Return whether the interval has the truth, and its length."""
    estimate = float(column @ target) / float(column @ column)
    reach = reach_of(
        candidates, weighing(), column[:, None], target - estimate * column, frozenset()
    )
    low, high = estimate + float(reach.below[0]), estimate + float(reach.above[0])
    return low <= truth <= high, high - low


def test_noise_alone_is_covered_as_often_as_promised() -> None:
    rng = np.random.default_rng(1)
    hits, lengths = [], []
    for _ in range(80):
        column = rng.standard_normal(COUNT)
        hit, length = covered(column, 0.7 * column + rng.standard_normal(COUNT), 0.7)
        hits.append(hit)
        lengths.append(length)
    assert np.mean(hits) >= 0.91
    # Two normal quantiles of the exact standard error, and what six recordings cost.
    assert np.mean(lengths) < 1.6 * 2.0 * 1.96 / np.sqrt(COUNT)


def test_recordings_that_differ_are_covered() -> None:
    """What differs from recording to recording is not averaged away by many samples."""
    rng = np.random.default_rng(2)
    hits = []
    for _ in range(80):
        column = rng.standard_normal(COUNT)
        slopes = 0.7 + 0.1 * rng.standard_normal(RECORDINGS)
        target = np.repeat(slopes, BLOCKS * ROWS) * column + 0.1 * rng.standard_normal(COUNT)
        hits.append(covered(column, target, 0.7)[0])
    assert np.mean(hits) >= 0.90


@pytest.mark.parametrize(("known", "least", "most"), [(True, 0.91, 1.0), (False, 0.0, 0.5)])
def test_a_small_law_left_out_is_covered_where_the_library_has_it(
    known: bool, least: float, most: float
) -> None:
    rng = np.random.default_rng(3)
    hits = []
    for _ in range(60):
        column = rng.standard_normal(COUNT)
        small = 0.5 * column + rng.standard_normal(COUNT)
        target = 0.7 * column + 0.25 * small + rng.standard_normal(COUNT)
        others = (Candidate.of(SMALL, (), small[:, None]),) if known else ()
        hits.append(covered(column, target, 0.7, others)[0])
    assert least <= np.mean(hits) <= most


def test_what_is_left_along_other_laws_is_missing_along_the_models_own() -> None:
    """Many small laws, none of them the library's: they bend a number as they fill the others."""
    rng = np.random.default_rng(6)
    hits, alone = [], []
    for _ in range(40):
        waves = np.sin(np.outer(np.arange(COUNT), rng.uniform(0.005, 0.05, 12)))
        unknown = waves @ rng.standard_normal(12)
        column, *others = np.sin(
            np.outer(np.arange(COUNT), rng.uniform(0.005, 0.05, 9)) + rng.uniform(0.0, 6.0, 9)
        ).T
        target = 0.7 * column + 0.1 * unknown + 0.05 * rng.standard_normal(COUNT)
        laws = [
            Candidate.of(replace(SMALL, name=f"{i}"), (), other[:, None])
            for i, other in enumerate(others)
        ]
        hits.append(covered(column, target, 0.7, laws)[0])
        alone.append(covered(column, target, 0.7)[0])
    assert np.mean(hits) >= 0.9
    assert np.mean(hits) > np.mean(alone)


@settings(deadline=None, max_examples=10)
@given(st.floats(1e-6, 1e6), st.integers(0, 100))
def test_units_do_not_matter(scale: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    column, left = rng.standard_normal((2, COUNT))
    left -= column * float(column @ left) / float(column @ column)
    one, other = (
        reach_of((), weighing(), c[:, None], left, frozenset()) for c in (column, scale * column)
    )
    np.testing.assert_allclose(other.above * scale, one.above, rtol=1e-6)
    np.testing.assert_allclose(other.below * scale, one.below, rtol=1e-6)


def test_another_name_for_a_number_does_not_make_it_unknown() -> None:
    """As friction under a load that is inertia's alone is, of inertia and Coulomb friction."""
    rng = np.random.default_rng(7)
    column = rng.standard_normal(COUNT)
    renamed = column + 0.01 * rng.standard_normal(COUNT)
    target = 0.7 * column + 0.1 * rng.standard_normal(COUNT)
    hit, length = covered(column, target, 0.7, (Candidate.of(SMALL, (), renamed[:, None]),))
    assert hit
    assert length < 1.1 * covered(column, target, 0.7)[1]
