"""What had been asked for when a sample was taken: the newest sample answers an older tick."""

from __future__ import annotations

from collections import deque

from agent.cycle.gate import Asked


class Asking:
    """Remembers each tick's set-points until a sample has answered a later tick."""

    def __init__(self) -> None:
        self._ticks: deque[tuple[float, Asked]] = deque()

    def ask(self, now_s: float, asked: Asked) -> None:
        """Remember what the tick at `now_s` asks for."""
        self._ticks.append((now_s, asked))

    def forget_before(self, sampled_s: float) -> None:
        """Forget what was asked for before the tick that a sample taken at `sampled_s` answers."""
        while len(self._ticks) > 1 and self._ticks[1][0] <= sampled_s:
            self._ticks.popleft()

    def answered(self, sampled_s: float) -> Asked | None:
        """Return what was asked for in the tick that a sample taken at `sampled_s` answers.

        None where nothing had been asked for by then.
        """
        if self._ticks and self._ticks[0][0] <= sampled_s:
            return self._ticks[0][1]
        return None
