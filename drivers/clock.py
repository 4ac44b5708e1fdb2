"""The one home of time: every deadline and every dt comes from a clock that is handed in.

Wall time is only a label (`wall_time_utc`); nothing is ever computed from it.
"""

from __future__ import annotations

import ctypes
import datetime
import errno
import functools
import struct
import sys
import time
from collections.abc import Callable
from typing import Protocol


class Clock(Protocol):
    """Monotonic time and the only way to wait."""

    def now(self) -> float:
        """Return monotonic seconds; the origin is arbitrary, the value never falls."""
        ...

    def sleep_until(self, deadline_s: float) -> None:
        """Return when `now()` has reached `deadline_s`; at once when it has passed."""
        ...

    def settle(self) -> None:
        """Let everything that lives on this clock catch up with `now()`; time does not move."""
        ...


def _time_asleep_included() -> Callable[[], float]:
    """Return the machine's monotonic clock that goes on while the machine sleeps.

    `time.monotonic` stops then, on Linux and macOS: a notebook that is opened again an hour later
    would take the newest sample for fresh, and go on with the motion.
    """
    source: Callable[[], float] = time.monotonic
    if sys.platform == "linux":
        source = functools.partial(time.clock_gettime, time.CLOCK_BOOTTIME)
    elif sys.platform == "darwin":  # `time.monotonic` is mach_absolute_time there, this is not
        source = functools.partial(time.clock_gettime, time.CLOCK_MONOTONIC)
    elif sys.platform == "win32":
        # Before Python 3.13 `time.monotonic` goes on in steps of 16 ms there: eight ticks of a
        # cycle would bear the same stamp. This is of 0.1 us, and one for all processes.
        source = time.perf_counter
    return source


_monotonic_s = _time_asleep_included()


def _sleep_by_remaining(deadline_s: float) -> None:
    """Sleep until `deadline_s` by what is left of it: two readings of the time beside the sleep."""
    remaining_s = deadline_s - _monotonic_s()
    if remaining_s > 0.0:
        time.sleep(remaining_s)  # noqa: TID251 - this is the clock


_TIMESPEC = struct.Struct("=qq")
_BOOTTIME, _ABSOLUTE = 7, 1  # CLOCK_BOOTTIME, TIMER_ABSTIME: linux/time.h


@functools.cache
def _sleeper() -> Callable[[float], None]:
    """Return how to sleep until a deadline on this machine.

    On 64-bit Linux the kernel is told the deadline itself (clock_nanosleep(2), TIMER_ABSTIME): one
    system call instead of three where reading the time is one, and right where the machine slept
    meanwhile. Whoever returns from it knows that the deadline has passed without asking for the
    time.
    """
    if sys.platform != "linux" or struct.calcsize("P") != 8:
        return _sleep_by_remaining
    call = getattr(ctypes.CDLL(None), "clock_nanosleep", None)
    if call is None:
        return _sleep_by_remaining
    # No `argtypes`: int, int, bytes and None are what C expects as they are, and each that is named
    # is a call of its own (1.2 us of what a waking takes).

    def sleep_until(deadline_s: float) -> None:
        """Sleep; a signal's handler runs, and what it raises ends the sleep."""
        until_s = deadline_s if deadline_s > 0.0 else 0.0  # whatever has passed, -inf too
        until = _TIMESPEC.pack(*divmod(int(until_s * 1e9) + 1, 10**9))
        while code := call(_BOOTTIME, _ABSOLUTE, until, None):
            if code != errno.EINTR:  # a sandbox without this clock, for one
                return _sleep_by_remaining(deadline_s)
        return None

    return sleep_until


class MonotonicClock:
    """The machine's monotonic clock: real time, that spent asleep included; nothing to settle."""

    def now(self) -> float:
        """Return the machine's monotonic time in seconds."""
        return _monotonic_s()

    def sleep_until(self, deadline_s: float) -> None:
        """Sleep until the monotonic clock has reached `deadline_s`."""
        _sleeper()(deadline_s)

    def settle(self) -> None:
        """Do nothing: the world outside moves by itself."""


class SteppedClock:
    """Simulated time for one thread: sleeping *is* what moves the attached devices.

    A device attaches its `step_to(now_s)`; it is called on every `sleep_until` and `settle`, in
    order of attachment, so that a run is deterministic and as fast as the machine allows.
    """

    def __init__(self, start_s: float = 0.0) -> None:
        self._now_s = start_s
        self._devices: list[Callable[[float], None]] = []

    def attach(self, step_to: Callable[[float], None]) -> None:
        """Let `step_to(now_s)` be called whenever time moves or must settle."""
        self._devices.append(step_to)

    def now(self) -> float:
        """Return simulated seconds."""
        return self._now_s

    def sleep_until(self, deadline_s: float) -> None:
        """Jump to `deadline_s` and step every attached device to it."""
        self._now_s = max(self._now_s, deadline_s)
        self.settle()

    def settle(self) -> None:
        """Step every attached device to the present time."""
        for step_to in self._devices:
            step_to(self._now_s)


def wall_time_utc() -> str:
    """Return the wall time as ISO 8601 in UTC: a label for files, never a number to compute with.

    Returns
    -------
    str
        For example ``2026-03-01T02:03:04.567Z``.
    """
    now = datetime.datetime.now(tz=datetime.UTC)
    return now.isoformat(timespec="milliseconds").replace("+00:00", "Z")
