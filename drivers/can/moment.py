"""The injected and the wall clock of one moment: what a kernel's stamp is moved by."""

from __future__ import annotations

import math
import time

from drivers.clock import Clock

_CLOSE_S = 5e-6
_READINGS = 3


class BothClocks:
    """Reads the two clocks together, as closely as this machine can.

    The wall clock is read between two readings of the other one, and what lies between those two is
    how wrong the pair may be. Whoever is interrupted there tries again, and the closest pair
    counts. 5 us are close; so is, where reading the time is a system call that costs more than
    that, twice what the closest pair ever took: there a second try costs as much as the frames that
    it is for, and comes no closer.

    Parameters
    ----------
    clock : Clock
        The machine's monotonic one.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._closest_s = 0.0  # not known yet: then only what is close counts as close

    def read(self) -> tuple[float, float]:
        """Return the injected and the wall clock of the same moment, in seconds."""
        now = self._clock.now
        best = (math.inf, 0.0, 0.0)
        for _ in range(_READINGS):
            before_s = now()
            wall_s = time.clock_gettime(time.CLOCK_REALTIME)  # to read the kernel's stamps, only
            width_s = now() - before_s
            best = min(best, (width_s, before_s + width_s / 2.0, wall_s))
            if width_s < max(_CLOSE_S, 2.0 * self._closest_s):
                break
        self._closest_s = min(self._closest_s or math.inf, best[0])
        return best[1], best[2]
