"""Whether a controller is still heard, and whether its job program still counts."""

from __future__ import annotations

import math

from drivers.errors import HeartbeatLostError


class ControllerLife:
    """Follows a controller's alive count; `begin` before the first `heard`.

    Parameters
    ----------
    limit_s : float
        How long it may be silent, or its count may stand still.

    Attributes
    ----------
    trouble : str
        Why the newest request failed; empty after an answer.
    """

    def __init__(self, limit_s: float) -> None:
        self.trouble = ""
        self._limit_s = limit_s
        self._count: int | None = None
        self._counted_s = -math.inf
        self._heard_s = -math.inf

    def begin(self, count: int, now_s: float) -> None:
        """Take it for alive, whatever it counts: nobody watches it yet."""
        self._count = count
        self._counted_s = self._heard_s = now_s

    def heard(self, count: int, now_s: float) -> None:
        """Note an answer with its count."""
        self._heard_s = now_s
        self.trouble = ""
        if count != self._count:
            self._count, self._counted_s = count, now_s

    def refuse_silence(self, now_s: float) -> None:
        """Refuse a controller that says nothing any more, or always the same count.

        Raises
        ------
        HeartbeatLostError
        """
        if now_s - self._heard_s > self._limit_s:
            raise HeartbeatLostError(
                f"The controller has been silent for {now_s - self._heard_s:.2f} s: {self.trouble}",
                "Check its network and its job program.",
            )
        still_s = now_s - self._counted_s
        if still_s > self._limit_s:
            raise HeartbeatLostError(
                f"The controller's alive count has stood still for {still_s:.2f} s.",
                "Its job program hangs or has ended: look at the controller.",
            )
