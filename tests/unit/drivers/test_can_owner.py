"""The owner of a bus: routes, stamps, counts, refuses, overflows, dies and closes in the open."""

from __future__ import annotations

import contextlib
import errno
import itertools
import socket
import sys
from collections.abc import Iterator

import can
import pytest

import fakes.process
from drivers.can.failures import opening_failed, working_failed
from drivers.can.opening import open_bus
from drivers.can.owner import CanBusConfig, CanBusOwner
from drivers.clock import Clock, MonotonicClock, SteppedClock
from drivers.errors import BusError, BusOverflowError, WorkerDiedError

_CHANNELS = itertools.count()
PATIENCE_S = 60.0  # a bound for what must come; nobody waits for it to pass


class Bench:
    """An owner and, on the same virtual bus, somebody else."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        channel = f"owner-{next(_CHANNELS)}"
        self.other = can.Bus(interface="virtual", channel=channel, ignore_config=True)
        self.owner = CanBusOwner.open(CanBusConfig("virtual", channel), clock)

    def say(self, cob_id: int, data: bytes = b"", *, extended: bool = False) -> None:
        self.other.send(can.Message(arbitration_id=cob_id, data=data, is_extended_id=extended))

    def close(self) -> None:
        self.owner.close()
        self.other.shutdown()


@pytest.fixture(params=["stepped", "real time"])
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    made = Bench(SteppedClock() if request.param == "stepped" else MonotonicClock())
    yield made
    made.close()


@pytest.fixture
def stepped() -> Iterator[Bench]:
    made = Bench(SteppedClock())
    yield made
    made.close()


@pytest.fixture
def real_time() -> Iterator[Bench]:
    made = Bench(MonotonicClock())
    yield made
    made.close()


def test_a_frame_reaches_the_inbox_that_asked_for_it_with_both_stamps(bench: Bench) -> None:
    inbox = bench.owner.subscribe((0x185,))
    other = bench.owner.subscribe((0x285,))
    before_s = bench.clock.now()
    bench.say(0x185, b"\x01\x02")
    assert bench.owner.wait(inbox, before_s + PATIENCE_S)
    frame = inbox.frames.popleft()
    assert (frame.cob_id, frame.data) == (0x185, b"\x01\x02")
    assert before_s <= frame.stamp_s <= bench.clock.now()
    assert frame.bus_stamp_s > 1e9  # the virtual bus stamps with wall time: kept, never used
    assert not other.frames


def test_waiting_ends_at_the_deadline(bench: Bench) -> None:
    inbox = bench.owner.subscribe((0x185,))
    deadline_s = bench.clock.now() + 0.02
    assert not bench.owner.wait(inbox, deadline_s)
    assert deadline_s <= bench.clock.now() < deadline_s + PATIENCE_S


def test_silence_is_known_up_to_a_time_that_follows_the_clock(bench: Bench) -> None:
    inbox = bench.owner.subscribe((0x185,))
    asked_s = bench.clock.now()
    deadline_s = asked_s + PATIENCE_S
    while bench.owner.heard_until_s < asked_s + 0.05:
        assert bench.clock.now() < deadline_s
        bench.clock.sleep_until(bench.clock.now() + 0.005)
    assert bench.owner.heard_until_s <= bench.clock.now()
    for number in range(50):
        bench.say(0x185, bytes([number]))
        said_s, heard_s = bench.clock.now(), bench.owner.heard_until_s
        bench.owner.poll()
        assert heard_s <= said_s or inbox.frames[-1].data == bytes([number])


def test_what_we_send_has_an_eleven_bit_id(bench: Bench) -> None:
    bench.owner.send(0x205, b"\x0f\x00")
    message = bench.other.recv(1.0)
    assert message is not None
    assert (message.arbitration_id, bytes(message.data)) == (0x205, b"\x0f\x00")
    assert not message.is_extended_id


def test_what_nobody_asked_for_is_counted_by_its_kind(stepped: Bench) -> None:
    stepped.say(0x185)
    stepped.say(0x185, extended=True)
    stepped.other.send(
        can.Message(arbitration_id=0x185, is_remote_frame=True, is_extended_id=False)
    )
    stepped.other.send(can.Message(is_error_frame=True, is_extended_id=False))
    stepped.owner.post(0x080, b"")
    stepped.say(0x080)  # as udp_multicast hands our own SYNC back
    stepped.owner.poll()
    counts = stepped.owner.counts
    assert (counts.unrouted, counts.extended, counts.remote_frames) == (1, 1, 1)
    assert (counts.error_frames, counts.own_echoes, counts.routed) == (1, 1, 0)


def test_two_readers_cannot_share_an_identifier(stepped: Bench) -> None:
    first = stepped.owner.subscribe((0x185, 0x285))
    with pytest.raises(BusError, match="0x285"):
        stepped.owner.subscribe((0x285, 0x385))
    stepped.owner.unsubscribe(first)
    stepped.owner.unsubscribe(first)
    stepped.owner.subscribe((0x285,))


def test_overflow_is_an_error_that_lasts_and_spares_what_was_there(stepped: Bench) -> None:
    inbox = stepped.owner.subscribe((0x185,), limit=3)
    for k in range(5):
        stepped.say(0x185, bytes([k]))
    stepped.owner.poll()
    assert [frame.data[0] for frame in inbox.frames] == [0, 1, 2]
    inbox.frames.clear()
    for _ in range(2):
        with pytest.raises(BusOverflowError, match="2 are lost"):
            stepped.owner.check()


def test_stepped_devices_settle_after_a_send_and_before_a_poll() -> None:
    clock = SteppedClock()
    bench = Bench(clock)

    def echo(_now_s: float) -> None:
        while (message := bench.other.recv(0.0)) is not None:
            bench.say(0x185, bytes(message.data))

    clock.attach(echo)
    inbox = bench.owner.subscribe((0x185,))
    bench.owner.post(0x205, b"a")
    assert not inbox.frames
    bench.owner.poll()
    bench.owner.send(0x205, b"b")
    assert [frame.data for frame in inbox.frames] == [b"a", b"b"]
    bench.close()


def test_a_dead_owner_thread_is_told_at_the_next_check(
    real_time: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_timeout: float | None = None) -> None:
        raise can.CanOperationError("cable fell out")

    real_time.owner.check()
    inbox = real_time.owner.subscribe((0x185,))
    monkeypatch.setattr(real_time.owner._bus, "recv", broken)
    real_time.say(0x111)  # wakes the thread from its present wait
    thread = real_time.owner._thread
    assert thread is not None
    thread.join(PATIENCE_S)
    with pytest.raises(WorkerDiedError, match="cable fell out"):
        real_time.owner.check()
    with pytest.raises(WorkerDiedError):
        real_time.owner.wait(inbox, real_time.clock.now() + PATIENCE_S)


def test_closing_twice_is_closing_once_and_nothing_is_sent_afterwards(bench: Bench) -> None:
    bench.owner.close()
    bench.owner.close()
    bench.owner.check()
    with pytest.raises(BusError, match="closed"):
        bench.owner.send(0x080, b"")


def test_a_send_that_fails_is_one_clear_error(
    stepped: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_message: can.Message) -> None:
        raise can.CanOperationError("Failed to transmit", error_code=errno.ENOBUFS)

    monkeypatch.setattr(stepped.owner._bus, "send", full)
    with pytest.raises(BusError, match="nobody acknowledges"):
        stepped.owner.send(0x205, b"")
    monkeypatch.undo()


@pytest.mark.parametrize(
    ("config", "words"),
    [
        (CanBusConfig("no-such-adapter", "can0"), "not available here"),
        (CanBusConfig("udp_multicast", "no address"), "cannot be opened"),
        (CanBusConfig("slcan", "/no/such/port"), "slcan:/no/such/port"),
        (CanBusConfig("udp_multicast", "239.74.163.2", options={"port": "x"}), "cannot be opened"),
    ],
)
def test_a_bus_that_does_not_open_says_so_in_one_error(config: CanBusConfig, words: str) -> None:
    with pytest.raises(BusError, match=words) as caught:
        CanBusOwner.open(config, SteppedClock())
    assert caught.value.do
    assert caught.value.__cause__ is not None


@pytest.mark.parametrize(
    ("interface", "wrong", "right"),
    [
        ("udp_multicast", "hop_limt", "hop_limit"),
        pytest.param(
            *("socketcan", "recieve_own_messages", "receive_own_messages"),
            marks=pytest.mark.skipif(sys.platform != "linux", reason="SocketCAN is Linux's own"),
        ),
        ("slcan", "sleep_after_opening", "sleep_after_open"),
        ("virtual", "queue", "rx_queue_size"),
    ],
)
def test_an_option_that_would_be_passed_over_is_refused(
    interface: str, wrong: str, right: str
) -> None:
    with pytest.raises(BusError, match=f"no option '{wrong}'") as caught:
        CanBusOwner.open(CanBusConfig(interface, "x", options={wrong: 1}), SteppedClock())
    assert right in caught.value.do


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nobody hears a group not joined")
@pytest.mark.parametrize("groups", [("239.74.163.2", "239.74.163.3"), ("ff11::a302", "ff11::a303")])
def test_cells_on_two_multicast_groups_do_not_hear_each_other(groups: tuple[str, str]) -> None:
    with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as free:
        free.bind(("::", 0))
        options = {"port": free.getsockname()[1], "hop_limit": 0}
    try:
        buses = [
            open_bus(CanBusConfig("udp_multicast", group, options=options)) for group in groups
        ]
    except BusError as error:
        pytest.skip(f"no multicast here: {error}")
    with contextlib.ExitStack() as until:
        ours, theirs = (until.enter_context(bus) for bus in buses)
        drive = until.enter_context(
            fakes.process.open_bus("udp_multicast", groups[0], options=options)
        )
        for bus, cob_id in ((theirs, 0x182), (ours, 0x181)):
            bus.send(can.Message(arbitration_id=cob_id, is_extended_id=False))
        for bus in (ours, drive):  # Linux has delivered when `send` returns
            heard = [bus.recv(1.0), bus.recv(0.0)]
            assert [message and message.arbitration_id for message in heard] == [0x181, None]


def test_a_missing_socketcan_interface_says_how_to_bring_it_up() -> None:
    with pytest.raises(BusError) as caught:
        CanBusOwner.open(CanBusConfig("socketcan", "can9"), SteppedClock())
    assert "can9" in caught.value.what or "SocketCAN" in caught.value.what


@pytest.mark.parametrize(
    ("code", "channel", "what", "do"),
    [
        (errno.ENODEV, "can0", "no CAN interface can0", "type can bitrate 500000"),
        (errno.ENODEV, "vcan0", "no CAN interface vcan0", "type vcan"),
        (errno.ENETDOWN, "can0", "is down", "ip link set can0 up"),
        (errno.EAFNOSUPPORT, "can0", "no SocketCAN", "modprobe"),
        (errno.EPERM, "can0", "No permission", "CAP_NET_RAW"),
        (errno.EIO, "can0", "cannot be opened", "no other program"),
    ],
)
def test_the_operating_systems_refusals_are_told_apart(
    code: int, channel: str, what: str, do: str
) -> None:
    error = opening_failed(OSError(code, "refused"), "socketcan", channel, 500_000)
    assert what in error.what
    assert do in error.do


def test_an_interface_that_goes_down_is_named() -> None:
    cause = OSError(errno.ENETDOWN, "Network is down")
    failure = can.CanOperationError("Error receiving")
    failure.__cause__ = cause
    assert "went down" in working_failed(failure, "socketcan:can0", "receiving").what


@pytest.mark.parametrize(("interface", "bitrate"), [("", None), ("socketcan", 0)])
def test_a_wrong_bus_description_is_refused(interface: str, bitrate: int | None) -> None:
    with pytest.raises(ValueError, match=r"interface|bitrate"):
        CanBusConfig(interface, "can0", bitrate=bitrate)
