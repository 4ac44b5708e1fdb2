"""Heartbeats of the fake: the one it produces, and the one it waits for."""

from __future__ import annotations

ROUNDING_S = 1e-9  # differences of times that a caller has added up


class HeartbeatProducer:
    """Says when the next heartbeat is due; a late caller gets one, never a burst."""

    def __init__(self) -> None:
        self._period_s = 0.0
        self._due_s = float("inf")

    def configure(self, milliseconds: int, now_s: float) -> None:
        """Take object 0x1017 over; 0 switches the heartbeat off."""
        self._period_s = milliseconds * 1e-3
        self._due_s = now_s if milliseconds else float("inf")

    def is_due(self, now_s: float) -> bool:
        """Return whether to send one now, and plan the next."""
        if now_s < self._due_s:
            return False
        self._due_s += self._period_s
        if self._due_s <= now_s:
            self._due_s = now_s + self._period_s
        return True


class HeartbeatConsumer:
    """Watches one node's heartbeat, from its first one on (CiA 301, object 0x1016)."""

    def __init__(self) -> None:
        self.node_id = 0
        self._period_s = 0.0
        self._last_s: float | None = None

    def configure(self, raw: int) -> None:
        """Take object 0x1016:1 over: node id in bits 16-22, milliseconds in bits 0-15."""
        self._last_s = None
        self._period_s = (raw & 0xFFFF) * 1e-3
        self.node_id = raw >> 16 & 0x7F if self._period_s else 0

    def seen(self, now_s: float) -> None:
        """Note a heartbeat."""
        self._last_s = now_s

    def has_expired(self, now_s: float) -> bool:
        """Return True once when the heartbeat has stayed away for too long."""
        if self._last_s is None or not self._period_s:
            return False
        if now_s - self._last_s <= self._period_s + ROUNDING_S:
            return False
        self._last_s = None
        return True
