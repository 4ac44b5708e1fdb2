"""Blocks of frames by `struct` and by NumPy: ``uv run python -m tests.benchmarks.blocks``.

Two who take from the ring, each by both, on blocks of the sizes that occur. *The tick* wants every
frame as a value in somebody's inbox: 2 at 500 Hz with one axis, 14 at 7000 frames/s, 28 beside a
hold-up. *The listener* (`stribeck bus`) wants counts, gaps and bits: 450 each 50 ms of a full bus.
Processor time a frame in turn in one process, best of seven, so that what else the machine does
weighs on all alike; the ratio is what to remember.

Those are loops that find everything in the caches. A tick wakes after two milliseconds of other
programs, so a second table has each way after such a sleep, the ways in random order: one axis's
frames alone, and among six times as many of other axes, which NumPy may sift out beforehand.
"""

from __future__ import annotations

import random
import statistics
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.can.frames import Frame
from drivers.can.routing import Routing
from drivers.can.traffic import SLOTS, Traffic, block_of
from drivers.can_reader.ring import SLOT, SLOT_BYTES
from drivers.clock import MonotonicClock

SIZES = (2, 14, 28, 256, 450, 1000)
RUNS, FRAMES_A_RUN = 7, 40_000
IDS = (0x080, 0x181, 0x201, 0x281)
OTHERS = (0x182, 0x282, 0x183, 0x283, 0x184, 0x284)
SLEEP_S, WAKES = 0.002, 4000
BOUNDS = (0.0, 0.0, 1e9)
"""Wall clock ahead by nothing; frames between the beginning and the end of time."""


def block(size: int, ids: tuple[int, ...] = IDS) -> bytes:
    """Return so many slots of a cycle at 7000 frames/s, which some identifiers take in turn."""
    times = [divmod(n * 142_857, 10**9) for n in range(size)]
    return b"".join(SLOT.pack(*t, ids[n % len(ids)], 8, bytes(8)) for n, t in enumerate(times))


class Sieve:
    """What nobody asks for left out by NumPy, the rest routed by `struct` (rejected, too)."""

    def __init__(self, routing: Routing) -> None:
        self._routing = routing
        self._is_wanted = np.zeros(0x801, np.bool_)  # the last: all that have flags
        self._is_wanted[[*IDS, 0x800]] = True
        self._passed = np.zeros(0x800, np.int64)

    def slots(self, slots: bytes) -> None:
        """Route a block."""
        count = len(slots) // SLOT_BYTES
        ids: NDArray[np.uint32] = np.ndarray((count,), "<u4", slots, 56, (SLOT_BYTES,))
        is_wanted = self._is_wanted.take(ids, mode="clip")
        chosen = is_wanted.nonzero()[0]
        if len(chosen) < count:
            np.add.at(self._passed, ids[~is_wanted], 1)
        rows = np.ndarray((count, SLOT_BYTES), np.uint8, slots).take(chosen, axis=0)
        self._routing.slots(rows.tobytes(), *BOUNDS)


def routed_by_numpy(slots: bytes, routing: Routing) -> None:
    """Route a block as `Routing.slots` does, decoded as one (the way that was rejected)."""
    seen = np.frombuffer(slots, SLOTS)
    wall_s = seen["seconds"] + seen["nanoseconds"] * 1e-9
    stamp_s = np.clip(wall_s - BOUNDS[0], *BOUNDS[1:]).tolist()
    ids, lengths = seen["can_id"].tolist(), seen["length"].tolist()
    for stamp, cob_id, length, data, wall in zip(
        stamp_s, ids, lengths, seen["data"], wall_s.tolist(), strict=True
    ):
        inbox = routing._routes.get(cob_id)
        if inbox is not None and length <= 8 and len(inbox.frames) < inbox.limit:
            inbox.frames.append(Frame(stamp, cob_id, data.tobytes()[:length], wall))


class OneByOne:
    """What `Traffic` counts, frame by frame in plain Python."""

    def __init__(self) -> None:
        self.frames: dict[int, list[float]] = {}
        self.bits = self.most = 0

    def add(self, slots: bytes) -> None:
        """Count more frames."""
        for seconds, nanoseconds, can_id, length, _data in SLOT.iter_unpack(slots):
            stamp_s = min(max(seconds + nanoseconds * 1e-9 - BOUNDS[0], BOUNDS[1]), BOUNDS[2])
            self.bits += 47 + 8 * length
            self.most += 47 + 8 * length + (33 + 8 * length) // 4
            entry = self.frames.get(can_id)
            if entry is None:
                self.frames[can_id] = [1, stamp_s, 0.0, 0.0, 0.0]
                continue
            gap_s = stamp_s - entry[1]
            entry[0] += 1
            entry[1] = stamp_s
            entry[2] += gap_s
            entry[3] += gap_s * gap_s
            entry[4] = max(entry[4], gap_s)


def microseconds(work: Callable[[], None], size: int) -> float:
    """Return the processor time a frame that one run takes."""
    repeats = max(1, FRAMES_A_RUN // size)
    began_s = time.process_time()
    for _ in range(repeats):
        work()
    return 1e6 * (time.process_time() - began_s) / (repeats * size)


def measured(size: int) -> list[float]:
    """Return the best of each way, in us a frame: tick and listener, each by both."""
    slots, routing = block(size), Routing("benchmark", wakes=False)
    inbox = routing.subscribe(IDS, limit=10_000)
    plain, traffic = OneByOne(), Traffic()

    def tick() -> None:
        routing.slots(slots, *BOUNDS)
        inbox.frames.clear()

    def tick_by_numpy() -> None:
        routed_by_numpy(slots, routing)
        inbox.frames.clear()

    def listener() -> None:
        plain.add(slots)

    def listener_by_numpy() -> None:
        traffic.add(block_of(slots, *BOUNDS))

    works = (tick, tick_by_numpy, listener, listener_by_numpy)
    rounds = [[microseconds(work, size) for work in works] for _ in range(RUNS)]
    return [min(times) for times in zip(*rounds, strict=True)]


def after_a_sleep(size: int, ids: tuple[int, ...]) -> list[float]:
    """Return the median of each way of a tick, in us a block: struct, NumPy's sieve before it."""
    clock, slots = MonotonicClock(), block(size, ids)
    routing = Routing("benchmark", wakes=False)
    inbox = routing.subscribe(IDS, limit=10_000)
    sieve = Sieve(routing)
    works = (lambda: routing.slots(slots, *BOUNDS), lambda: sieve.slots(slots))
    took_s: tuple[list[float], list[float]] = ([], [])
    for _ in range(WAKES):
        which = random.randrange(2)
        clock.sleep_until(clock.now() + SLEEP_S)
        began_s = time.thread_time()
        works[which]()
        took_s[which].append(time.thread_time() - began_s)
        inbox.frames.clear()
    return [1e6 * statistics.median(times) for times in took_s]


def main() -> None:
    """Print the tables."""
    print(
        f"{'frames':>7}{'tick, struct':>16}{'NumPy':>9}{'ratio':>7}"
        f"{'listener, struct':>20}{'NumPy':>9}{'ratio':>7}   (us of processor a frame)"
    )
    for size in SIZES:
        a, b, c, d = measured(size)
        print(f"{size:>7}{a:>16.2f}{b:>9.2f}{b / a:>7.2f}{c:>20.2f}{d:>9.2f}{d / c:>7.2f}")
    print(
        f"\n{'frames':>7}{'ours':>8}{'struct':>9}{'sieve':>9}   (us a block, after 2 ms of sleep)"
    )
    for size in (2, 14, 35, 256):
        for ids, said in ((IDS[:1], "all"), (IDS[:1] + OTHERS, "1 of 7")):
            plain, sifted = after_a_sleep(size, ids)
            print(f"{size:>7}{said:>8}{plain:>9.1f}{sifted:>9.1f}")


if __name__ == "__main__":
    main()
