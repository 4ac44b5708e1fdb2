"""The pace of a control loop: ticks that are not caught up, and a collector that keeps out."""

from __future__ import annotations

import contextlib
import gc
from collections.abc import Iterator

from drivers.clock import Clock

LEAST_REST = 0.5  # of a tick


def ticks(clock: Clock, tick_s: float) -> Iterator[float]:
    """Yield the present time once per tick; ticks that were missed are not caught up.

    One that was late is not followed before half a tick has passed since it was done: of two SYNCs
    that are closer than an answer usually takes, nobody can tell which was answered. Those after
    it are on time again.
    """
    due_s = clock.now()
    while True:
        yield clock.now()
        now_s = clock.now()
        due_s = max(due_s + tick_s, now_s)
        clock.sleep_until(max(due_s, now_s + LEAST_REST * tick_s))


@contextlib.contextmanager
def unhurried_collector() -> Iterator[None]:
    """Keep the garbage collector out of the control loop: one full pass can take 0.2 s."""
    enabled = gc.isenabled()
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.unfreeze()
        if enabled:
            gc.enable()
