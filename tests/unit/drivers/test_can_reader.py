"""The reader process: order, stamps, drops, a full ring; and that neither side outlives the other.

Natively, without a CAN bus: UDP datagrams on the loopback, shaped like `struct can_frame`, pass
the same kernel code for stamps, drop counter and `recvmmsg`. `tests/bus` has a real one.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import can
import pytest

from drivers.can import reader_process
from drivers.can.frames import CanBusConfig, Inbox
from drivers.can.opening import may_read_fast
from drivers.can.owner import CanBusOwner
from drivers.can.reader_process import ReaderProcess
from drivers.can_reader import batches
from drivers.can_reader.batches import BATCH, RENEW, BatchReceiver, available, prepare
from drivers.can_reader.reader import BUSY_NAP_S, drain, read_until_let_go
from drivers.can_reader.ring import SLOT, SLOT_BYTES, FrameRing, Moment, Word, drops_in
from drivers.clock import MonotonicClock, SteppedClock
from drivers.errors import BusOverflowError, WorkerDiedError

pytestmark = pytest.mark.skipif(not available(), reason="the reader process needs 64-bit Linux")

REPOSITORY = Path(__file__).resolve().parents[3]
CLOCK = MonotonicClock()
PATIENCE_S = 60.0  # a bound for what must come; nobody waits for it to pass
_FRAME = struct.Struct("<IB3x8s")
_CHANNELS = itertools.count()
BURST = 400
"""So many frames fit into a socket whose buffer nobody may force (`net.core.rmem_max`)."""


class Line:
    """Two ends of a loopback connection: one says frames, the other is to be read."""

    def __init__(self) -> None:
        self.receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.receiver.bind(("127.0.0.1", 0))
        self.sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sender.connect(self.receiver.getsockname())

    def say(self, number: int, can_id: int = 0x185, length: int = 8) -> None:
        self.sender.send(_FRAME.pack(can_id, length, number.to_bytes(8, "little")))

    def close(self) -> None:
        self.receiver.close()
        self.sender.close()


@pytest.fixture
def line() -> Iterator[Line]:
    made = Line()
    yield made
    made.close()


@pytest.fixture
def owner(line: Line) -> Iterator[CanBusOwner]:
    bus = can.Bus(interface="virtual", channel=f"reader-{next(_CHANNELS)}", ignore_config=True)
    made = CanBusOwner(
        bus, CLOCK, "loopback", ReaderProcess.start(line.receiver, CLOCK, "loopback")
    )
    yield made
    made.close()


def reader_of(owner: CanBusOwner) -> ReaderProcess:
    assert owner._reader is not None
    return owner._reader


def numbers(inbox: Inbox) -> list[int]:
    return [int.from_bytes(frame.data, "little") for frame in inbox.frames]


def poll_until(owner: CanBusOwner, came: Callable[[], bool]) -> None:
    """Poll until it came."""
    deadline_s = CLOCK.now() + PATIENCE_S
    while not came():
        assert CLOCK.now() < deadline_s, f"there is no more than {owner.counts}"
        CLOCK.sleep_until(CLOCK.now() + 0.001)
        owner.poll()


def collect(owner: CanBusOwner, inbox: Inbox, count: int) -> None:
    """Poll until so many frames are there."""
    poll_until(owner, lambda: len(inbox.frames) >= count)


def check_until_it_raises(
    reader: ReaderProcess, meanwhile: Callable[[], None] = lambda: None
) -> None:
    deadline_s = CLOCK.now() + PATIENCE_S
    while CLOCK.now() < deadline_s:
        reader.check()
        meanwhile()
        CLOCK.sleep_until(CLOCK.now() + 0.0002)


def test_every_frame_comes_once_in_order_with_the_kernels_stamp(
    owner: CanBusOwner, line: Line
) -> None:
    inbox = owner.subscribe((0x185,), limit=10_000)
    sent_s = []
    for number in range(3000):  # several laps of a batch, and of what is made ready at a time
        if number % BURST == 0:
            collect(owner, inbox, number)
        sent_s.append(CLOCK.now())
        line.say(number)
    collect(owner, inbox, 3000)
    last_s = CLOCK.now()
    assert numbers(inbox) == list(range(3000))
    stamps_s = [frame.stamp_s for frame in inbox.frames]
    assert all(a <= b for a, b in itertools.pairwise(stamps_s))
    # the kernel stamps within the call that sends; two clocks are read within microseconds
    bounds = zip(sent_s, stamps_s, [*sent_s[1:], last_s], strict=True)
    assert sum(not a - 2e-4 <= stamp_s <= b + 2e-4 for a, stamp_s, b in bounds) == 0
    assert owner.counts.restamped == 0
    assert owner.reception().dropped_by_kernel == 0
    assert owner.reception().reader == "process"


def test_waiting_takes_what_comes_and_ends_at_the_deadline(owner: CanBusOwner, line: Line) -> None:
    inbox = owner.subscribe((0x185,))
    assert not owner.wait(inbox, CLOCK.now() + 0.02)
    line.say(7)
    assert owner.wait(inbox, CLOCK.now() + PATIENCE_S)
    assert numbers(inbox) == [7]


def test_what_is_no_data_frame_is_counted_by_its_kind(owner: CanBusOwner, line: Line) -> None:
    inbox = owner.subscribe((0x185,))
    for can_id in (1 << 31 | 0x185, 1 << 30 | 0x185, 1 << 29, 0x111):
        line.say(0, can_id)
    line.say(0, length=9)
    line.say(1, length=2)
    collect(owner, inbox, 1)
    counts = owner.counts
    assert (counts.extended, counts.remote_frames, counts.error_frames) == (1, 1, 1)
    assert (counts.unrouted, counts.malformed, counts.routed) == (1, 1, 1)
    assert inbox.frames[0].data == b"\x01\x00"


def test_silence_is_known_up_to_a_time_that_follows_the_clock(
    owner: CanBusOwner, line: Line
) -> None:
    inbox = owner.subscribe((0x185,), limit=100_000)
    for number in range(300):
        line.say(number)
        said_s, heard_s = CLOCK.now(), owner.heard_until_s
        owner.poll()
        assert heard_s <= CLOCK.now()
        assert heard_s < said_s or numbers(inbox)[-1] >= number
    deadline_s = CLOCK.now() + PATIENCE_S
    asked_s = CLOCK.now()
    while owner.heard_until_s < asked_s:
        assert CLOCK.now() < deadline_s
        CLOCK.sleep_until(CLOCK.now() + 0.001)


def test_a_killed_reader_is_told_within_ten_milliseconds_and_a_check(owner: CanBusOwner) -> None:
    owner.check()
    process = reader_of(owner).process
    process.kill()
    process.wait()
    with contextlib.suppress(WorkerDiedError):
        owner.check()  # it may have given a last sign of life after the check before
    CLOCK.sleep_until(CLOCK.now() + 0.01)
    with pytest.raises(WorkerDiedError, match="loopback has ended"):
        owner.check()


def test_a_tick_asks_the_kernel_for_the_reader_only_when_its_signs_of_life_stay_away(
    owner: CanBusOwner, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader, clock = reader_of(owner), SteppedClock(CLOCK.now() + 1000.0)
    signs_s, asked_s = {Moment.ALIVE: 0.0}, []
    monkeypatch.setattr(reader, "_clock", clock)
    monkeypatch.setattr(reader._ring, "moment_s", signs_s.__getitem__)
    monkeypatch.setattr(reader.process, "poll", lambda: asked_s.append(clock.now()))
    for tick in range(500):  # of 2 ms, on a bus so busy that the reader looks every 5 ms
        if 2 * tick % 5 < 2:
            signs_s[Moment.ALIVE] = clock.now()
        owner.check()
        clock.sleep_until(clock.now() + 0.002)
    assert not asked_s
    for _ in range(6):  # from here on it says nothing more
        owner.check()
        clock.sleep_until(clock.now() + 0.002)
    assert asked_s[0] - signs_s[Moment.ALIVE] < 0.013
    monkeypatch.undo()


class CountedClock(SteppedClock):
    """Simulated time that counts what each reading and each nap would ask of the kernel."""

    def __init__(self) -> None:
        super().__init__(100.0)
        self.readings = self.naps = 0

    def now(self) -> float:
        self.readings += 1
        self.settle()
        return super().now()

    def sleep_until(self, deadline_s: float) -> None:
        self.naps += 1
        super().sleep_until(deadline_s)


def test_on_a_busy_bus_a_batch_costs_a_nap_and_a_call(line: Line) -> None:
    ring, memory = FrameRing.make(16 * RENEW)
    held, lifeline = os.pipe()
    clock = CountedClock()
    said, heard_s = itertools.count(), [0.0]

    def seven_a_millisecond(now_s: float) -> None:
        heard_s.append(ring.moment_s(Moment.HEARD_UNTIL))
        assert heard_s[-2] <= heard_s[-1] <= now_s  # never more is claimed than was heard
        assert now_s - heard_s[-1] <= BUSY_NAP_S + 1e-9 or len(heard_s) == 2
        if next(said) == 200:
            os.close(lifeline)
        for number in range(35):
            line.say(number)

    clock.attach(seven_a_millisecond)
    read_until_let_go(line.receiver.fileno(), ring, held, clock)
    assert clock.readings <= 23  # with each look at the owner, not with each batch
    assert 180 < clock.naps <= 200
    assert ring.word(Word.HEAD) == 35 * (clock.naps + clock.readings)
    os.close(held)
    os.close(memory)
    ring.close()


def test_what_is_said_to_others_is_counted_and_is_ours_to_claim_later(
    owner: CanBusOwner, line: Line
) -> None:
    inbox = owner.subscribe((0x185,))
    for number in range(30):  # an answer to us, to others, and twice a heartbeat of somebody's
        for cob_id in (0x185, 0x181, 0x77F, 0x77F):
            line.say(number, cob_id)
    line.say(0, 0x181, length=9)
    poll_until(owner, lambda: owner.counts.malformed == 1)  # what was said last
    assert numbers(inbox) == list(range(30))
    assert (owner.counts.routed, owner.counts.unrouted) == (30, 90)
    owner.claims.claim((0x77F,))
    assert (owner.claims.intruded(), owner.claims.broken()) == (0x77F, 60)
    owner.claims.sent(0x77F)  # ours from now on, and what was heard before still is not
    line.say(0, 0x77F)
    line.say(30)
    collect(owner, inbox, 31)
    assert (owner.claims.broken(), owner.counts.own_echoes) == (61, 1)
    assert owner.counts.malformed == 1


def test_a_stopped_reader_is_noticed_and_does_not_outlive_its_owner(
    owner: CanBusOwner, monkeypatch: pytest.MonkeyPatch
) -> None:
    process = reader_of(owner).process
    process.send_signal(signal.SIGSTOP)
    begun_s = CLOCK.now()
    with pytest.raises(WorkerDiedError, match="no sign of life"):
        check_until_it_raises(reader_of(owner))
    assert CLOCK.now() - begun_s > 0.1  # counted from its last sign of life
    monkeypatch.setattr(reader_process, "_END_S", 0.05)
    owner.close()
    assert process.returncode == -signal.SIGKILL


def test_after_a_death_the_owner_can_still_receive_to_see_the_joint_stop(
    owner: CanBusOwner, line: Line
) -> None:
    inbox = owner.subscribe((0x185,))
    owner.receive_without_help()  # the reader lives: nothing changes
    line.say(1)
    collect(owner, inbox, 1)
    reader_of(owner).process.kill()
    reader_of(owner).process.wait()
    owner.receive_without_help()
    owner.check()
    channel = owner._bus.channel_info.rpartition(" ")[2]
    with can.Bus(interface="virtual", channel=channel, ignore_config=True) as other:
        before_s = CLOCK.now()
        other.send(can.Message(arbitration_id=0x185, data=b"\x02", is_extended_id=False))
        assert owner.wait(inbox, before_s + PATIENCE_S)
        collect(owner, inbox, 2)
    assert numbers(inbox) == [1, 2]
    assert before_s <= inbox.frames[-1].stamp_s <= CLOCK.now()
    assert owner.reception().reader == "process"


def test_a_socket_that_fails_gives_its_reason(line: Line) -> None:
    reader = ReaderProcess.start(line.receiver, CLOCK, "loopback")
    line.sender.close()  # a port that refuses answers makes the connected receiver fail
    refusing = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    refusing.bind(("127.0.0.1", 0))
    line.receiver.connect(refusing.getsockname())
    refusing.close()
    line.receiver.send(b"anybody?")
    reader.process.wait(PATIENCE_S)
    with pytest.raises(WorkerDiedError, match="refused"):
        check_until_it_raises(reader)
    reader.close()


CHILD = """
import socket, sys
from drivers.can.reader_process import ReaderProcess
from drivers.clock import MonotonicClock
receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
receiver.bind(("127.0.0.1", 0))
reader = ReaderProcess.start(receiver, MonotonicClock(), "loopback")
print(reader.process.pid, flush=True)
MonotonicClock().sleep_until(MonotonicClock().now() + 60.0)
"""


@pytest.mark.parametrize("state", ["reading", "stopped"])
def test_a_killed_owner_leaves_no_reader(state: str) -> None:
    command = [sys.executable, "-c", CHILD]
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=REPOSITORY) as child:
        assert child.stdout is not None
        pid = int(child.stdout.readline())
        if state == "stopped":
            os.kill(pid, signal.SIGSTOP)
        child.kill()
    deadline_s = CLOCK.now() + PATIENCE_S
    while _lives(pid):
        assert CLOCK.now() < deadline_s, "the reader is still there"
        CLOCK.sleep_until(CLOCK.now() + 0.005)


def _lives(pid: int) -> bool:
    """Tell whether a process is there and not merely waiting for somebody to read its exit code."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


class Hand:
    """Reads by hand what a reader process would read by itself: no time, no second process."""

    def __init__(self, line: Line, capacity: int = 2 * RENEW, buffer_bytes: int = 1 << 20) -> None:
        self._line = line
        prepare(line.receiver, buffer_bytes)
        self.ring, descriptor = FrameRing.make(capacity)
        os.close(descriptor)
        self.receiver = BatchReceiver(line.receiver.fileno(), self.ring)

    def drain(self) -> int:
        return drain(self.receiver, self.ring, CLOCK, CLOCK.now())

    def fetch(self, numbers: Iterable[int]) -> int:
        """Say frames and read them, `BURST` at a time; return how many were read."""
        waiting = iter(numbers)
        read = 0
        while burst := list(itertools.islice(waiting, BURST)):
            for number in burst:
                self._line.say(number)
            read += self.drain()
        return read

    def taken(self) -> list[int]:
        return [int.from_bytes(data, "little") for *_, data in SLOT.iter_unpack(self.slots())]

    def slots(self) -> bytes:
        """Take a copy of everything that waits."""
        slots = b"".join(self.ring.waiting())
        self.ring.give_back(len(slots) // SLOT_BYTES)
        return slots

    def close(self) -> None:
        del self.receiver  # it points into the memory
        self.ring.close()


def test_the_ring_goes_round_and_keeps_order(line: Line) -> None:
    hand = Hand(line)
    said = itertools.count()
    for count in [1, BATCH - 1, BATCH, BATCH + 1, RENEW - 3, 7] * 5:
        expected = [next(said) for _ in range(count)]
        assert hand.fetch(expected) == count
        assert hand.taken() == expected
    assert next(said) > 2 * hand.ring.capacity
    hand.close()


def test_a_full_ring_leaves_the_rest_in_the_socket_and_says_so(line: Line) -> None:
    hand = Hand(line)
    assert hand.fetch(range(2 * RENEW - 5)) == 2 * RENEW - 5
    for number in range(2 * RENEW - 5, 2 * RENEW + 5):
        line.say(number)
    begun_s = CLOCK.now()
    assert hand.drain() == 5
    assert hand.ring.word(Word.FULL) == 1
    assert hand.ring.moment_s(Moment.HEARD_UNTIL) < begun_s  # not all that came is in the ring
    assert hand.taken() == list(range(2 * RENEW))
    assert hand.drain() == 5
    assert hand.taken() == list(range(2 * RENEW, 2 * RENEW + 5))
    hand.close()


def test_a_full_ring_is_an_error_that_lasts(line: Line) -> None:
    reader = ReaderProcess.start(line.receiver, CLOCK, "loopback", capacity=RENEW)
    with pytest.raises(BusOverflowError, match="more than 1024 waited"):
        check_until_it_raises(reader, lambda: line.say(1))
    reader.hand_over(lambda *_: None)
    with pytest.raises(BusOverflowError):
        reader.check()
    reader.close()


def test_the_kernel_counts_every_frame_that_it_drops(line: Line) -> None:
    hand = Hand(line, buffer_bytes=4096)
    total = 500
    for number in range(total):
        line.say(number)
    hand.drain()
    kept = hand.taken()
    assert 0 < len(kept) < total
    line.say(total)  # the counter travels with a frame: this one brings it
    hand.drain()
    slots = hand.slots()
    assert drops_in(slots) == total - len(kept)
    hand.close()


def test_a_stamp_of_an_old_lap_cannot_pass_for_a_new_one(line: Line) -> None:
    hand = Hand(line)
    stamps_ns: list[int] = []
    # The kernel begins to stamp a moment after it was asked to: before that, frames have the time
    # at which they are taken, and one that it has stamped already would be older.
    taken_ns = sent_ns = 0
    while taken_ns >= sent_ns:
        line.say(0)
        sent_ns = time.clock_gettime_ns(time.CLOCK_REALTIME)
        hand.drain()
        ((seconds, rest, *_),) = SLOT.iter_unpack(hand.slots())
        taken_ns = seconds * 10**9 + rest
    for _ in range(5):
        assert hand.fetch(range(RENEW)) == RENEW
        slots = SLOT.iter_unpack(hand.slots())
        stamps_ns += [seconds * 10**9 + rest for seconds, rest, *_ in slots]
    line.receiver.setsockopt(socket.SOL_SOCKET, batches.SO_TIMESTAMPNS, 0)
    line.say(0)
    hand.drain()
    ((seconds, rest, *_),) = SLOT.iter_unpack(hand.slots())
    assert stamps_ns == sorted(stamps_ns)
    assert (seconds, rest) == (0, 0)  # this slot's first lap had a stamp
    hand.close()


@pytest.mark.parametrize(
    ("config", "fast"),
    [
        (CanBusConfig("socketcan", "can0"), True),
        (CanBusConfig("socketcan", "can0", fast_reader=False), False),
        (CanBusConfig("socketcan", "can0", options={"fd": True}), False),
        (CanBusConfig("slcan", "/dev/ttyACM0"), False),
    ],
)
def test_who_may_receive(config: CanBusConfig, fast: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    assert may_read_fast(config, MonotonicClock()) is fast
    assert not may_read_fast(config, SteppedClock())
    monkeypatch.setattr(batches, "available", lambda: False)  # Windows, macOS
    assert not may_read_fast(config, MonotonicClock())
