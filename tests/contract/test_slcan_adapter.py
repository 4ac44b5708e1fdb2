"""An slcan adapter over a pty: frames pass both ways, and each way to fail is one sentence."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing

import can
import pytest

from drivers.can.owner import CanBusConfig, CanBusOwner
from drivers.can.slcan import SlcanBus
from drivers.clock import MonotonicClock
from drivers.errors import BusError, WorkerDiedError
from tests.contract.slcan_rig import Plugged, ear, plugged_in

TPDO1 = 0x185
PATIENCE_S = 60.0


@pytest.fixture
def plugged() -> Iterator[Plugged]:
    with plugged_in() as made:
        yield made


def say(plugged: Plugged, data: bytes) -> None:
    """Put one frame on the bus behind the adapter, as a drive would."""
    other = ear(plugged)
    other.send(can.Message(arbitration_id=TPDO1, data=data, is_extended_id=False))
    other.shutdown()


def death(owner: CanBusOwner) -> BusError:
    """Wait until the owner says that its receiver has ended, and return why."""
    clock = MonotonicClock()
    end_s = clock.now() + PATIENCE_S
    while clock.now() < end_s:
        try:
            owner.check()
        except WorkerDiedError as error:
            return error
        clock.sleep_until(clock.now() + 0.005)
    raise AssertionError("the owner says that all is well")


def test_frames_pass_both_ways_at_the_bitrate_asked_for(plugged: Plugged) -> None:
    clock, other = MonotonicClock(), ear(plugged)
    with closing(CanBusOwner.open(plugged.config, clock)) as owner:
        inbox = owner.subscribe([TPDO1])
        owner.send(0x205, b"\x0f\x00")
        heard = other.recv(PATIENCE_S)
        assert heard is not None
        assert (heard.arbitration_id, bytes(heard.data)) == (0x205, b"\x0f\x00")
        say(plugged, b"\x00\xff")
        assert owner.wait(inbox, clock.now() + PATIENCE_S)
        assert inbox.frames[0].data == b"\x00\xff"
        owner.check()  # the adapter was right to refuse the second opening, and it meant nothing
        assert plugged.adapter.setup == "8"  # 1 Mbit/s
    other.shutdown()
    end_s = clock.now() + PATIENCE_S
    while plugged.adapter.opened:  # by a thread of its own
        assert clock.now() < end_s
        clock.sleep_until(clock.now() + 0.002)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("bell", "refused a frame with a bell while receiving"),
        ("garbage", "sends what is no slcan"),
        ("short", "1 of 2 data bytes"),
    ],
)
def test_an_adapter_that_fails_says_how(plugged: Plugged, kind: str, words: str) -> None:
    with closing(CanBusOwner.open(plugged.config, MonotonicClock())) as owner:
        plugged.adapter.misbehaviour = kind
        owner.send(0x205, b"\x0f\x00")
        say(plugged, b"\x00\xff")
        why = death(owner)
        assert words in why.what
        assert str(plugged.config.channel) in why.what
        assert why.do


def test_an_adapter_that_is_pulled_out_is_gone_for_both_directions(plugged: Plugged) -> None:
    with closing(CanBusOwner.open(plugged.config, MonotonicClock())) as owner:
        plugged.unplug()
        assert "is gone while receiving" in death(owner).what
        with pytest.raises(BusError, match="is gone while sending 0x205"):
            owner.send(0x205, b"\x0f\x00")


def test_an_adapter_that_takes_nothing_does_not_hold_up_the_control_tick(plugged: Plugged) -> None:
    clock = MonotonicClock()
    with closing(CanBusOwner.open(plugged.config, clock)) as owner:
        plugged.adapter.misbehaviour = "deaf"
        slowest_s = 0.0

        def send_until_it_fails() -> None:
            nonlocal slowest_s
            for _ in range(100_000):
                began_s = clock.now()
                try:
                    owner.post(0x205, bytes(8))
                finally:
                    slowest_s = max(slowest_s, clock.now() - began_s)

        with pytest.raises(BusError, match="takes no more frames while sending"):
            send_until_it_fails()
        assert slowest_s < 20.0  # a tenth of a second, and what the machine adds; not for ever


def test_a_bitrate_that_no_adapter_knows_is_refused(plugged: Plugged) -> None:
    config = CanBusConfig("slcan", plugged.config.channel, 123_456, plugged.config.options)
    with pytest.raises(BusError, match="Invalid bitrate, choose one of 10000"):
        CanBusOwner.open(config, MonotonicClock())


def test_what_python_can_does_not_say_is_why_the_bus_is_ours(plugged: Plugged) -> None:
    """A quirk: when python-can's own bus tells of these, ours can go."""
    bus = can.Bus(
        interface="slcan", channel=plugged.config.channel, sleep_after_open=0.0, bitrate=500_000
    )
    assert not isinstance(bus, SlcanBus)
    while bus.recv(0.05) is not None:
        pass
    plugged.adapter.misbehaviour = "bell"
    bus.send(can.Message(arbitration_id=0x205, data=b"\x0f\x00", is_extended_id=False))
    assert bus.recv(0.1) is None
    plugged.adapter.misbehaviour = "short"
    say(plugged, b"\x00\xff")
    half = bus.recv(PATIENCE_S)
    assert half is not None
    assert (half.dlc, len(half.data)) == (2, 1)
    bus.shutdown()


def test_frames_that_wait_are_taken_with_one_call_and_halves_are_put_together() -> None:
    """Python-can's own asks the system for each byte by itself: five times the processor time."""
    with SlcanBus(channel="loop://", bitrate=1_000_000, sleep_after_open=0.0) as bus:
        taken, read = [], bus.serialPortOrig.read

        def counted(size: int) -> bytes:
            taken.append(size)
            return bytes(read(size))

        bus.serialPortOrig.read = counted
        frames = b"".join(b"t1852%04X\r" % number for number in range(12))
        bus.serialPortOrig.write(frames[:-4])
        heard = [bus.recv(0.0) for _ in range(11)]
        assert taken == [len(frames) - 4]
        bus.serialPortOrig.write(frames[-4:])
        heard.append(bus.recv(0.0))
    data = [bytes(message.data) for message in heard if message is not None]
    assert data == [number.to_bytes(2, "big") for number in range(12)]
