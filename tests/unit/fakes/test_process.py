"""The fake as a process of its own: real time, late or not, echoes and all."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import can
import pytest

from fakes.process import Arrivals, LateClock, open_bus, run_process

GROUP = "239.74.163.2"


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        s.bind(("127.0.0.1", 0))
        return int(s.getsockname()[1])


@contextmanager
def running(interface: str, channel: str, options: dict[str, object]) -> Iterator[can.BusABC]:
    """Yield a master's bus while the fake runs in a thread."""
    stop, failures = threading.Event(), []
    try:
        bus = open_bus(interface, channel, options=options)
    except OSError as error:  # a machine without multicast routing
        pytest.skip(f"{interface} cannot be opened here: {error}")

    def run() -> None:
        try:
            run_process(interface, channel, stop=stop, node_id=9, options=options)
        except (can.CanError, OSError) as error:
            failures.append(error)

    thread = threading.Thread(target=run, name="fake drive")
    thread.start()
    try:
        yield bus
    finally:
        stop.set()
        thread.join(60.0)
        bus.shutdown()
    assert failures == []


def wait_for(bus: can.BusABC, wanted: Callable[[can.Message], bool]) -> can.Message:
    """Return the first frame that is wanted; fail when none comes for long."""
    while True:
        message = bus.recv(60.0)
        assert message is not None, "the fake is silent"
        if wanted(message):
            return message


@pytest.mark.real_time
@pytest.mark.parametrize("interface", ["udp_multicast", "virtual"])
def test_it_boots_answers_and_beats_in_real_time(interface: str) -> None:
    multicast = interface == "udp_multicast"
    options: dict[str, object] = {"port": free_port()} if multicast else {}
    channel = GROUP if multicast else "a fake of its own"
    with running(interface, channel, options) as bus:
        assert bytes(wait_for(bus, lambda m: m.arbitration_id == 0x709).data) == b"\x00"
        asked_s = 1e-9 * time.time_ns()
        request = bytes.fromhex("2b17100014000000")  # heartbeat every 20 ms
        bus.send(can.Message(arbitration_id=0x609, is_extended_id=False, data=request))
        answer = wait_for(bus, lambda m: m.arbitration_id == 0x589)
        assert bytes(answer.data) == bytes.fromhex("6017100000000000")
        beats = [wait_for(bus, lambda m: m.arbitration_id == 0x709) for _ in range(11)]
        assert all(bytes(b.data) == b"\x7f" for b in beats)
        # ten periods after it was asked at least; on a busy machine later, but never earlier
        assert beats[-1].timestamp - asked_s > 0.199


def test_a_bus_that_cannot_be_opened_is_said() -> None:
    with pytest.raises((can.CanError, OSError)):
        run_process("socketcan", "nocan7", stop=threading.Event())


def test_the_late_clock_makes_up_for_a_little_and_skips_the_rest() -> None:
    clock = LateClock(longest_s=0.5)
    assert clock.now(1000.0) == 0.0
    assert clock.now(1000.25) == 0.25
    assert clock.now(4600.0) == 0.75
    assert clock.skipped_s == pytest.approx(3599.25)
    assert clock.now(4600.25) == 1.0


def test_a_frame_acts_when_it_came_however_late_the_process_takes_it() -> None:
    """Beside other programs the fake had measured three SYNCs at one moment, and one before it."""

    def stamped(ago_s: float) -> can.Message:
        return can.Message(timestamp=1e-9 * time.time_ns() - ago_s)

    arrivals, begins_s = Arrivals(LateClock()), time.perf_counter()
    assert arrivals.moment_of(None, begins_s - 0.2) == 0.0
    late_s = 0.2 + time.perf_counter() - begins_s
    early, late = (arrivals.moment_of(stamped(ago_s), begins_s) for ago_s in (0.05, 0.03))
    assert 0.01 < late - early < 0.02 + late_s
    assert 0.1 < early < late_s
    assert arrivals.moment_of(stamped(0.1), begins_s) == late  # time never goes back
    assert arrivals.moment_of(stamped(3600.0), begins_s) >= 0.2  # a wall clock that was set
