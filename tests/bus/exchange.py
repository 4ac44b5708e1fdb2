"""SYNC and answer between two processes on a real CAN bus: what the bus itself can do.

``python -m tests.bus.exchange [--rate HZ] [--seconds S]`` sends SYNC at a fixed rate from one
process; another answers each with one frame. No code of ours takes part but the clock, so that
these numbers are the ground on which the drivers' own are read. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import gc
import json
import struct
import subprocess
import sys
import time
from dataclasses import asdict, dataclass

import drivers.can  # noqa: F401 - first: it keeps from python-can what takes seconds to import

# isort: split
import can
import numpy as np

from drivers.clock import MonotonicClock

SYNC_ID = 0x080
ANSWER_ID = 0x181
PAYLOAD = struct.Struct("<II")  # index of the SYNC answered; how many SYNCs the peer has seen
PATIENCE_S = 3.0


@dataclass(frozen=True)
class Exchange:
    """What became of the SYNCs. Times are in seconds; `late` answers took more than one period."""

    sent: int
    answered: int
    in_order: bool
    seen_by_peer: int
    late: int
    round_trip_median_s: float
    round_trip_p99_s: float
    round_trip_max_s: float
    stamp_period_mean_s: float
    stamps_in_bracket: bool
    stamp_age_s: float
    unread_for_s: float


def main() -> None:
    """Be the sender (who starts the peer) or, with ``--peer``, the one who answers."""
    parser = argparse.ArgumentParser(prog="python -m tests.bus.exchange", description=__doc__)
    parser.add_argument("--channel", default="vcan0")
    parser.add_argument("--rate", type=float, default=500.0, metavar="HZ")
    parser.add_argument("--seconds", type=float, default=5.0, metavar="S")
    parser.add_argument("--peer", action="store_true", help="answer; ends 3 s after the last SYNC")
    arguments = parser.parse_args()
    if arguments.peer:
        answer(arguments.channel)
        return
    peer = [sys.executable, "-m", "tests.bus.exchange", "--peer", "--channel", arguments.channel]
    with subprocess.Popen(peer, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        if not process.stdout.readline():
            sys.exit("the peer has not started")
        result = exchange(arguments.channel, arguments.rate, arguments.seconds)
        process.terminate()
    sys.stdout.write(json.dumps(asdict(result)) + "\n")


def open_bus(channel: str, can_id: int) -> can.BusABC:
    """Return a SocketCAN bus that hears `can_id` alone."""
    only: can.typechecking.CanFilter = {"can_id": can_id, "can_mask": 0x7FF}
    return can.Bus(channel=channel, interface="socketcan", can_filters=[only], ignore_config=True)


def answer(channel: str) -> None:
    """Answer every SYNC until none has come for three seconds."""
    with open_bus(channel, SYNC_ID) as bus:
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        seen = 0
        while (sync := bus.recv(PATIENCE_S)) is not None:
            seen += 1
            data = PAYLOAD.pack(int.from_bytes(sync.data, "little"), seen)
            bus.send(can.Message(arbitration_id=ANSWER_ID, data=data, is_extended_id=False))


def exchange(channel: str, rate_hz: float, duration_s: float) -> Exchange:
    """Send SYNC at `rate_hz` for `duration_s` and account for every answer."""
    clock = MonotonicClock()
    count = round(rate_hz * duration_s)
    sent_s, sent_wall_s = np.zeros(count), np.zeros(count)
    answers: list[tuple[float, float, can.Message]] = []
    gc.collect()
    gc.freeze()

    def take(wait_s: float) -> bool:
        message = bus.recv(wait_s)
        if message is not None:
            answers.append((clock.now(), wall_s(), message))
        return message is not None

    with open_bus(channel, ANSWER_ID) as bus:
        start_s = clock.now() + 0.05
        for index in range(count):
            due_s = start_s + index / rate_hz
            while (left_s := due_s - clock.now()) > 0.0:
                take(left_s)
            sent_s[index], sent_wall_s[index] = clock.now(), wall_s()
            bus.send(_sync(index))
        while len(answers) < count and take(1.0):
            pass
        stamp_age_s, unread_for_s = _leave_unread(bus, clock, count)
    gc.unfreeze()

    index, seen = np.array([PAYLOAD.unpack(m.data) for _, _, m in answers], dtype=int).T
    stamps = np.array([m.timestamp for _, _, m in answers])
    round_trip_s = np.array([at for at, _, _ in answers]) - sent_s[index]
    heard_wall_s = np.array([at for _, at, _ in answers])
    return Exchange(
        sent=count,
        answered=len(answers),
        in_order=bool(np.array_equal(index, np.arange(len(answers)))),
        seen_by_peer=int(seen[-1]),
        late=int(np.sum(round_trip_s > 1.0 / rate_hz)),
        round_trip_median_s=float(np.median(round_trip_s)),
        round_trip_p99_s=float(np.quantile(round_trip_s, 0.99)),
        round_trip_max_s=float(np.max(round_trip_s)),
        stamp_period_mean_s=float((stamps[-1] - stamps[0]) / (len(stamps) - 1)),
        stamps_in_bracket=bool(np.all((sent_wall_s[index] <= stamps) & (stamps <= heard_wall_s))),
        stamp_age_s=stamp_age_s,
        unread_for_s=unread_for_s,
    )


def wall_s() -> float:
    """Return the wall time: the kernel stamps frames with it, so only it can bracket them."""
    return time.clock_gettime(time.CLOCK_REALTIME)


def _leave_unread(bus: can.BusABC, clock: MonotonicClock, index: int) -> tuple[float, float]:
    """Leave an answer unread for a while; return its stamp's age, and the while, in seconds.

    A stamp of the kernel is as old as the frame; one made while reading would be new.
    """
    begun_s = clock.now()
    bus.send(_sync(index))
    clock.sleep_until(begun_s + 0.2)
    message = bus.recv(1.0)
    if message is None:
        raise can.CanError("the frame left unread never came")
    return wall_s() - message.timestamp, clock.now() - begun_s


def _sync(index: int) -> can.Message:
    return can.Message(
        arbitration_id=SYNC_ID, data=index.to_bytes(4, "little"), is_extended_id=False
    )


if __name__ == "__main__":
    main()
