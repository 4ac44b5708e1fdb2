"""The reader process: frames from a socket into shared memory, and nothing else.

``python -m drivers.can_reader.reader SOCKET RING LIFELINE CAPACITY``, the first three of them
inherited descriptors. It ends when the other end of the lifeline is closed, which the kernel does
for an owner that was killed. It decides nothing, decodes nothing, logs nothing and takes no lock.

It waits for a frame, naps so that those that follow come along in the same system call, and takes
them all: an answer to SYNC is in the ring at most some `NAP_S` after it came. On a busy bus, where
a wake-up for each few frames would cost more than the frames, it naps for `BUSY_NAP_S` instead,
and takes the end of a nap for the time: a nap and a receiving call are all that a batch costs. The
kernel's stamps do not depend on any of this.
"""

from __future__ import annotations

import ctypes
import gc
import select
import signal
import sys

from drivers.can_reader.batches import BatchReceiver
from drivers.can_reader.ring import FrameRing, Moment, Word
from drivers.clock import Clock, MonotonicClock

NAP_S = 0.0003
BUSY_NAP_S = 0.005
BUSY_FRAMES = 4
"""From so many frames at once on, the bus counts as busy: one axis answers a SYNC with two."""

_PR_SET_PDEATHSIG = 1  # linux/prctl.h

LOOK_EVERY_S = 0.01
"""So often, at least, it says that it is there itself."""

BUSY_LOOK_EVERY_S = 0.05
"""On a busy bus it looks so often whether its owner is still there, and what time it is."""


def drain(receiver: BatchReceiver, ring: FrameRing, clock: Clock, passed_s: float) -> int:
    """Take everything that waits, say until when that was, and return how many frames came.

    Parameters
    ----------
    passed_s : float
        A time that has passed, by the clock: the end of a nap will do. To ask for the time once
        more would cost as much as a frame where a system call is dear.
    """
    total = 0
    while True:
        ring.set_moment(Moment.ALIVE, passed_s)
        count = receiver.receive()
        total += count
        if receiver.emptied:
            ring.set_moment(Moment.HEARD_UNTIL, passed_s)
        if receiver.emptied or not count:
            return total
        passed_s = clock.now()


def read_until_let_go(socket_fd: int, ring: FrameRing, lifeline_fd: int, clock: Clock) -> None:
    """Read until the lifeline's other end is closed.

    Raises
    ------
    OSError
        When the socket fails.
    """
    if sys.platform != "linux":
        raise NotImplementedError("several frames with one call are Linux's own")
    receiver = BatchReceiver(socket_fd, ring)
    poller = select.poll()
    poller.register(socket_fd, select.POLLIN)
    poller.register(lifeline_fd, select.POLLIN)
    look_s = passed_s = clock.now()
    ring.set_moment(Moment.ALIVE, passed_s)
    ring.set_moment(Moment.HEARD_UNTIL, passed_s)
    ring.set_word(Word.READY, 1)
    while True:
        is_busy = drain(receiver, ring, clock, passed_s) >= BUSY_FRAMES
        if is_busy and passed_s < look_s:
            passed_s += BUSY_NAP_S
            clock.sleep_until(passed_s)
            continue
        waiting = poller.poll(LOOK_EVERY_S * 1000.0)
        if any(descriptor == lifeline_fd for descriptor, _ in waiting):
            return
        passed_s = clock.now()
        look_s = passed_s + BUSY_LOOK_EVERY_S
        if waiting:
            passed_s += BUSY_NAP_S if is_busy else NAP_S
            clock.sleep_until(passed_s)


def main() -> int:
    """Be the process; the exit code is 0 when it was let go, 1 when the socket failed."""
    socket_fd, ring_fd, lifeline_fd, capacity = (int(a) for a in sys.argv[1:5])
    _die_with_the_owner()
    ring = FrameRing(ring_fd, capacity)
    gc.disable()
    try:
        read_until_let_go(socket_fd, ring, lifeline_fd, MonotonicClock())
    except OSError as error:
        ring.set_word(Word.ERRNO, error.errno or 0)
        return 1
    return 0


def _die_with_the_owner() -> None:
    """Ask the kernel to end this process with its owner, even while somebody has stopped it."""
    if sys.platform != "linux":
        return
    if ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0):
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_PDEATHSIG)")


if __name__ == "__main__":
    sys.exit(main())
