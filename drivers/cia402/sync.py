"""Which answer belongs to which SYNC, and what became of those that got none.

A TPDO carries no number, so order and delay have to do. Let `k` SYNCs be unanswered and `m`
answers be waiting.

1. While every waiting answer has its SYNC (m = k up to the answer's stamp) they pair in order,
   however late they are: a CAN bus does not let one frame of an identifier overtake the other.
2. With fewer answers than SYNCs one is late or lost. An answer that comes as long after the newest
   SYNC as answers usually do belongs to that one, and those before it are lost; but not before
   the others have had half a period to follow. A drive that comes late to its SYNCs answers them
   all at once, and the first may come when the newest is usually answered.
3. One that comes at another time may be late by more than a period, or the delay has changed and
   another one is lost: nobody can say. It waits for the others to catch up (1.); once the oldest
   SYNC has gone unanswered for the time-out, that SYNC is lost and the answer *undecided*. It is
   counted and given to nobody.

So nothing is booked under its neighbour's time because a frame before it was lost, nor because all
answers are late. What 1. and 2. cannot see is a delay that has grown by a whole number of periods,
and a link that reorders. So whoever settles holds what came late or after a gap against the motion
(`drivers.cia402.placing`), and what contradicts it is undecided, too. At standstill nothing can
contradict; but then an answer too many comes in the end, and every row since the SYNC that had
wrongly been given up is *doubtful*.

So is each row that the drive has measured late, because the SYNC itself was held up on its way, and
one that the motion contradicts while no SYNC may wrongly have been given up: then the count says
whose it is, but it is not of that time. Beside such a row what nobody can tell is doubtful, too.
Doubtful rows are counted and located, so that whoever reads them can leave them out.

Whoever settles says until when every answer that came has been booked: a busy computer that has not
listened yet has not been left unanswered. And a SYNC that was never sent is not lost either: it is
counted by the gap between those that were.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from drivers.cia402.answers import Held, Place, SyncedAnswer
from drivers.cia402.doubts import Doubts
from drivers.cia402.usual_delay import UsualDelay
from drivers.ports import Goal, SyncAccount


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
    usual : tuple of UsualDelay, optional
        Of each stream, as another ledger has learnt it.
    """

    def __init__(
        self,
        streams: int,
        timeout_s: float,
        period_s: float = math.inf,
        usual: tuple[UsualDelay, ...] = (),
    ) -> None:
        self._timeout_s = timeout_s
        self._period_s = period_s
        self._streams = streams
        self._in_order: deque[SyncedAnswer] = deque()
        self._open: tuple[deque[SyncedAnswer], ...] = tuple(deque() for _ in range(streams))
        self._held: tuple[deque[Held], ...] = tuple(deque() for _ in range(streams))
        self.usual = usual or tuple(UsualDelay() for _ in range(streams))
        self._given_up: list[SyncedAnswer | None] = [None] * streams  # the first, while in doubt
        self._after_gap = False
        self._late_s = 0.5 * period_s
        self.expected = 0
        self.received = 0
        self.lost = 0
        self.undecided = 0  # lost, although an answer came that may have been theirs
        self._doubts = Doubts()
        self._doubtful = [0] * streams  # since a SYNC that was wrongly given up
        self._out_of_time = 0  # each for itself
        self.late = 0
        self.unasked = 0  # answers that no SYNC was open for, duplicates among them
        self.duplicates = 0
        self.not_asked = 0
        self.consecutive_lost = 0
        self.most_in_a_row = 0  # the longest run of lost ones, however it ended
        self._newest = [b""] * streams
        self._last_sent_s: float | None = None
        self._longest_gap_s = 0.0
        self._mean_delay_s = 0.0
        self._sum_squares = 0.0

    def sent(self, sent_s: float, goal: Goal) -> None:
        """Book a SYNC that is about to be sent."""
        self.expected += 1
        entry = SyncedAnswer(self.expected, sent_s, goal, self._streams)
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
        newest_s = -math.inf if self._last_sent_s is None else self._last_sent_s
        self._held[stream].append(Held(stamp_s, data, self.expected, newest_s))

    def settle(
        self, now_s: float, place: Callable[[SyncedAnswer], Place] = lambda _answer: Place.UNKNOWN
    ) -> list[SyncedAnswer]:
        """Pair what can be paired and return the answered SYNCs, oldest first.

        Parameters
        ----------
        now_s : float
            Every answer that came before this has been booked.
        place : callable
            Told each answer in turn, says whether the motion bears it out; one that it
            contradicts is lost, and should be doubtful only where it is `counted`.
        """
        for stream in range(self._streams):
            if self._held[stream] or self._open[stream]:
                self._pair(stream, now_s)
        done: list[SyncedAnswer] = []
        queue = self._in_order
        while queue and (queue[0].lost or not queue[0].missing):
            entry = queue.popleft()
            if entry.lost:
                self._count_lost()
                self._after_gap = True
                continue
            late = entry.received_s - entry.sent_s > self._late_s
            entry.contested = entry.contested or self._after_gap or late
            entry.counted = not self._in_doubt
            said = place(entry)
            if said is Place.CONTRADICTED:
                self._count_lost()
                self.undecided += 1
                self._after_gap = True
                continue
            if said is Place.BORNE_OUT:
                self._trust_until(entry.sent_s)
            elif said is Place.DOUBTFUL:
                self._doubts.add(entry.sent_s, entry.sent_s)
                self._out_of_time += 1
            self._count(entry, queue[0].sent_s if queue else math.inf)
            self._after_gap = said is Place.DOUBTFUL and not entry.counted
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
            undecided=self.undecided,
            doubtful=min(max(self._doubtful) + self._out_of_time, self.received),
            doubtful_s=self._doubts.spans(),
        )

    @property
    def _in_doubt(self) -> bool:
        """Return whether a SYNC may wrongly have been given up.

        While none may, the answers are as many as the SYNCs, and their order tells whose they are.
        """
        return any(given_up is not None for given_up in self._given_up)

    def _pair(self, stream: int, now_s: float) -> None:
        """Pair one stream's waiting answers with its open SYNCs, giving up the overdue ones."""
        open_, held = self._open[stream], self._held[stream]
        while held:
            answer = held[0]
            if not open_ or not answer.may_answer(open_[0]):
                held.popleft()
                self._count_unasked(stream, answer)
            elif len(open_) == 1 or self._pairs_fully(open_, held):
                held.popleft()
                self._book(stream, open_.popleft(), answer)
            elif before := self._usual_for(stream, answer, now_s):
                for _ in range(before):
                    self._give_up(stream)
            elif now_s - open_[0].sent_s > self._timeout_s:
                held.popleft()
                self._give_up(stream)
                self.undecided += 1
            else:
                return
        while open_ and now_s - open_[0].sent_s > self._timeout_s:
            self._give_up(stream)

    def _book(self, stream: int, entry: SyncedAnswer, answer: Held) -> None:
        """Book one answer under its SYNC, the oldest that was open."""
        open_ = self._open[stream]
        if open_ and answer.may_answer(open_[0]):
            entry.contested = True
        else:
            self.usual[stream].learn(answer.stamp_s - entry.sent_s)
        entry.answers[stream] = self._newest[stream] = answer.data
        entry.missing -= 1
        entry.received_s = max(entry.received_s, answer.stamp_s)

    def _usual_for(self, stream: int, answer: Held, now_s: float) -> int:
        """Return how many open SYNCs stand before the one that is usually answered by then.

        0 where the newest before the answer was sent at another time before it than usual, and
        before half a period has passed in which the others may catch up: a drive that comes late
        to its SYNCs answers them all at once.
        """
        open_ = self._open[stream]
        before = sum(1 for entry in open_ if answer.may_answer(entry)) - 1
        if before < 1:
            return 0
        period_s = open_[before].sent_s - open_[before - 1].sent_s
        if now_s - answer.stamp_s < 0.5 * period_s:
            return 0
        usual = self.usual[stream].holds(answer.stamp_s - open_[before].sent_s, period_s)
        return before if usual else 0

    def _give_up(self, stream: int) -> None:
        """Call the oldest open SYNC of a stream lost."""
        entry = self._open[stream].popleft()
        entry.lost = True
        if self._given_up[stream] is None:
            self._given_up[stream] = entry

    def _count_unasked(self, stream: int, answer: Held) -> None:
        """Count an answer too many: where a SYNC was given up before, that one was not lost."""
        self.unasked += 1
        again = answer.data == self._newest[stream]
        self.duplicates += again
        given_up = self._given_up[stream]
        if given_up is not None and not again:
            self._doubtful[stream] += answer.newest - given_up.number
            self._doubts.add(given_up.sent_s, answer.newest_sent_s)
            self._given_up[stream] = None

    def _trust_until(self, sent_s: float) -> None:
        """Doubt no more that the SYNCs given up before this one were lost."""
        for stream, given_up in enumerate(self._given_up):
            if given_up is not None and given_up.sent_s < sent_s:
                self._given_up[stream] = None

    def _count_lost(self) -> None:
        self.lost += 1
        self.consecutive_lost += 1
        self.most_in_a_row = max(self.most_in_a_row, self.consecutive_lost)

    @staticmethod
    def _pairs_fully(open_: deque[SyncedAnswer], held: deque[Held]) -> bool:
        """Return whether some prefix of the answers has exactly as many SYNCs sent before it."""
        asked = 0
        for number, answer in enumerate(held, start=1):
            while asked < len(open_) and answer.may_answer(open_[asked]):
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
