"""Which answer belongs to which SYNC, and what became of those that got none.

A TPDO carries no number, so the order has to do. Let `k` SYNCs be unanswered and `m` answers be
waiting. While every waiting answer has its SYNC (m = k up to the answer's stamp) they pair in
order, however late they are. With fewer answers than SYNCs nobody can yet say whether one is late
or lost, so the answers wait; once the oldest SYNC has gone unanswered for the time-out it is
lost, and the next ones pair. An answer is therefore never booked under its neighbour's time
because a frame before it was lost.

Whoever settles says until when every answer that came has been booked: a busy computer that has not
listened yet has not been left unanswered. And a SYNC that was never sent is not lost either: it is
counted by the gap between those that were.
"""

from __future__ import annotations

import math
from collections import deque

from drivers.ports import Goal, SyncAccount


class SyncedAnswer:
    """One SYNC: when it was sent, towards which goal, and what came back on each stream."""

    __slots__ = ("answers", "goal", "lost", "missing", "received_s", "sent_s")

    def __init__(self, sent_s: float, goal: Goal, streams: int) -> None:
        self.sent_s = sent_s
        self.goal = goal
        self.answers: list[bytes] = [b""] * streams
        self.missing = streams
        self.received_s = sent_s
        self.lost = False


class SyncLedger:
    """Books SYNCs and answers on one or two streams (TPDO1, TPDO2).

    Parameters
    ----------
    streams : int
        How many TPDOs answer each SYNC; a SYNC counts as answered when all have come.
    timeout_s : float
        After this long an unanswered SYNC may be given up.
    period_s : float
        Between two SYNCs, as it should be; infinite where there is no such thing.
    """

    def __init__(self, streams: int, timeout_s: float, period_s: float = math.inf) -> None:
        self._timeout_s = timeout_s
        self._period_s = period_s
        self._streams = streams
        self._in_order: deque[SyncedAnswer] = deque()
        self._open: tuple[deque[SyncedAnswer], ...] = tuple(deque() for _ in range(streams))
        self._held: tuple[deque[tuple[float, bytes]], ...] = tuple(deque() for _ in range(streams))
        self.expected = 0
        self.received = 0
        self.lost = 0
        self.late = 0
        self.unasked = 0  # answers that no SYNC was open for, duplicates among them
        self.duplicates = 0
        self.not_asked = 0
        self.consecutive_lost = 0
        self._newest = [b""] * streams
        self._last_sent_s: float | None = None
        self._longest_gap_s = 0.0
        self._mean_delay_s = 0.0
        self._sum_squares = 0.0

    def sent(self, sent_s: float, goal: Goal) -> None:
        """Book a SYNC that is about to be sent."""
        entry = SyncedAnswer(sent_s, goal, self._streams)
        self.expected += 1
        if self._last_sent_s is not None:
            gap_s = sent_s - self._last_sent_s
            self._longest_gap_s = max(self._longest_gap_s, gap_s)
            if gap_s > 1.5 * self._period_s:
                self.not_asked += round(gap_s / self._period_s) - 1
        self._last_sent_s = sent_s
        self._in_order.append(entry)
        for queue in self._open:
            queue.append(entry)

    def answered(self, stream: int, stamp_s: float, data: bytes) -> None:
        """Book an answer on `stream`, to be paired by `settle`."""
        self._held[stream].append((stamp_s, data))

    def settle(self, now_s: float) -> list[SyncedAnswer]:
        """Pair what can be paired and return the answered SYNCs, oldest first.

        Parameters
        ----------
        now_s : float
            Every answer that came before this has been booked.
        """
        for stream in range(self._streams):
            if self._held[stream] or self._open[stream]:
                self._pair(stream, now_s)
        done: list[SyncedAnswer] = []
        queue = self._in_order
        while queue and (queue[0].lost or not queue[0].missing):
            entry = queue.popleft()
            if entry.lost:
                self.lost += 1
                self.consecutive_lost += 1
                continue
            self._count(entry, queue[0].sent_s if queue else math.inf)
            done.append(entry)
        return done

    @property
    def waiting_since_s(self) -> float | None:
        """Return when the oldest SYNC that is neither answered nor lost was sent."""
        return self._in_order[0].sent_s if self._in_order else None

    def account(self) -> SyncAccount:
        """Return the counts so far; SYNCs that still wait are expected, nothing else yet."""
        variance = self._sum_squares / (self.received - 1) if self.received > 1 else 0.0
        return SyncAccount(
            expected=self.expected,
            received=self.received,
            lost=self.lost,
            late=self.late,
            jitter_s=math.sqrt(variance),
            duplicates=self.duplicates,
            unmatched=self.unasked - self.duplicates,
            not_asked=self.not_asked,
            longest_gap_s=self._longest_gap_s,
        )

    def _pair(self, stream: int, now_s: float) -> None:
        """Pair one stream's waiting answers with its open SYNCs, giving up the overdue ones."""
        open_, held = self._open[stream], self._held[stream]
        while held:
            stamp_s, data = held[0]
            if not open_ or open_[0].sent_s > stamp_s:
                held.popleft()
                self.unasked += 1
                self.duplicates += data == self._newest[stream]
            elif len(open_) == 1 or self._pairs_fully(open_, held):
                held.popleft()
                entry = open_.popleft()
                entry.answers[stream] = self._newest[stream] = data
                entry.missing -= 1
                entry.received_s = max(entry.received_s, stamp_s)
            elif now_s - open_[0].sent_s > self._timeout_s:
                open_.popleft().lost = True
            else:
                return
        while open_ and now_s - open_[0].sent_s > self._timeout_s:
            open_.popleft().lost = True

    @staticmethod
    def _pairs_fully(open_: deque[SyncedAnswer], held: deque[tuple[float, bytes]]) -> bool:
        """Return whether some prefix of the answers has exactly as many SYNCs sent before it."""
        asked = 0
        for number, (stamp_s, _) in enumerate(held, start=1):
            while asked < len(open_) and open_[asked].sent_s <= stamp_s:
                asked += 1
            if asked <= number:
                return True
        return False

    def _count(self, entry: SyncedAnswer, next_sent_s: float) -> None:
        """Count one answered SYNC and take its delay into mean and variance (Welford)."""
        self.consecutive_lost = 0
        self.received += 1
        if entry.received_s > next_sent_s:
            self.late += 1
        delay_s = entry.received_s - entry.sent_s
        difference_s = delay_s - self._mean_delay_s
        self._mean_delay_s += difference_s / self.received
        self._sum_squares += difference_s * (delay_s - self._mean_delay_s)
