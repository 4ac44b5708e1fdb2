"""Habits of Linux and of python-can's SocketCAN that the reader process leans on."""

from __future__ import annotations

import socket
import struct
import threading
from collections.abc import Iterator

import pytest
from can.interfaces.socketcan.socketcan import capture_message

from drivers.can.reader_process import ReaderProcess
from drivers.can_reader.batches import SO_RXQ_OVFL, SO_TIMESTAMPNS, available
from drivers.clock import MonotonicClock

pytestmark = pytest.mark.skipif(not available(), reason="64-bit Linux only")

FRAME = struct.pack("<IB3x8s", 0x185, 8, b"12345678")


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", 0))
    receiver.settimeout(60.0)
    receiver.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.connect(receiver.getsockname())
    yield receiver, sender
    receiver.close()
    sender.close()


def overflow(receiver: socket.socket, sender: socket.socket) -> int:
    """Let the kernel drop frames; return how many it kept."""
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
    for _ in range(100):
        sender.send(FRAME)
    receiver.setblocking(False)
    kept = 0
    try:
        while receiver.recv(16):
            kept += 1
    except BlockingIOError:
        receiver.settimeout(60.0)
    sender.send(FRAME)
    return kept


def test_the_kernel_doubles_the_buffer_that_is_asked_for(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    pair[0].setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
    assert pair[0].getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) == 2 * 65536


def test_the_stamp_comes_first_and_the_drop_counter_only_once_there_were_drops(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    receiver, sender = pair
    receiver.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
    sender.send(FRAME)
    _, before, _, _ = receiver.recvmsg(16, 256)
    assert [kind for _, kind, _ in before] == [SO_TIMESTAMPNS]
    kept = overflow(receiver, sender)
    _, after, _, _ = receiver.recvmsg(16, 256)
    assert [kind for _, kind, _ in after] == [SO_TIMESTAMPNS, SO_RXQ_OVFL]
    assert struct.unpack("I", after[1][2])[0] == 100 - kept


def test_python_can_goes_on_receiving_from_a_socket_that_counts_drops(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    receiver, sender = pair
    receiver.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
    overflow(receiver, sender)
    message = capture_message(receiver)  # it asserts one control message, and has room for one
    assert message is not None
    assert bytes(message.data) == b"12345678"


def test_the_kernel_takes_the_end_of_the_opening_thread_for_the_owners(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    opened: list[ReaderProcess] = []
    clock = MonotonicClock()
    thread = threading.Thread(
        target=lambda: opened.append(ReaderProcess.start(pair[0], clock, "quirk"))
    )
    thread.start()
    thread.join()
    (reader,) = opened
    assert reader.process.wait(60.0) == -9
    reader.close()
