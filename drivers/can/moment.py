"""The injected and the wall clock of one moment: what a kernel's stamp is moved by."""

from __future__ import annotations

import math
import time

from drivers.clock import Clock

_CLOSE_S = 5e-6
_READINGS = 3
_DRIFT = 1e-5  # the kernel steers both alike; this is beyond what is left


class BothClocks:
    """Reads the two clocks together, as closely as this machine can.

    The wall clock is read between two readings of the other one, and what lies between those two is
    how wrong the pair may be. Whoever is interrupted there tries again, and the closest pair
    counts. 5 us are close; so is, where reading the time is a system call that costs more than
    that, twice what the closest pair ever took: there a second try costs as much as the frames that
    it is for, and comes no closer.

    How far the clocks are apart changes only when somebody sets the wall clock, or by a little as
    they drift. So where a pair is wider than that and contradicts nothing, the closest one before
    it goes on counting: else a computer that stands still moves stamps by half of that time.

    Parameters
    ----------
    clock : Clock
        The machine's monotonic one.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._closest_s = 0.0  # not known yet: then only what is close counts as close
        self._apart_s = 0.0
        self._apart_open_s = math.inf  # so much wider or closer they may be
        self._apart_at_s = 0.0

    def read(self) -> tuple[float, float]:
        """Return the injected and the wall clock of the same moment, in seconds."""
        now = self._clock.now
        best, after_s = (math.inf, 0.0, 0.0), 0.0
        for _ in range(_READINGS):
            before_s = now()
            wall_s = time.time()  # noqa: TID251 - to read the kernel's stamps, only
            after_s = now()
            width_s = after_s - before_s
            best = min(best, (width_s, before_s + width_s / 2.0, wall_s))
            if width_s < max(_CLOSE_S, 2.0 * self._closest_s):
                break
        width_s, middle_s, wall_s = best
        self._closest_s = min(self._closest_s or math.inf, width_s)
        return after_s, after_s + self._apart(middle_s, wall_s - middle_s, width_s / 2.0)

    def _apart(self, now_s: float, apart_s: float, open_s: float) -> float:
        """Return by how much the wall clock is ahead: as just read, or as known more closely."""
        known_open_s = self._apart_open_s + _DRIFT * abs(now_s - self._apart_at_s)
        agree = abs(apart_s - self._apart_s) <= open_s + known_open_s
        if open_s <= known_open_s or not agree:
            self._apart_s, self._apart_open_s, self._apart_at_s = apart_s, open_s, now_s
        return self._apart_s
