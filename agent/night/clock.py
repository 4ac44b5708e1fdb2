"""The wall's clock: the one place where the night reads it, because a schedule is in its times."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from typing import Protocol

from drivers.clock import MonotonicClock

_SLICE_S = 1.0


class WallClock(Protocol):
    """What time it is, and the only way to wait for another."""

    def now(self) -> datetime.datetime:
        """Return the time in UTC; it may be set back or forth by others."""
        ...

    def wait_until(self, at: datetime.datetime, stopped: Callable[[], bool]) -> None:
        """Return at about `at`, or soon after somebody has asked to stop."""
        ...


class MachineClock:
    """The machine's clock. It is asked every second, so that a clock that is set is noticed."""

    def __init__(self) -> None:
        self._monotonic = MonotonicClock()

    def now(self) -> datetime.datetime:
        """Return the machine's time in UTC."""
        return datetime.datetime.now(tz=datetime.UTC)

    def wait_until(self, at: datetime.datetime, stopped: Callable[[], bool]) -> None:
        """Wait in slices of a second."""
        while not stopped():
            left_s = (at - self.now()).total_seconds()
            if left_s <= 0.0:
                return
            self._monotonic.sleep_until(self._monotonic.now() + min(left_s, _SLICE_S))


def stamp(at: datetime.datetime) -> str:
    """Return a time as events carry it: ISO 8601, UTC, milliseconds."""
    utc = at.astimezone(datetime.UTC)
    return utc.isoformat(timespec="milliseconds").replace("+00:00", "Z")
