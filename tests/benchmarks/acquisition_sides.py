"""The two sides of the acquisition benchmark: one process sends frames, another receives them.

Each receiver is a process of its own, so that its processor time is its own; a reader process that
it starts is counted with it. The number in every frame tells what was lost and what came twice.
Between two of them others may speak, to whom nobody here listens: the other axes of the robot.
"""

from __future__ import annotations

import argparse
import gc
import json
import socket
import struct
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import canopen
from can.interfaces.socketcan import SocketcanBus

from drivers.can.owner import CanBusOwner
from drivers.can.reader_process import ReaderProcess
from drivers.clock import MonotonicClock

LOOPBACK = "loopback"
PDO_ID, END_ID = 0x185, 0x7FF
OTHERS = (0x181, 0x281, 0x182, 0x282, 0x183, 0x283)
"""TPDOs of other axes, which answer our SYNC, too."""
PAYLOAD = struct.Struct("<HhI")  # statusword, torque, and the frame's number as the position
FRAME = struct.Struct("<IB3x8s")
TICK_S = 0.002  # of the control loop, at the product's own sample rate
BURST_S = 0.001  # a bus hands over frames as they come; one SYNC brings several at once
PATIENCE_S = 3.0
IDLE_TICKS = 500
CLOCK = MonotonicClock()

EDS = """[FileInfo]
FileName=benchmark.eds
[DeviceInfo]
VendorName=none
[MandatoryObjects]
SupportedObjects=0
[OptionalObjects]
SupportedObjects=5
1=0x1800
2=0x1A00
3=0x6041
4=0x6064
5=0x6077
[ManufacturerObjects]
SupportedObjects=0
"""
PARAMETER = "[{0}]\nParameterName={1}\nObjectType=0x7\nDataType={2}\nAccessType=rw\nPDOMapping=1\n"
RECORD = "[{0}]\nParameterName={1}\nObjectType=0x9\nSubNumber=3\n"


class LoopbackBus(SocketcanBus):
    """python-can's own SocketCAN receiver on a UDP socket, for hosts without AF_CAN."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setsockopt(socket.SOL_SOCKET, 35, 1)  # SO_TIMESTAMPNS, as SocketcanBus does
        self.channel = LOOPBACK
        self._bcm_sockets = {}
        self._is_filtered = False
        can.BusABC.__init__(self, channel=LOOPBACK)

    def _apply_filters(self, filters: Any) -> None:
        """Filter nothing."""


def open_bus(channel: str) -> can.BusABC:
    if channel == LOOPBACK:
        return LoopbackBus()
    return can.Bus(interface="socketcan", channel=channel, ignore_config=True)


def send(channel: str, address: str, rate_hz: float, seconds: float, others: int) -> None:
    """Send numbered frames at a steady rate, in bursts of a millisecond, then the end.

    After each numbered frame come `others` of somebody else's, which the rate has in it.
    """
    if channel == LOOPBACK:
        out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        out.connect(("127.0.0.1", int(address)))
    else:
        out = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        out.bind((channel,))
    total = round(rate_hz * seconds / (1 + others)) * (1 + others)
    number, start_s = 0, CLOCK.now()
    while number < total:
        due = min(total, round((CLOCK.now() - start_s) * rate_hz) + 1)
        for index in range(number, due):
            ours, between = divmod(index, 1 + others)
            cob_id = OTHERS[(between - 1) % len(OTHERS)] if between else PDO_ID
            out.send(FRAME.pack(cob_id, 8, PAYLOAD.pack(0x27, 5, ours)))
        number = due
        CLOCK.sleep_until(CLOCK.now() + BURST_S)
    took_s = CLOCK.now() - start_s
    CLOCK.sleep_until(CLOCK.now() + 0.5)
    for _ in range(3):
        out.send(FRAME.pack(END_ID, 8, PAYLOAD.pack(0, 0, total)))
    out.close()
    sys.stdout.write(json.dumps({"sent": total, "took_s": took_s}) + "\n")


class Tally:
    """Counts what came, by the numbers in it."""

    def __init__(self) -> None:
        self.came = 0
        self.wrong = 0  # not the number after the one before
        self.expected = 0
        self.ended = False

    def take(self, number: int) -> None:
        if number != self.expected:
            self.wrong += 1
        self.expected = number + 1
        self.came += 1


class ByOwner:
    """The product's way: a process of its own (or the owner's thread) receives, the tick takes."""

    def __init__(self, bus: can.BusABC, tally: Tally, *, fast: bool) -> None:
        receiver = getattr(bus, "socket", None)
        assert isinstance(receiver, socket.socket)
        reader = ReaderProcess.start(receiver, CLOCK, "benchmark") if fast else None
        self.helper = 0 if reader is None else reader.process.pid
        self._owner = CanBusOwner(bus, CLOCK, "benchmark", reader)
        self._inbox = self._owner.subscribe((PDO_ID,), limit=1_000_000)
        self._end = self._owner.subscribe((END_ID,))
        self._tally = tally

    def tick(self) -> None:
        """Take every frame that has come."""
        self._owner.poll()
        self._owner.check()
        frames = self._inbox.frames
        while frames:
            self._tally.take(PAYLOAD.unpack(frames.popleft().data)[2])
        self._tally.ended = bool(self._end.frames)

    def close(self) -> dict[str, Any]:
        """Let go of the bus; return what the reader knows of the kernel."""
        reception = self._owner.reception()
        self._owner.close()
        return {
            "dropped_by_kernel": reception.dropped_by_kernel,
            "buffer_bytes": reception.receive_buffer_bytes,
        }


class ByNotifier:
    """python-can's Notifier with one listener."""

    helper = 0

    def __init__(self, bus: can.BusABC, tally: Tally) -> None:
        self._bus, self._tally = bus, tally
        self._notifier = can.Notifier(bus, [self._listen])

    def _listen(self, message: can.Message) -> None:
        if message.arbitration_id == END_ID:
            self._tally.ended = True
        elif message.arbitration_id == PDO_ID:
            self._tally.take(PAYLOAD.unpack(message.data)[2])

    def tick(self) -> None:
        """Do nothing: the Notifier's thread calls."""

    def close(self) -> dict[str, Any]:
        """Stop the thread and close the bus."""
        self._notifier.stop()
        self._bus.shutdown()
        return {}


class ByCanopen:
    """canopen's PDO callback, which reads the PDO's three variables."""

    helper = 0

    def __init__(self, bus: can.BusABC, tally: Tally) -> None:
        self._tally = tally
        self._network = canopen.Network(bus)
        node: Any = canopen.RemoteNode(5, _dictionary())
        self._network.add_node(node)
        pdo = node.tpdo[1]
        pdo.clear()
        for index in (0x6041, 0x6077, 0x6064):
            pdo.add_variable(index)
        pdo.cob_id, pdo.enabled = PDO_ID, True
        pdo.add_callback(self._taken)
        self._network.subscribe(PDO_ID, pdo.on_message)
        self._network.subscribe(END_ID, self._over)
        self._network.notifier = can.Notifier(bus, self._network.listeners)

    def _taken(self, pdo: Any) -> None:
        self._tally.take([variable.raw for variable in pdo][2])

    def _over(self, *_: object) -> None:
        self._tally.ended = True

    def tick(self) -> None:
        """Do nothing: the Notifier's thread calls."""

    def close(self) -> dict[str, Any]:
        """Stop the thread and close the bus."""
        self._network.disconnect()
        return {}


RECEIVERS: dict[str, Callable[[can.BusABC, Tally], ByOwner | ByNotifier | ByCanopen]] = {
    "reader process": lambda bus, tally: ByOwner(bus, tally, fast=True),
    "owner's thread": lambda bus, tally: ByOwner(bus, tally, fast=False),
    "python-can Notifier": ByNotifier,
    "canopen PDO, 3 x .raw": ByCanopen,
}


def receive(kind: str, channel: str) -> None:
    """Receive until the end has come, or nothing has for a while; print what that was."""
    bus, tally = open_bus(channel), Tally()
    receiver = RECEIVERS[kind](bus, tally)
    address = bus.socket.getsockname()[1] if isinstance(bus, LoopbackBus) else channel
    sys.stdout.write(f"{address}\n")
    sys.stdout.flush()
    gc.collect()
    gc.freeze()
    gc.disable()  # as in a cycle
    begun: tuple[float, float] | None = None
    came, came_s, ticks = 0, CLOCK.now(), 0
    while not tally.ended:
        receiver.tick()
        now_s = CLOCK.now()
        ticks += tally.came > 0
        if begun is None and tally.came:
            begun = processor_s(receiver.helper)
        if tally.came != came:
            came, came_s = tally.came, now_s
        elif now_s - came_s > PATIENCE_S * (1 if came else 10):
            break
        CLOCK.sleep_until(now_s + TICK_S)
    ended, begun = processor_s(receiver.helper), begun or (0.0, 0.0)
    own_s, reader_s = ended[0] - begun[0], ended[1] - begun[1]
    found = {"came": tally.came, "wrong": tally.wrong, "own_s": own_s, "reader_s": reader_s}
    found["loop_s"] = ticks * idle_tick_s()
    sys.stdout.write(json.dumps(found | receiver.close()) + "\n")


def idle_tick_s() -> float:
    """Return the processor time of a tick that takes nothing: it sleeps, and wakes."""
    began_s = time.process_time()
    for _ in range(IDLE_TICKS):
        CLOCK.sleep_until(CLOCK.now() + TICK_S)
    return (time.process_time() - began_s) / IDLE_TICKS


def processor_s(helper: int) -> tuple[float, float]:
    """Return the processor time of this process, and of its helper if it has one, in seconds."""
    helpers_clock = (~helper << 3) | 2  # as the C library's clock_getcpuclockid makes it
    return time.process_time(), time.clock_gettime(helpers_clock) if helper else 0.0


def _dictionary() -> canopen.ObjectDictionary:
    """Return an object dictionary with one TPDO of statusword, torque and position."""
    text = EDS
    for index, name, sub_type in (("1800", "communication", "0x7"), ("1A00", "mapping", "0x7")):
        text += RECORD.format(index, name)
        for sub in range(3):
            text += PARAMETER.format(f"{index}sub{sub}", f"{name} {sub}", sub_type)
    for index, name, kind in (("6041", "s", "0x6"), ("6077", "t", "0x3"), ("6064", "p", "0x7")):
        text += PARAMETER.format(index, name, kind)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "benchmark.eds"
        path.write_text(text)
        return canopen.import_od(str(path))


def main() -> None:
    """Be one side."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--channel", required=True)
    parser.add_argument("--receive", choices=RECEIVERS)
    parser.add_argument("--send", metavar="ADDRESS")
    parser.add_argument("--rate", type=float, default=7000.0)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--others", type=int, default=0)
    arguments = parser.parse_args()
    if arguments.receive is not None:
        receive(arguments.receive, arguments.channel)
    else:
        how = (arguments.rate, arguments.seconds, arguments.others)
        send(arguments.channel, arguments.send, *how)


if __name__ == "__main__":
    main()
