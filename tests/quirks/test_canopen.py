"""What the driver leans on in canopen 2.4 and python-can 4.6: an upgrade that changes it tells."""

from __future__ import annotations

import itertools
import logging
import socket
import struct
import threading
from collections.abc import Iterator
from typing import Any

import can
import canopen
import pytest
from canopen.emcy import EmcyConsumer
from canopen.network import MessageListener
from canopen.nmt import NmtMaster
from canopen.sdo.client import SdoClient

from drivers.errors import BusError

_CHANNELS = itertools.count()


class RecordingNetwork(canopen.Network):
    """A network without a bus that keeps what was to be sent."""

    def __init__(self) -> None:
        super().__init__()
        self.sent: list[tuple[int, bytes]] = []
        self.fails: Exception | None = None

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        assert not remote
        self.sent.append((can_id, bytes(data)))
        if self.fails is not None:
            raise self.fails


def client(network: canopen.Network) -> Any:
    made: Any = SdoClient(0x605, 0x585, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]  # canopen is untyped here
    made.network = network
    made.RESPONSE_TIMEOUT = 0.01
    return made


def test_a_network_without_a_bus_starts_no_thread_and_sends_through_its_subclass() -> None:
    before = threading.active_count()
    network = RecordingNetwork()
    master = NmtMaster(5)
    master.network = network
    master.send_command(0x80)
    assert network.sent == [(0x000, b"\x80\x05")]
    assert network.notifier is None
    assert threading.active_count() == before


def test_notify_lets_a_callbacks_exception_out_where_its_own_listener_swallows_it(
    caplog: pytest.LogCaptureFixture,
) -> None:
    network = RecordingNetwork()
    heard: list[int] = []

    def broken(_can_id: int, _data: bytearray, _stamp: float) -> None:
        raise ValueError("decoder tripped")

    network.subscribe(0x185, broken)
    network.subscribe(0x185, lambda can_id, _data, _stamp: heard.append(can_id))
    with pytest.raises(ValueError, match="decoder tripped"):
        network.notify(0x185, bytearray(), 0.0)
    with caplog.at_level(logging.ERROR, logger="canopen.network"):
        MessageListener(network).on_message_received(  # type: ignore[no-untyped-call]  # canopen is untyped here
            can.Message(arbitration_id=0x185)
        )
    assert "decoder tripped" in caplog.text
    assert heard == []  # either way the frame's other subscriber is skipped


def test_an_sdo_request_is_tried_once_and_then_aborted_by_the_client() -> None:
    network = RecordingNetwork()
    with pytest.raises(canopen.SdoCommunicationError):
        client(network).upload(0x6041, 0)
    upload, abort = network.sent
    assert upload == (0x605, struct.pack("<BHB4x", 0x40, 0x6041, 0))
    assert abort[1][0] == 0x80
    assert struct.unpack_from("<I", abort[1], 4) == (0x05040000,)


def test_only_a_can_error_is_a_send_error_to_the_sdo_client() -> None:
    network = RecordingNetwork()
    network.fails = BusError("down")
    with pytest.raises(BusError):
        client(network).upload(0x6041, 0)
    assert len(network.sent) == 1  # neither repeated nor slept over


def test_an_upload_without_dictionary_gives_the_raw_bytes() -> None:
    class Answering(RecordingNetwork):
        def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
            super().send_message(can_id, data, remote)
            sdo.on_response(0x585, b"\x4b\x41\x60\x00\x37\x16\x00\x00", 0.0)

    sdo = client(Answering())
    sdo.responses.put(b"stale answer of a request that timed out")
    assert sdo.upload(0x6041, 0) == b"\x37\x16"


def test_an_answer_for_another_object_is_refused() -> None:
    class Confused(RecordingNetwork):
        def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
            super().send_message(can_id, data, remote)
            sdo.on_response(0x585, b"\x4b\x64\x60\x00\x37\x16\x00\x00", 0.0)

    sdo = client(Confused())
    with pytest.raises(canopen.SdoCommunicationError, match="0x6064"):
        sdo.upload(0x6041, 0)


@pytest.mark.parametrize("data", [b"", b"\x30\x81\x11", b"\x00" * 7])
def test_an_emergency_that_is_not_eight_bytes_breaks_the_consumer(data: bytes) -> None:
    consumer: Any = EmcyConsumer()  # type: ignore[no-untyped-call]  # canopen is untyped here
    with pytest.raises(struct.error):
        consumer.on_emcy(0x85, data, 0.0)
    assert consumer.log == []


def test_a_boot_up_is_told_as_zero_to_callbacks_although_the_state_says_otherwise() -> None:
    master: Any = NmtMaster(5)
    told: list[int] = []
    master.add_heartbeat_callback(told.append)
    master.on_heartbeat(0x705, b"\x00", 1.0)
    master.on_heartbeat(0x705, b"\x85", 2.0)  # the toggle bit of node guarding is masked
    assert told == [0, 5]
    with pytest.raises(struct.error):
        master.on_heartbeat(0x705, b"", 3.0)


def test_ordering_a_state_changes_the_masters_idea_of_it_before_the_node_has_said_so() -> None:
    master: Any = NmtMaster(5)
    master.network = RecordingNetwork()
    master.send_command(0x01)
    assert master.state == "OPERATIONAL"


class TestPythonCan:
    """What the bus owner leans on."""

    @pytest.fixture
    def pair(self) -> Iterator[tuple[can.BusABC, can.BusABC]]:
        channel = f"quirk-{next(_CHANNELS)}"
        first = can.Bus(interface="virtual", channel=channel, ignore_config=True)
        second = can.Bus(interface="virtual", channel=channel, ignore_config=True)
        yield first, second
        first.shutdown()
        second.shutdown()

    def test_a_message_is_extended_unless_told(self) -> None:
        assert can.Message(arbitration_id=0x80).is_extended_id

    def test_virtual_does_not_echo_and_an_empty_bus_does_not_block(
        self, pair: tuple[can.BusABC, can.BusABC]
    ) -> None:
        first, second = pair
        first.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        assert first.recv(0.0) is None
        message = second.recv(0.0)
        assert message is not None
        assert message.timestamp > 1e9  # wall clock

    def test_udp_multicast_echoes_our_own_frames_unmarked(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        bus = can.Bus(
            interface="udp_multicast",
            channel="239.74.163.2",
            ignore_config=True,
            port=port,
            hop_limit=0,
        )
        bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        message = bus.recv(1.0)
        bus.shutdown()
        assert message is not None
        assert message.is_rx

    def test_an_unknown_interface_is_no_can_error(self) -> None:
        with pytest.raises(NotImplementedError) as caught:
            can.Bus(interface="no-such-adapter", channel="0", ignore_config=True)
        assert not isinstance(caught.value, can.CanError)

    def test_a_missing_socketcan_interface_is_an_os_error(self) -> None:
        with pytest.raises(OSError, match=r"\[Errno \d+\]") as caught:
            can.Bus(interface="socketcan", channel="nocan9", ignore_config=True)
        assert not isinstance(caught.value, can.CanError)
