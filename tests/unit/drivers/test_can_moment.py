"""Two clocks of one moment: as close as the machine can, with no system call more than needed."""

from __future__ import annotations

import time

import pytest

from drivers.can.moment import BothClocks
from drivers.clock import MonotonicClock


class SlowClock(MonotonicClock):
    """A clock of which each reading takes its time, as where it is a system call."""

    def __init__(self, takes_s: float) -> None:
        self.time_s = 100.0
        self.takes_s = takes_s
        self.interrupted: dict[int, float] = {}
        self.asked = 0

    def now(self) -> float:
        self.asked += 1
        self.time_s += self.takes_s + self.interrupted.pop(self.asked, 0.0)
        return self.time_s


def test_a_machine_on_which_the_time_is_dear_is_asked_once_and_no_longer_thrice() -> None:
    clock = SlowClock(20e-6)
    clocks = BothClocks(clock)
    clocks.read()
    assert clock.asked == 6  # it might have come closer
    clocks.read()
    assert clock.asked == 8


def test_who_is_interrupted_between_the_two_clocks_tries_again() -> None:
    for takes_s in (20e-6, 1e-7):
        clock = SlowClock(takes_s)
        clocks = BothClocks(clock)
        clocks.read()
        clock.interrupted[clock.asked + 2] = 0.003
        before_s = clock.time_s
        now_s, _ = clocks.read()
        assert now_s - before_s > 0.003  # not the middle of the pair that took so long
        assert clock.time_s - now_s < takes_s


def test_an_interruption_at_the_first_reading_does_not_set_the_measure() -> None:
    clock = SlowClock(1e-6)
    clock.interrupted[2] = 0.003
    now_s, _ = BothClocks(clock).read()
    assert clock.time_s - now_s < 1e-6


def test_the_pair_is_of_one_moment() -> None:
    clock = MonotonicClock()
    before_s = clock.now()
    now_s, wall_s = BothClocks(clock).read()
    assert before_s <= now_s <= clock.now()
    assert abs(wall_s - time.time()) < 1.0  # noqa: TID251 - the one that is read


def test_a_computer_that_stands_still_moves_no_stamp_and_a_clock_that_is_set_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All three tries are held up: stamps would be off by half of the shortest."""
    clock, ahead_s = SlowClock(1e-6), 1e9
    monkeypatch.setattr(time, "time", lambda: clock.time_s + ahead_s)
    clocks = BothClocks(clock)
    for held_up_s, set_by_s in ((0.0, 0.0), (0.05, 0.0), (0.0, 0.0), (0.05, 3600.0)):
        ahead_s += set_by_s
        clock.interrupted = {clock.asked + k: held_up_s * k for k in (2, 4, 6)}
        now_s, wall_s = clocks.read()
        error_s = wall_s - now_s - ahead_s
        assert abs(error_s) < (0.1 if set_by_s else 2e-6)
