"""Which answer belongs to which SYNC: late, lost, shared over two streams, and conserved."""

from __future__ import annotations

import functools
import math
import random
from collections.abc import Collection, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.cia402.answers import Place, SyncedAnswer
from drivers.cia402.placing import Placing
from drivers.cia402.scaling import Scaling
from drivers.cia402.sync import SyncLedger
from drivers.ports import DriveState, Goal, Sample

PERIOD_S = 0.002
TIMEOUT_S = 0.02


def ledger(streams: int = 1) -> SyncLedger:
    return SyncLedger(streams, TIMEOUT_S)


def test_an_answer_belongs_to_its_sync() -> None:
    book = ledger()
    book.sent(1.0, Goal.ON)
    book.answered(0, 1.0005, b"a")
    (answer,) = book.settle(1.001)
    assert (answer.sent_s, answer.received_s, answer.goal) == (1.0, 1.0005, Goal.ON)
    assert answer.answers == [b"a"]
    assert book.account().received == 1


def test_a_late_answer_belongs_to_its_own_sync_and_is_counted_late() -> None:
    book = ledger()
    book.sent(0.000, Goal.ON)
    book.sent(0.002, Goal.ON)
    book.answered(0, 0.0025, b"first")
    assert book.settle(0.0025) == []  # late, or the second's: nobody can know yet
    book.answered(0, 0.0030, b"second")
    answers = book.settle(0.0030)
    assert [(a.sent_s, a.answers[0]) for a in answers] == [(0.0, b"first"), (0.002, b"second")]
    account = book.account()
    assert (account.late, account.lost) == (1, 0)


def test_after_a_loss_no_answer_is_booked_under_its_neighbours_time() -> None:
    book = ledger()
    got = []
    for k in range(50):
        now_s = k * PERIOD_S
        book.sent(now_s, Goal.ON)
        if k != 10:
            book.answered(0, now_s + 0.0003, bytes([k]))
        got += book.settle(now_s + 0.0004)
    got += book.settle(1.0)
    assert [(round(a.sent_s / PERIOD_S), a.answers[0][0]) for a in got] == [
        (k, k) for k in range(50) if k != 10
    ]
    account = book.account()
    assert (account.expected, account.received, account.lost, account.late) == (50, 49, 1, 0)


def test_silence_is_lost_after_the_timeout_and_not_before() -> None:
    book = ledger()
    for k in range(3):
        book.sent(k * PERIOD_S, Goal.OFF)
    book.settle(TIMEOUT_S)
    assert book.account().lost == 0
    book.settle(TIMEOUT_S + 2 * PERIOD_S + 1e-6)
    assert book.consecutive_lost == 3
    book.sent(0.1, Goal.OFF)
    book.answered(0, 0.1, b"")
    book.settle(0.1)
    assert book.consecutive_lost == 0


def test_an_answer_without_a_sync_is_counted_and_dropped() -> None:
    book = ledger()
    book.answered(0, 0.0, b"stray")
    assert book.settle(0.0) == []
    assert book.unasked == 1
    book.sent(0.1, Goal.OFF)
    book.answered(0, 0.05, b"older than the SYNC")
    assert book.settle(0.1) == []
    assert book.unasked == 2


def test_a_sample_needs_both_streams() -> None:
    book = ledger(streams=2)
    book.sent(0.0, Goal.ON)
    book.answered(0, 0.0004, b"one")
    assert book.settle(0.0005) == []
    book.answered(1, 0.0006, b"two")
    (answer,) = book.settle(0.0007)
    assert answer.answers == [b"one", b"two"]
    assert answer.received_s == 0.0006


def test_a_sync_with_one_of_two_answers_is_lost() -> None:
    book = ledger(streams=2)
    for k in range(3):
        book.sent(k * PERIOD_S, Goal.ON)
        book.answered(0, k * PERIOD_S, bytes([k]))
        if k != 1:
            book.answered(1, k * PERIOD_S, bytes([k]))
    got = book.settle(0.005) + book.settle(1.0)
    assert [a.answers for a in got] == [[b"\x00", b"\x00"], [b"\x02", b"\x02"]]
    assert book.account().lost == 1


def test_the_same_answer_again_is_a_duplicate_and_another_one_is_not() -> None:
    book = ledger()
    for k in range(3):
        book.sent(k * PERIOD_S, Goal.ON)
        book.answered(0, k * PERIOD_S + 0.0003, bytes([k]))
        if k == 1:
            book.answered(0, k * PERIOD_S + 0.0004, bytes([k]))
            book.answered(0, k * PERIOD_S + 0.0005, b"stray")
        book.settle(k * PERIOD_S + 0.001)
    account = book.account()
    assert (account.received, account.duplicates, account.unmatched) == (3, 1, 1)


def test_what_was_never_asked_for_is_not_lost() -> None:
    book = SyncLedger(1, TIMEOUT_S, PERIOD_S)
    at_s = 0.0
    for gap_s in [PERIOD_S] * 10 + [7.2 * PERIOD_S] + [1.4 * PERIOD_S, 0.6 * PERIOD_S] * 5:
        book.sent(at_s, Goal.ON)
        book.answered(0, at_s + 0.0003, b"")
        book.settle(at_s + 0.0004)
        at_s += gap_s
    account = book.account()
    assert (account.expected, account.received, account.lost) == (21, 21, 0)
    assert account.not_asked == 6
    assert account.longest_gap_s == pytest.approx(7.2 * PERIOD_S)


def test_a_sync_is_not_lost_before_anybody_has_listened_for_its_answer() -> None:
    book = ledger()
    book.sent(0.0, Goal.ON)
    assert book.settle(0.001) == []  # the computer stood still; it has listened so far and no more
    book.answered(0, 0.0003, b"a")
    (answer,) = book.settle(1.0)
    assert answer.answers == [b"a"]
    assert book.account().lost == 0


def test_jitter_is_the_standard_deviation_of_the_delay() -> None:
    book = ledger()
    for k, delay_s in enumerate((0.0001, 0.0003)):
        book.sent(k * PERIOD_S, Goal.ON)
        book.answered(0, k * PERIOD_S + delay_s, b"")
        book.settle(k * PERIOD_S + delay_s)
    assert book.account().jitter_s == pytest.approx(0.0001 * 2**0.5)


def test_after_a_loss_an_answer_at_its_usual_time_is_booked_by_the_next_tick() -> None:
    book = ledger()
    for k in range(5):
        book.sent(k * PERIOD_S, Goal.ON)
        if k not in (2, 3):
            book.answered(0, k * PERIOD_S + 0.0003, bytes([k]))
        got = book.settle((k + 1) * PERIOD_S)
    assert [(round(a.sent_s / PERIOD_S), a.answers[0][0]) for a in got] == [(4, 4)]
    assert book.account().lost == 2
    assert (book.consecutive_lost, book.most_in_a_row) == (0, 2)


@given(
    stalls_ms=st.lists(st.floats(0.1, 15.0), min_size=20, max_size=20),
    heard_after=st.floats(0.0, 1.0),
)
def test_a_drive_that_comes_late_and_answers_all_at_once_has_lost_nothing(
    stalls_ms: list[float], heard_after: float
) -> None:
    """Wherever its newest SYNC stands, and whichever of the answers is heard first."""
    link = _Link(0.0)
    awake_s = 0.0
    for k in range(400):
        now_s = k * PERIOD_S
        if k % 20 == 10:
            awake_s = now_s + 1e-3 * stalls_ms[k // 20]
        link.hear(now_s)
        link.book.sent(now_s, Goal.ON)
        link.arrived_s = max(link.arrived_s + 0.0001, now_s + 0.0003, awake_s)
        link.in_flight.append((link.arrived_s, k.to_bytes(2, "little")))
        link.hear(now_s + heard_after * PERIOD_S)
    link.hear(1.0 + link.arrived_s)
    account = link.book.account()
    assert (account.received, account.lost, account.unmatched) == (400, 0, 0)
    assert not link.misplaced_s


def test_an_answer_that_came_before_a_sync_was_sent_is_not_its() -> None:
    """Even where both carry the same stamp: a stepped clock stands still between them."""
    book = ledger()
    for k in range(3):
        book.sent(k * PERIOD_S, Goal.ON)
        book.answered(0, k * PERIOD_S, bytes([k]))
        book.settle(k * PERIOD_S)
    book.sent(3 * PERIOD_S, Goal.ON)
    book.sent(4 * PERIOD_S, Goal.ON)
    book.answered(0, 5 * PERIOD_S, b"3, late by two periods")
    book.sent(5 * PERIOD_S, Goal.ON)
    assert book.settle(5 * PERIOD_S) == []


class _Link:
    """A drive whose every position says which SYNC it answers, behind a link with a delay."""

    def __init__(self, speed_rad_s: float) -> None:
        self.book = SyncLedger(1, TIMEOUT_S, PERIOD_S)
        self.placing = Placing(PERIOD_S, Scaling(65536, 1.0))
        self.speed_rad_s = speed_rad_s
        self.in_flight: list[tuple[float, bytes]] = []
        self.misplaced_s: list[float] = []
        self.rows = 0
        self.arrived_s = 0.0

    def place(self, answer: SyncedAnswer) -> Place:
        k = int.from_bytes(answer.answers[0], "little")
        at_rad = k * PERIOD_S * self.speed_rad_s
        sample = Sample(
            answer.sent_s, 0.0, at_rad, self.speed_rad_s, 0.0, math.nan, DriveState.ON, False
        )
        place = self.placing.judge(sample) if answer.contested else Place.UNKNOWN
        if place is Place.CONTRADICTED and answer.counted:
            place = Place.DOUBTFUL
        if place is not Place.CONTRADICTED:
            self.rows += 1
            if k != round(answer.sent_s / PERIOD_S):
                self.misplaced_s.append(answer.sent_s)
        if place not in (Place.CONTRADICTED, Place.DOUBTFUL):
            self.placing.keep(sample)
        return place

    @property
    def misplaced(self) -> int:
        """Return how many rows are in another's place and in no doubtful interval."""
        spans = self.book.account().doubtful_s or ()
        return sum(not any(a <= at_s <= b for a, b in spans) for at_s in self.misplaced_s)

    def hear(self, until_s: float) -> None:
        while self.in_flight and self.in_flight[0][0] <= until_s:
            self.book.answered(0, *self.in_flight.pop(0))
        self.book.settle(until_s, self.place)

    def run(self, delays_s: Sequence[float], lost: Collection[int] = ()) -> None:
        """Send a SYNC a period; answer it after its delay, never before the one before it."""
        for k, delay_s in enumerate(delays_s):
            now_s = k * PERIOD_S
            self.hear(now_s)
            self.book.sent(now_s, Goal.ON)
            self.arrived_s = max(self.arrived_s, now_s + delay_s)
            if k not in lost:
                self.in_flight.append((self.arrived_s, k.to_bytes(2, "little")))
        for _ in range(3):
            self.hear(self.arrived_s + TIMEOUT_S)
            self.arrived_s += TIMEOUT_S


@given(
    late_s=st.floats(0.2, 8.0).map(lambda periods: periods * PERIOD_S)
    | st.integers(1, 8).map(lambda periods: 0.0003 + periods * PERIOD_S),
    begins=st.integers(20, 60),
    lasts=st.integers(1, 100),
    lost=st.sets(st.integers(15, 150), max_size=4),
)
def test_of_a_joint_that_moves_no_row_is_ever_misplaced(
    late_s: float, begins: int, lasts: int, lost: set[int]
) -> None:
    link = _Link(50.0)
    delays_s = [late_s if begins <= k < begins + lasts else 0.0003 for k in range(200)]
    link.run(delays_s, lost)
    account = link.book.account()
    assert link.misplaced == 0
    assert (account.expected, account.received) == (200, link.rows)
    assert account.received + account.lost == 200


@given(periods=st.integers(1, 8), begins=st.integers(20, 60), lasts=st.integers(1, 100))
def test_at_standstill_rows_late_by_whole_periods_are_called_doubtful(
    periods: int, begins: int, lasts: int
) -> None:
    link = _Link(0.0)
    late_s = 0.0003 + periods * PERIOD_S
    link.run([late_s if begins <= k < begins + lasts else 0.0003 for k in range(200)])
    assert link.misplaced == 0
    assert link.book.account().doubtful >= len(link.misplaced_s)


def _says(place: Place, _answer: SyncedAnswer) -> Place:
    return place


def test_what_the_drive_measured_late_is_taken_and_called_doubtful() -> None:
    """A gateway that holds a SYNC up: the answer is its own, and shows where the joint is by then.

    One that is late on its way back shows where it was in time, and nothing is wrong with it.
    """

    def sample(sent_s: float, received_s: float, measured_s: float) -> Sample:
        return Sample(
            sent_s, received_s, 50.0 * measured_s, 50.0, 0.0, math.nan, DriveState.ON, False
        )

    for measured_late_s, place in ((0.02, Place.DOUBTFUL), (0.0, Place.BORNE_OUT)):
        placing, book = Placing(PERIOD_S, Scaling(65536, 1.0)), ledger()
        placing.keep(sample(0.0, 0.0003, 0.0003))
        sent_s, received_s = PERIOD_S, PERIOD_S + 0.0203
        assert placing.judge(sample(sent_s, received_s, sent_s + measured_late_s)) is place
        book.sent(sent_s, Goal.ON)
        book.answered(0, received_s, b"")
        assert len(book.settle(received_s, functools.partial(_says, place))) == 1
        account = book.account()
        assert (account.received, account.doubtful) == (1, place is Place.DOUBTFUL)
        assert account.doubtful_s == (((sent_s, sent_s),) if place is Place.DOUBTFUL else ())


@given(seed=st.integers(0, 10_000), streams=st.integers(1, 2))
def test_nothing_is_invented_and_nothing_disappears(seed: int, streams: int) -> None:
    chance = random.Random(seed)
    book = ledger(streams)
    in_flight: list[tuple[float, int, bytes]] = []
    got: list[tuple[int, int]] = []
    for k in range(200):
        now_s = k * PERIOD_S
        for arrival_s, stream, data in [x for x in in_flight if x[0] <= now_s]:
            book.answered(stream, arrival_s, data)
        in_flight = [x for x in in_flight if x[0] > now_s]
        got += [(round(a.sent_s / PERIOD_S), a.answers[0][0]) for a in book.settle(now_s)]
        book.sent(now_s, Goal.ON)
        delay_s = chance.choice([0.0003, 0.0015, 0.0019])
        in_flight += [
            (now_s + delay_s, s, bytes([k])) for s in range(streams) if chance.random() > 0.02
        ]
    got += [(round(a.sent_s / PERIOD_S), a.answers[0][0]) for a in book.settle(10.0)]
    account = book.account()
    assert account.expected == 200
    assert account.received + account.lost == 200
    assert len(got) == account.received
    assert all(sync == told for sync, told in got)
