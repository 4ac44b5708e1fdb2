"""How often somebody may try: log-ins and tokens, by name and by address."""

from __future__ import annotations

from collections import OrderedDict

from drivers.clock import Clock

FREE = 5
"""Failures in a row before anybody has to wait."""
FIRST_WAIT_S = 5.0
LONGEST_WAIT_S = 300.0
FORGOTTEN_S = 900.0
MOST_KEYS = 10_000


class Attempts:
    """Failures by key; each one after the free ones doubles the wait, up to five minutes.

    A wait, not a lock: nobody can keep a colleague out for good by typing a wrong password.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._failures: OrderedDict[str, tuple[int, float]] = OrderedDict()

    def wait_s(self, *keys: str) -> float:
        """Return how long to wait before the next try; 0 when it may come now."""
        return max((self._wait_s(key) for key in keys), default=0.0)

    def failed(self, *keys: str) -> None:
        """Count one failure under every key."""
        now_s = self._clock.now()
        for key in keys:
            count, last_s = self._failures.pop(key, (0, now_s))
            count = 0 if now_s - last_s > FORGOTTEN_S else count
            self._failures[key] = (count + 1, now_s)
        while len(self._failures) > MOST_KEYS:
            self._failures.popitem(last=False)

    def worked(self, *keys: str) -> None:
        """Forget the failures under these keys."""
        for key in keys:
            self._failures.pop(key, None)

    def _wait_s(self, key: str) -> float:
        count, last_s = self._failures.get(key, (0, 0.0))
        if count < FREE:
            return 0.0
        wait_s = min(FIRST_WAIT_S * 2.0 ** min(count - FREE, 30), LONGEST_WAIT_S)
        return max(0.0, last_s + wait_s - self._clock.now())
