"""What `drivers.cia402.sync` books: a SYNC with what came back to it, and an answer that waits."""

from __future__ import annotations

import enum
from typing import NamedTuple

from drivers.ports import Goal


class SyncedAnswer:
    """One SYNC: when it was sent, towards which goal, and what came back on each stream."""

    __slots__ = (
        "answers",
        "contested",
        "counted",
        "goal",
        "lost",
        "missing",
        "number",
        "received_s",
        "sent_s",
    )

    def __init__(self, number: int, sent_s: float, goal: Goal, streams: int) -> None:
        self.number = number
        self.sent_s = sent_s
        self.goal = goal
        self.answers: list[bytes] = [b""] * streams
        self.missing = streams
        self.received_s = sent_s
        self.lost = False
        self.contested = False  # it follows a gap, or came late: its place wants a second look
        self.counted = False  # no SYNC before it may wrongly have been given up: it is this one's


class Held(NamedTuple):
    """An answer that waits for its SYNC."""

    stamp_s: float
    data: bytes
    newest: int  # number of the newest SYNC when it was booked
    newest_sent_s: float

    def may_answer(self, entry: SyncedAnswer) -> bool:
        """Return whether it came after this SYNC: by its stamp, and by the order of things."""
        return entry.sent_s <= self.stamp_s and entry.number <= self.newest


class Place(enum.Enum):
    """Whether the motion bears out that an answer belongs to its SYNC and not to the next."""

    BORNE_OUT = "borne out"
    UNKNOWN = "unknown"  # it moves too slowly, or too irregularly
    DOUBTFUL = "doubtful"  # the drive heard its SYNC late, or nobody can tell beside such a one
    CONTRADICTED = "contradicted"
