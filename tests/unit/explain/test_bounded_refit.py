"""A rival's refit stays within what its numbers may be, and never looks better for it."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from agent.explain.experiment.rivals import bounded_left

SEEDS = st.integers(0, 10_000)
HALF_WIDTHS = st.lists(st.floats(0.0, 3.0), min_size=4, max_size=4)


@given(SEEDS, HALF_WIDTHS)
def test_a_bounded_refit_leaves_at_least_what_the_best_one_in_bounds_leaves(
    seed: int, widths: list[float]
) -> None:
    rng = np.random.default_rng(seed)
    columns, torque = rng.standard_normal((30, 4)), rng.standard_normal(30) + 1.0
    high = np.array(widths)
    both = np.column_stack((columns, torque))
    left = bounded_left(both.T @ both, (-high, high))
    free = torque - columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]
    # scipy asks for bounds that leave room.
    best = lsq_linear(columns, torque, bounds=(-high - 1e-9, high + 1e-9))
    assert left >= float(free @ free) * (1.0 - 1e-6)
    assert left >= 2.0 * best.cost * (1.0 - 1e-6)


@given(SEEDS)
def test_bounds_that_nothing_touches_change_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    columns, torque = rng.standard_normal((30, 3)), rng.standard_normal(30)
    both = np.column_stack((columns, torque))
    wide = np.full(3, 1e6)
    free = torque - columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]
    assert np.isclose(bounded_left(both.T @ both, (-wide, wide)), float(free @ free), rtol=1e-6)
