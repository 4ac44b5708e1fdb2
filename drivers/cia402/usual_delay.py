"""How long after its SYNC an answer usually comes."""

from __future__ import annotations

import math

_MEMORY = 0.125
_DEVIATIONS = 4.0
_LEAST_TOLERANCE, _MOST_TOLERANCE = 0.05, 0.4  # of the period


class UsualDelay:
    """How long after its SYNC an answer comes, learnt from those that can belong to one alone.

    Mean and mean deviation with a memory of some eight answers, as TCP's estimate of a round trip
    (Jacobson 1988).
    """

    def __init__(self) -> None:
        self._mean_s = math.nan
        self._deviation_s = 0.0

    def learn(self, delay_s: float) -> None:
        """Take one delay into account."""
        if math.isnan(self._mean_s):
            self._mean_s = delay_s
            return
        off_s = delay_s - self._mean_s
        self._mean_s += _MEMORY * off_s
        self._deviation_s += _MEMORY * (abs(off_s) - self._deviation_s)

    def holds(self, delay_s: float, period_s: float) -> bool:
        """Return whether a delay is the usual one; never, while nothing has been learnt."""
        tolerance_s = _DEVIATIONS * self._deviation_s + _LEAST_TOLERANCE * period_s
        return abs(delay_s - self._mean_s) <= min(tolerance_s, _MOST_TOLERANCE * period_s)
