"""Before other programs: who feeds a drive 500 times a second is run first, where that is allowed.

A drive's watchdog and every deadline of a cycle are real; a page, its viewers and an estimate can
wait. Nice values do not say that: Linux divides processor time between sessions first (sched(7),
autogroup), and each program that is started by itself is one. So the cycle asks for ``SCHED_FIFO``
at a low priority: before every ordinary program, behind the kernel's own threads. The process that
reads the bus inherits it. The kernel keeps a twentieth of each second for the others
(``sched_rt_runtime_us``), so that even a cycle that hangs takes no machine away.

It needs CAP_SYS_NICE or a limit ``rtprio``. Without, and on other systems, everything is as it was.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

PRIORITY = 10
"""Of 1 to 99; interrupts of a kernel with threads for them are at 50."""


@contextlib.contextmanager
def before_others(priority: int = PRIORITY) -> Iterator[None]:
    """Run this process before ordinary ones while the context lasts, where that is allowed.

    Threads that live already are taken along: one that held the interpreter's lock and was not run
    would hold up the control tick. Who was started with a policy of their own keeps it.

    Parameters
    ----------
    priority : int
        As sched(7) has it, 1 to 99.
    """
    if not _is_ordinary():
        yield
        return
    _give_all_threads("SCHED_FIFO", priority)
    try:
        yield
    finally:
        _give_all_threads("SCHED_OTHER", 0)


def scheduling() -> str:
    """Return how the calling thread is scheduled now, in the words of sched(7)."""
    if sys.platform != "linux":
        return "ordinary"
    words = {os.SCHED_FIFO: "SCHED_FIFO", os.SCHED_RR: "SCHED_RR", os.SCHED_BATCH: "SCHED_BATCH"}
    policy = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK
    if policy not in words:
        return "ordinary"
    priority = os.sched_getparam(0).sched_priority
    return f"{words[policy]} {priority}" if priority else words[policy]


def _is_ordinary() -> bool:
    return sys.platform == "linux" and os.sched_getscheduler(0) == os.SCHED_OTHER


def _give_all_threads(policy: str, priority: int) -> None:
    """Set the policy of every thread of this process, where that is allowed."""
    if sys.platform != "linux":
        return
    for thread in Path("/proc/self/task").iterdir():
        # not allowed, or the thread has just ended: what is so is read back by `scheduling`
        with contextlib.suppress(OSError):
            os.sched_setscheduler(int(thread.name), getattr(os, policy), os.sched_param(priority))
