"""A bus that is listened to and nothing else: what is said on it, for a while.

Nothing is sent, and no device is asked. A CAN controller acknowledges what others send all the
same: at the wrong bitrate even a listener disturbs a bus.
"""

from __future__ import annotations

import socket
from collections.abc import Callable
from dataclasses import dataclass

import can
import numpy as np

from drivers.can.failures import WORKING_FAILURES, bus_name, working_failed
from drivers.can.frames import CanBusConfig, Reception
from drivers.can.opening import may_read_fast, open_bus
from drivers.can.reader_process import ReaderProcess
from drivers.can.traffic import ERROR, EXTENDED, REMOTE, Block, Traffic, block_of
from drivers.clock import Clock

LOOK_S = 0.05
"""Between two looks at what has come: 450 frames of a full 1 Mbit/s bus."""


@dataclass(frozen=True)
class Heard:
    """What came while a bus was listened to.

    Parameters
    ----------
    traffic : Traffic
        The account of it.
    duration_s : float
        For how long.
    reception : Reception
        How it was received, and what the kernel had no room for.
    """

    traffic: Traffic
    duration_s: float
    reception: Reception


def listen(config: CanBusConfig, clock: Clock, duration_s: float) -> Heard:
    """Listen to a bus for a while.

    Raises
    ------
    BusError
        It does not open, or stops working.
    """
    bus = open_bus(config)
    name = bus_name(config.interface, config.channel)
    try:
        receiver = getattr(bus, "socket", None)
        if may_read_fast(config, clock) and isinstance(receiver, socket.socket):
            reader = ReaderProcess.start(receiver, clock, name)
            try:
                return listen_by(reader, clock, duration_s)
            finally:
                reader.close()
        traffic = Traffic()
        took_s = _look_again_and_again(lambda: _drain(bus, name, traffic), clock, duration_s)
        return Heard(traffic, took_s, Reception("thread"))
    finally:
        bus.shutdown()


def listen_by(reader: ReaderProcess, clock: Clock, duration_s: float) -> Heard:
    """Listen by the process that reads a bus, block by block out of the shared memory."""
    traffic = Traffic()

    def look() -> None:
        reader.check()
        reader.hand_over(lambda *piece: traffic.add(block_of(*piece)))

    took_s = _look_again_and_again(look, clock, duration_s)
    return Heard(
        traffic, took_s, Reception("process", reader.dropped, reader.buffer_bytes, "kernel")
    )


def _look_again_and_again(look: Callable[[], None], clock: Clock, duration_s: float) -> float:
    """Look now and then until the time is over; return how long that was, in seconds."""
    began_s = clock.now()
    look()  # what came while the bus was opened counts, too
    while (now_s := clock.now()) < began_s + duration_s:
        clock.sleep_until(min(now_s + LOOK_S, began_s + duration_s))
        look()
    return clock.now() - began_s


def _drain(bus: can.BusABC, name: str, traffic: Traffic) -> None:
    """Count what waits on an adapter of python-can's, by the adapter's own stamps."""
    rows: list[tuple[float, int, int]] = []
    try:
        while (message := bus.recv(0.0)) is not None:
            flags = (
                message.is_extended_id * EXTENDED
                | message.is_remote_frame * REMOTE
                | message.is_error_frame * ERROR
            )
            rows.append((message.timestamp, message.arbitration_id | flags, len(message.data)))
    except WORKING_FAILURES as error:
        raise working_failed(error, name, "listening") from error
    if rows:
        time_s, can_id, length = zip(*rows, strict=True)
        traffic.add(
            Block(np.array(time_s), np.array(can_id, np.uint32), np.array(length, np.uint8))
        )
