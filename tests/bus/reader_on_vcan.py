"""Tests that need AF_CAN in the same process; `test_on_vcan.py` has them run where it is.

Run by hand: ``python -m tests.bus env STRIBECK_CAN_CHANNEL=vcan0 python -m pytest`` and this file.
"""

from __future__ import annotations

import os
import signal
import struct
import subprocess
from collections.abc import Iterator

import can
import pytest

from drivers.can.frames import CanBusConfig, Inbox
from drivers.can.owner import CanBusOwner
from drivers.cia402.axis import Cia402Axis
from drivers.clock import MonotonicClock
from drivers.errors import DriverError, WorkerDiedError
from drivers.ports import Command, Goal
from tests.bus.vcan import CHANNEL_VARIABLE
from tests.contract.axis_rig import open_rig

CHANNEL = os.environ.get(CHANNEL_VARIABLE, "")
CLOCK = MonotonicClock()
_NUMBER = struct.Struct("<Q")

pytestmark = pytest.mark.skipif(not CHANNEL, reason=f"{CHANNEL_VARIABLE} names no bus")


@pytest.fixture
def other() -> Iterator[can.BusABC]:
    with can.Bus(interface="socketcan", channel=CHANNEL, ignore_config=True) as bus:
        yield bus


@pytest.fixture(params=["process", "thread"])
def owner(request: pytest.FixtureRequest) -> Iterator[CanBusOwner]:
    fast = request.param == "process"
    made = CanBusOwner.open(CanBusConfig("socketcan", CHANNEL, fast_reader=fast), CLOCK)
    assert made.reception().reader == request.param
    yield made
    made.close()


def say(bus: can.BusABC, number: int, cob_id: int = 0x185) -> None:
    data = _NUMBER.pack(number)
    bus.send(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))


def collect(owner: CanBusOwner, inbox: Inbox, count: int) -> list[int]:
    deadline_s = CLOCK.now() + 10.0
    while len(inbox.frames) < count:
        assert CLOCK.now() < deadline_s, f"{len(inbox.frames)} of {count} frames after 10 s"
        CLOCK.sleep_until(CLOCK.now() + 0.002)
        owner.poll()
    return [_NUMBER.unpack(frame.data)[0] for frame in inbox.frames]


def test_frames_come_in_order_and_what_we_send_does_not_come_back(
    owner: CanBusOwner, other: can.BusABC
) -> None:
    inbox = owner.subscribe((0x185,), limit=5000)
    for number in range(2000):
        say(other, number)
        if number % 100 == 0:
            owner.post(0x205, b"ours")
            CLOCK.sleep_until(CLOCK.now() + 0.005)
    assert collect(owner, inbox, 2000) == list(range(2000))
    assert (owner.counts.own_echoes, owner.counts.unrouted) == (0, 0)


@pytest.mark.parametrize("owner", ["process"], indirect=True)
def test_the_stamp_is_the_kernels_on_our_clock(owner: CanBusOwner, other: can.BusABC) -> None:
    inbox = owner.subscribe((0x185,))
    for number in range(50):
        before_s = CLOCK.now()
        say(other, number)
        after_s = CLOCK.now()
        CLOCK.sleep_until(after_s + 0.01)  # a stamp made while reading would be this late
        owner.poll()
        assert before_s - 5e-4 <= inbox.frames[-1].stamp_s <= after_s + 5e-4
    assert owner.counts.restamped == 0


@pytest.mark.parametrize("owner", ["process"], indirect=True)
def test_odd_frames_are_counted_by_their_kind(owner: CanBusOwner, other: can.BusABC) -> None:
    inbox = owner.subscribe((0x185,))
    other.send(can.Message(arbitration_id=0x185, is_extended_id=True))
    other.send(can.Message(arbitration_id=0x185, is_remote_frame=True, is_extended_id=False))
    say(other, 1)
    collect(owner, inbox, 1)
    assert (owner.counts.extended, owner.counts.remote_frames, owner.counts.routed) == (1, 1, 1)


@pytest.mark.parametrize("owner", ["process"], indirect=True)
def test_an_interface_that_goes_down_is_named(owner: CanBusOwner) -> None:
    assert owner.reception().receive_buffer_bytes == 8 << 20  # root may force it
    subprocess.run(["ip", "link", "set", CHANNEL, "down"], check=True)
    try:
        deadline_s = CLOCK.now() + 5.0
        with pytest.raises(WorkerDiedError, match=f"{CHANNEL} went down while receiving"):
            _check_until(owner, deadline_s)
    finally:
        subprocess.run(["ip", "link", "set", CHANNEL, "up"], check=True)


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_reader_that_is_lost_in_motion_is_told_and_the_standstill_still_seen(
    how: signal.Signals,
) -> None:
    with open_rig("socketcan") as rig:
        axis = rig.axis(sync_timeout_s=0.1)  # known to be silent before it is known to hang
        axis.open()
        rig.enable(axis, 20.0)
        assert rig.owner._reader is not None
        os.kill(rig.owner._reader.process.pid, how)
        lost_s = CLOCK.now()
        with pytest.raises(DriverError) as caught:
            _receive_until(axis, lost_s + 5.0)
        told_s = CLOCK.now()
        report = axis.stop(CLOCK.now() + 5.0)
        axis.close()
    if how is signal.SIGKILL:
        assert isinstance(caught.value, WorkerDiedError)
        assert told_s - lost_s < 0.25  # a few ticks of User-Mode Linux
    assert report.at_rest, report.reason
    assert "standstill measured" in report.reason


def _receive_until(axis: Cia402Axis, deadline_s: float) -> None:
    while CLOCK.now() < deadline_s:
        axis.send(Command(Goal.ON, 20.0))
        CLOCK.sleep_until(CLOCK.now() + 0.004)
        axis.receive()


def _check_until(owner: CanBusOwner, deadline_s: float) -> None:
    while CLOCK.now() < deadline_s:
        owner.check()
        CLOCK.sleep_until(CLOCK.now() + 0.005)
