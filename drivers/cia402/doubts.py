"""When rows were taken that may stand in another's place in time: intervals, bounded in number."""

from __future__ import annotations

MOST = 256
"""Intervals that are kept apart; beyond, the two that lie closest become one that holds both."""


class Doubts:
    """Intervals of time in which rows are doubtful, on the clock of their SYNCs."""

    def __init__(self) -> None:
        self._spans: list[tuple[float, float]] = []

    def add(self, from_s: float, until_s: float) -> None:
        """Doubt every row whose SYNC was sent in this time, both ends with it."""
        self._spans.append((from_s, until_s))
        if len(self._spans) > MOST:
            self._spans = list(self.spans())
            if len(self._spans) > MOST:
                self._join_the_closest()

    def spans(self) -> tuple[tuple[float, float], ...]:
        """Return the intervals in their order, none touching another."""
        apart: list[tuple[float, float]] = []
        for from_s, until_s in sorted(self._spans):
            if apart and from_s <= apart[-1][1]:
                apart[-1] = (apart[-1][0], max(apart[-1][1], until_s))
            else:
                apart.append((from_s, until_s))
        return tuple(apart)

    def _join_the_closest(self) -> None:
        """Make one interval of the two with the least time between them."""
        spans = self._spans
        k = min(range(1, len(spans)), key=lambda k: spans[k][0] - spans[k - 1][1])
        spans[k - 1 : k + 1] = [(spans[k - 1][0], spans[k][1])]
