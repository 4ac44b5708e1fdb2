"""A slow device beside the control tick: one owner reads it regularly, the tick never waits.

Real time: a thread of its own owns the connection, reads once a period and leaves the newest
result where the tick finds it. Stepped (`SteppedClock`): no thread; `latest` reads when it is due,
so that a simulated night is deterministic.

A reading that fails replaces nothing: the result before it grows older, and whoever uses it
decides how old is too old. `trouble` says why nothing newer has come.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from drivers.clock import Clock, SteppedClock
from drivers.errors import DriverError, WorkerDiedError

T = TypeVar("T")


class Poller(Generic[T]):
    """Reads something again and again.

    Parameters
    ----------
    read : callable
        Given a deadline on the clock, returns what was read or raises a `DriverError`.
    clock : Clock
        For deadlines; a `SteppedClock` selects the mode without a thread.
    period_s : float
        From the beginning of one reading to the beginning of the next.
    timeout_s : float
        What one reading may take.
    name : str
        What messages call the device.
    """

    def __init__(
        self,
        read: Callable[[float], T],
        clock: Clock,
        *,
        period_s: float,
        timeout_s: float,
        name: str,
    ) -> None:
        if not (period_s > 0.0 and timeout_s > 0.0):
            raise ValueError(f"period and time-out must be positive, got {period_s}, {timeout_s}")
        self.name = name
        self.trouble = ""
        self._read = read
        self._clock = clock
        self._period_s = period_s
        self._timeout_s = timeout_s
        self._stepped = isinstance(clock, SteppedClock)
        self._newest: T | None = None
        self._due_s = 0.0
        self._ended = threading.Event()
        self._death: BaseException | None = None
        self._thread: threading.Thread | None = None

    def start(self) -> T:
        """Read once, on the caller's thread, and go on reading from then on.

        Raises
        ------
        DriverError
            What the first reading raised.
        """
        began_s = self._clock.now()
        self._newest = self._read(began_s + self._timeout_s)
        self._due_s = began_s + self._period_s
        if not self._stepped:
            self._thread = threading.Thread(
                target=self._own, name=f"poller {self.name}", daemon=True
            )
            self._thread.start()
        return self._newest

    def latest(self) -> T:
        """Return the newest result; never waits in real time.

        Raises
        ------
        WorkerDiedError
            The thread that reads has ended, or was never started.
        """
        if self._stepped and not self._ended.is_set() and self._clock.now() >= self._due_s:
            self._once()
        alive = self._stepped or (self._thread is not None and self._thread.is_alive())
        if self._newest is None or self._ended.is_set() or not alive:
            why = f" ({self._death})" if self._death is not None else ""
            raise WorkerDiedError(
                f"Nobody reads {self.name} any more{why}.", "Check the device, then start again."
            ) from self._death
        return self._newest

    def stop(self) -> None:
        """End the thread, within one time-out; may be repeated."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()

    def _own(self) -> None:
        """Read until told to end: the thread's whole life."""
        try:
            while not self._ended.wait(max(0.0, self._due_s - self._clock.now())):
                self._once()
        except BaseException as error:  # noqa: BLE001 - kept for `latest`, which reports the death
            self._death = error

    def _once(self) -> None:
        began_s = self._clock.now()
        self._due_s = began_s + self._period_s
        try:
            self._newest = self._read(began_s + self._timeout_s)
            self.trouble = ""
        except DriverError as error:
            self.trouble = error.what.rstrip(".")
