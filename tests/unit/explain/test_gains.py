"""A gain that a few blocks hold is none by accident where all others that show it agree."""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.entry import steady

SMALL = np.random.default_rng(0).normal(0.0, 0.02, 100)


def test_slow_passes_over_a_bump_do_not_unsay_the_quick_ones() -> None:
    before = np.ones(100)
    before[:3] = 600.0, 150.0, 120.0
    before[3:15] = 3.0
    after = np.ones(100) + SMALL
    gain = before - after
    assert gain.sum() < 2.0 * gain.std() * 10.0
    assert steady(before, after)


def test_one_block_alone_is_an_accident() -> None:
    before = np.ones(100)
    before[0] = 600.0
    assert not steady(before, np.ones(100) + SMALL)


def test_losses_elsewhere_make_a_gain_an_accident() -> None:
    before, after = np.ones(100), np.ones(100) + SMALL
    before[:3], after[20:60] = 40.0, 3.0
    assert not steady(before, after)


def test_errors_that_rounding_made_negative_are_no_warning() -> None:
    """A twin with an inertia of a million let an overflow through to the terminal."""
    before = np.array([-3e6, 2e6, -1e-305, 0.0])
    assert not steady(before, np.array([-4e6, 3e6, 0.0, 0.0]))
