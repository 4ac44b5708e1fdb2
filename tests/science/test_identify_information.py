"""The information limit, a quick slice of ``python -m tests.benchmarks.identification``."""

from __future__ import annotations

import numpy as np

from tests.science.information import campaign


def test_intervals_cover_and_errors_are_near_the_bound() -> None:
    seeds = 40
    scores = campaign(range(seeds))
    assert len(scores) == 8
    # 40 seeds: an honest 95 % interval covers 34 or more times in 99 of 100 such tests, and an
    # error at the bound exceeds it by less than 30 %.
    for score in scores:
        assert score.coverage >= 34 / seeds, score
        assert 0.7 <= score.ratio <= 1.3, score
    assert 0.91 <= np.mean([score.coverage for score in scores]) <= 0.99
    assert np.mean([score.ratio for score in scores]) <= 1.15
