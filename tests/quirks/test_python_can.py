"""Habits of python-can 4.6 that the fake or an owner thread leans on: an upgrade must tell."""

from __future__ import annotations

import logging
import queue
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

import can
import pytest


@pytest.fixture
def pair() -> Iterator[tuple[can.BusABC, can.BusABC]]:
    one = can.Bus(interface="virtual", channel="quirks", ignore_config=True)
    two = can.Bus(interface="virtual", channel="quirks", ignore_config=True)
    yield one, two
    one.shutdown()
    two.shutdown()


def frame(cob_id: int = 0x123, data: bytes = b"\x01") -> can.Message:
    return can.Message(arbitration_id=cob_id, is_extended_id=False, data=data)


def test_a_message_is_extended_unless_told_otherwise() -> None:
    assert can.Message(arbitration_id=0x123).is_extended_id
    assert not frame().is_extended_id


def test_equal_messages_are_not_equal() -> None:
    assert frame() != frame()
    assert frame().equals(frame(), timestamp_delta=None)


def test_message_data_is_a_bytearray_and_a_given_one_is_not_copied() -> None:
    source = bytearray(b"\x01\x02")
    message = can.Message(arbitration_id=0x123, is_extended_id=False, data=source)
    assert isinstance(message.data, bytearray)
    assert message.data is source  # handed over, not copied: do not reuse a buffer
    assert isinstance(frame(data=b"\x01").data, bytearray)


def test_virtual_delivers_copies_to_all_others_in_order(
    pair: tuple[can.BusABC, can.BusABC],
) -> None:
    one, two = pair
    sent = frame()
    one.send(sent)
    sent.data[0] = 99
    one.send(sent)
    received = [two.recv(0.0), two.recv(0.0)]
    assert [bytes(m.data) for m in received if m] == [b"\x01", b"\x63"]
    assert two.recv(0.0) is None
    assert one.recv(0.0) is None  # no echo of its own


def test_virtual_recv_with_zero_timeout_returns_at_once_from_an_empty_bus(
    pair: tuple[can.BusABC, can.BusABC],
) -> None:
    done = threading.Event()

    def receive() -> None:
        assert pair[0].recv(0.0) is None
        done.set()

    thread = threading.Thread(target=receive)
    thread.start()
    assert done.wait(60.0)
    thread.join()


def test_virtual_channels_are_any_hashable_and_do_not_hear_each_other() -> None:
    buses = [
        can.Bus(interface="virtual", channel=object(), ignore_config=True)  # type: ignore[arg-type]  # wrong on purpose
        for _ in range(2)
    ]
    buses[0].send(frame())
    assert buses[1].recv(0.0) is None
    for bus in buses:
        bus.shutdown()


def test_virtual_with_a_full_receive_queue_refuses_the_sender() -> None:
    one = can.Bus(interface="virtual", channel="full", ignore_config=True)
    two = can.Bus(interface="virtual", channel="full", ignore_config=True, rx_queue_size=1)
    one.send(frame())
    with pytest.raises(can.CanOperationError):
        one.send(frame(), timeout=0.01)
    one.shutdown()
    two.shutdown()


def test_virtual_shut_down_refuses_to_send_and_receive() -> None:
    bus = can.Bus(interface="virtual", channel="closed", ignore_config=True)
    bus.shutdown()
    with pytest.raises(can.CanOperationError):
        bus.send(frame())
    with pytest.raises(can.CanOperationError):
        bus.recv(0.0)


@pytest.fixture
def multicast() -> dict[str, Any]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        s.bind(("127.0.0.1", 0))
        port = s.getsockname()[1]
    options = {"channel": "239.74.163.2", "port": port, "hop_limit": 0, "ignore_config": True}
    return {"interface": "udp_multicast", **options}


def opened(options: dict[str, Any]) -> can.BusABC:
    try:
        return can.Bus(**options)
    except OSError as error:
        pytest.skip(f"no multicast here: {error}")


def test_udp_multicast_echoes_its_own_frames_and_cannot_be_told_not_to(
    multicast: dict[str, Any],
) -> None:
    with opened(multicast) as bus:
        bus.send(frame(0x181))
        echo = bus.recv(1.0)
        assert echo is not None
        assert echo.arbitration_id == 0x181
        assert echo.is_rx  # nothing marks it as one's own
    with pytest.raises(can.CanInterfaceNotImplementedError):
        can.Bus(receive_own_messages=True, **multicast)


@pytest.mark.skipif(sys.platform != "linux", reason="what Linux does with a port's groups")
def test_udp_multicast_hears_every_group_that_this_machine_has_joined(
    multicast: dict[str, Any],
) -> None:
    """So `drivers.can.opening` and `fakes.process` ask the kernel for one's own group alone."""
    with opened(multicast) as one, opened(multicast | {"channel": "239.74.163.3"}) as two:
        two.send(frame(0x181))
        heard = one.recv(1.0)
        assert heard is not None
        assert heard.arbitration_id == 0x181


@pytest.mark.skipif(sys.platform != "linux", reason="what Linux does with its loopback")
def test_udp_multicast_has_arrived_when_send_returns(multicast: dict[str, Any]) -> None:
    """The scripted faults are played there in stepped time (`tests/faults/cell.py`)."""
    with opened(multicast) as one, opened(multicast) as two:
        for number in range(500):
            one.send(frame(data=number.to_bytes(2, "little")))
            came = two.recv(0.0)
            assert came is not None
            assert int.from_bytes(came.data, "little") == number


def test_socketcan_without_the_interface_raises_oserror_not_can_error() -> None:
    with pytest.raises(OSError) as raised:  # noqa: PT011 - the class is what is characterised
        can.Bus(interface="socketcan", channel="nocan7", ignore_config=True)
    assert not isinstance(raised.value, can.CanError)


# the thread's end by an exception is what is characterised
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_listeners_exception_kills_the_notifier_unseen(
    pair: tuple[can.BusABC, can.BusABC], caplog: pytest.LogCaptureFixture
) -> None:
    one, two = pair
    calls: queue.Queue[int] = queue.Queue()

    def listener(_message: can.Message) -> None:
        calls.put(1)
        raise RuntimeError("listener")

    with caplog.at_level(logging.CRITICAL):
        notifier = can.Notifier(one, [listener], timeout=0.05)
        two.send(frame())
        assert calls.get(timeout=60.0) == 1
        for reader in notifier._readers:
            assert isinstance(reader, threading.Thread)
            reader.join(60.0)
            assert not reader.is_alive()
        assert not notifier.stopped
        two.send(frame())
        with pytest.raises(queue.Empty):
            calls.get(timeout=0.1)
        notifier.stop()


def test_thread_safe_bus_as_a_context_hands_out_the_unlocked_bus() -> None:
    safe = can.ThreadSafeBus(interface="virtual", channel="safe", ignore_config=True)
    with safe as inside:
        assert not isinstance(inside, can.ThreadSafeBus)


def test_asammdf_is_not_imported_with_python_can_and_can_be_had_afterwards() -> None:
    code = (
        "import sys, drivers.can.owner; assert 'pandas' not in sys.modules; "
        "import can.io.mf4; assert can.io.mf4.asammdf is None; "
        "import importlib.util; assert importlib.util.find_spec('asammdf')"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
