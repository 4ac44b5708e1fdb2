"""Frames in memory that two processes share: one writes, one reads, neither waits.

The memory has no name (`memfd_create`), so a killed process cannot leave it behind. It holds a
page of counters and `capacity` slots; a slot is what `recvmmsg` delivers: the kernel's control
messages and a `struct can_frame`. `HEAD` and `TAIL` are the sequence numbers of the next frame to
be written and to be taken; they only rise. Each word has one writer and is one aligned machine
word, and a slot belongs to the writer until `HEAD` has passed it, to the reader until `TAIL` has.
"""

from __future__ import annotations

import mmap
import os
import struct
import sys
from typing import Final, Self

STAMP_BYTES = 56  # two control messages: struct timespec (32), drop counter (24)
FRAME_BYTES = 16  # struct can_frame
SLOT_BYTES = STAMP_BYTES + FRAME_BYTES

SLOT = struct.Struct("<16xqq24xIB3x8s")
"""A slot as the owner reads it: stamp's seconds and nanoseconds, identifier, length, data."""

_DROPS = struct.Struct("<48xI20x")
"""The kernel's drop counter; 0 as long as nothing was dropped."""

CAPACITY = 32768
"""Slots: 3.6 s of a full 1 Mbit/s bus (9009 frames/s), 2.4 MB."""

_HEADER_BYTES = mmap.PAGESIZE


class Word:
    """Which 8-byte word of the header is which counter.

    Plain numbers, not an `enum`: before Python 3.12 each look at a member of one is a call, and a
    tick that finds nothing does little else.
    """

    HEAD: Final = 0  # frames ever written
    TAIL: Final = 1  # frames ever taken: the only word of the owner's
    FULL: Final = 2  # how often there was no room
    ERRNO: Final = 3  # why the reader ended
    READY: Final = 4  # 1 once it receives


class Moment:
    """Which 8-byte word of the header is which monotonic time in seconds; all the reader's."""

    HEARD_UNTIL: Final = 8  # everything that came before is in the ring
    ALIVE: Final = 9


class FrameRing:
    """A view of the shared memory; the same class on both sides.

    Parameters
    ----------
    descriptor : int
        Of the memory; stays the caller's.
    capacity : int
        Slots.
    """

    def __init__(self, descriptor: int, capacity: int = CAPACITY) -> None:
        self.capacity = capacity
        self._memory = mmap.mmap(descriptor, _size(capacity))
        view = memoryview(self._memory)
        self._words = view[:_HEADER_BYTES].cast("Q")
        self._moments = view[:_HEADER_BYTES].cast("d")
        self.slots = view[_HEADER_BYTES:]

    @classmethod
    def make(cls, capacity: int = CAPACITY) -> tuple[Self, int]:
        """Return a new ring and the descriptor to hand to the other process; on Linux alone."""
        if sys.platform != "linux":
            raise NotImplementedError("memory without a name is Linux's own")
        descriptor = os.memfd_create("stribeck-frames")
        try:
            os.ftruncate(descriptor, _size(capacity))
            return cls(descriptor, capacity), descriptor
        except BaseException:
            os.close(descriptor)
            raise

    def word(self, which: int) -> int:
        """Return one counter, by `Word`."""
        return self._words[which]

    def set_word(self, which: int, value: int) -> None:
        """Set one counter; only the side that `Word` names may."""
        self._words[which] = value

    def moment_s(self, which: int) -> float:
        """Return one monotonic time in seconds, by `Moment`; 0 before it was first set."""
        return self._moments[which]

    def set_moment(self, which: int, value_s: float) -> None:
        """Set one monotonic time, in seconds, by `Moment`."""
        self._moments[which] = value_s

    def blank(self, first: int, count: int) -> None:
        """Set slots, not past the end of the memory, to zero."""
        self.slots[first * SLOT_BYTES : (first + count) * SLOT_BYTES] = bytes(count * SLOT_BYTES)

    def waiting(self) -> tuple[memoryview, ...]:
        """Return every slot that waits, oldest first, where it lies: none, one piece, or two.

        They are the reader's until `give_back`; let go of them before the ring is closed.
        """
        tail, head = self._words[Word.TAIL], self._words[Word.HEAD]
        if head == tail:
            return ()
        start, stop = tail % self.capacity * SLOT_BYTES, head % self.capacity * SLOT_BYTES
        if start < stop or not stop:
            return (self.slots[start : stop or None],)
        return (self.slots[start:], self.slots[:stop])

    def give_back(self, count: int) -> None:
        """Let the writer have so many of the slots that waited, the oldest, again."""
        self._words[Word.TAIL] += count

    def close(self) -> None:
        """Let go of the memory; whoever else holds it keeps it."""
        for view in (self._words, self._moments, self.slots):
            view.release()
        self._memory.close()


def drops_in(taken: bytes | memoryview) -> int:
    """Return the kernel's drop counter (modulo 2**32) as of the newest of these slots."""
    return int(_DROPS.unpack_from(taken, len(taken) - SLOT_BYTES)[0])


def _size(capacity: int) -> int:
    return _HEADER_BYTES + capacity * SLOT_BYTES
