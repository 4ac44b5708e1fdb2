"""The machine's clock: a sleep that the kernel ends by itself, whoever interrupts it meanwhile."""

from __future__ import annotations

import math
import os
import signal
import sys
import threading

import pytest

from drivers import clock
from drivers.clock import MonotonicClock

CLOCK = MonotonicClock()
AT_ONCE_S = 10.0  # a loaded machine may be late; what is slept for as well would be 1e6 s


@pytest.fixture(params=["by the deadline", "by what is left"])
def sleeper(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Sleep as 64-bit Linux does, and as any other platform."""
    if request.param == "by what is left":
        monkeypatch.setattr(clock, "_sleeper", lambda: clock._sleep_by_remaining)


@pytest.mark.usefixtures("sleeper")
def test_a_deadline_has_passed_when_the_sleep_is_over() -> None:
    for after_s in (-math.inf, -1e6, -0.01, 0.0, 1e-9, 1e-4, 0.003):  # -inf: never busy before
        began_s = CLOCK.now()
        CLOCK.sleep_until(began_s + after_s)
        assert began_s + after_s <= CLOCK.now() < began_s + max(after_s, 0.0) + AT_ONCE_S


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the time that is left is slept")
def test_on_linux_nobody_asks_for_the_time_to_sleep(monkeypatch: pytest.MonkeyPatch) -> None:
    until_s = CLOCK.now() + 0.005
    monkeypatch.setattr(clock, "_monotonic_s", None)  # a system call where time is no page to read
    CLOCK.sleep_until(until_s)
    monkeypatch.undo()
    assert CLOCK.now() >= until_s


@pytest.mark.skipif(sys.platform == "win32", reason="signals to oneself")
@pytest.mark.parametrize("stops", [False, True])
def test_a_signal_is_heard_in_a_sleep_and_ends_it_only_by_raising(stops: bool) -> None:
    heard_s: list[float] = []

    def hear(*_: object) -> None:
        heard_s.append(CLOCK.now())
        if stops:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGUSR1, hear)
    sender = threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGUSR1))
    until_s = CLOCK.now() + (60.0 if stops else 0.05)
    try:
        sender.start()
        CLOCK.sleep_until(until_s)
        assert not stops
    except KeyboardInterrupt:
        assert stops
    finally:
        sender.join()
        signal.signal(signal.SIGUSR1, before)
    assert len(heard_s) == 1
    assert (CLOCK.now() >= until_s) is not stops
