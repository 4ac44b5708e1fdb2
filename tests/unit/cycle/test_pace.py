"""A control loop's ticks on a computer that wakes it late."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.cycle.pace import LEAST_REST, ticks
from drivers.clock import SteppedClock

TICK_S = 0.005


class _Late(SteppedClock):
    """Wakes whoever sleeps later than asked, by what it is given in turn."""

    def __init__(self, late_s: list[float]) -> None:
        super().__init__()
        self._late_s = iter(late_s)

    def sleep_until(self, deadline_s: float) -> None:
        super().sleep_until(deadline_s + next(self._late_s, 0.0))


@given(late_s=st.lists(st.just(0.0) | st.floats(0.0, 0.05), max_size=40))
def test_no_tick_is_caught_up_and_none_comes_hard_on_the_heels_of_a_late_one(
    late_s: list[float],
) -> None:
    pace = ticks(_Late(late_s), TICK_S)
    at_s = [next(pace) for _ in range(len(late_s) + 6)]
    gaps_s = [after - before for before, after in pairwise(at_s)]
    assert all(gap >= LEAST_REST * TICK_S * (1.0 - 1e-9) for gap in gaps_s)
    assert gaps_s[-3:] == pytest.approx([TICK_S] * 3)  # once it is woken in time again
