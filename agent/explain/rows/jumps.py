"""How a torque jumps at the corners of a speed, and by how many samples after them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.rows.corner import Corner
from agent.identify.result import Floats

_OF_NOISE = 4.0  # times its own noise: a jump of the torque that tells on which side a sample is
_OFF = 0.25  # of the jump: how far such a sample of the torque is from either side of it
_MOSTLY = 0.7  # of the corners: there the torque has to jump from one sample to the next
FEWEST = 3  # corners that tell how it does
_SEEN = 0.4  # ... and where the motion has its corner: it may be a sample off, but not mostly
_MOST_LATE = 8  # samples that it may do so after the motion
_SECOND = 6.0**0.5  # of white noise, its second differences


@dataclass(frozen=True)
class Jumps:
    """How a torque goes through its jumps.

    Parameters
    ----------
    torque_nm : ndarray, shape (n,)
    least_nm : float
        A jump that is smaller tells nothing.
    """

    torque_nm: Floats
    least_nm: float

    @classmethod
    def of(cls, torque_nm: Floats) -> Jumps:
        """Return those of a torque, shape (n,), that are clear of its noise from row to row."""
        noise_nm = float(np.median(np.abs(np.diff(torque_nm, n=2)))) / (0.6745 * _SECOND)
        return cls(torque_nm, _OF_NOISE * noise_nm)

    def share(self, at: int, first: int, last: int) -> float | None:
        """Return how much of a jump around some samples is over at one; None for no jump."""
        if first < 1 or last + 1 >= self.torque_nm.shape[0]:
            return None
        before, after = float(self.torque_nm[first - 1]), float(self.torque_nm[last + 1])
        if not abs(after - before) > self.least_nm:
            return None
        return (float(self.torque_nm[at]) - before) / (after - before)

    def refined(self, corner: Corner, late: int) -> Corner:
        """Return where it jumps at a corner, or beside it: a speed is filtered, or comes late."""
        if self.is_sharp(corner, late):
            return corner
        splits = (Corner(corner.at + by, True) for by in (0, -1, 1))
        halves = (Corner(corner.at + by, False) for by in (0, 1, -1))
        return next((c for c in (*splits, *halves) if self.is_sharp(c, late)), corner)

    def pulse(self, first: int, last: int) -> tuple[int, int] | None:
        """Return the samples between two that a pulse takes, as sharp at either end; else None."""
        if first < 2 or last + 3 > self.torque_nm.shape[0]:
            return None
        part = self.torque_nm[first - 1 : last + 2]
        over = part - np.linspace(float(part[0]), float(part[-1]), part.shape[0])
        height = float(over[np.argmax(np.abs(over))])
        if not abs(height) > self.least_nm:
            return None
        share = over / height
        within = np.flatnonzero(share > 0.5)
        clear = np.all((share < _OFF) | (share > 1.0 - _OFF))
        if not clear or within[-1] - within[0] + 1 != within.shape[0]:
            return None
        return first - 1 + int(within[0]), first - 1 + int(within[-1])

    def is_there(self, corner: Corner) -> bool:
        """Return whether it jumps at a corner, at once or a little later."""
        first, last = corner.at - 1, min(corner.after + _MOST_LATE + 1, self.torque_nm.shape[0] - 1)
        return abs(float(self.torque_nm[last] - self.torque_nm[first])) > self.least_nm

    def is_sharp(self, corner: Corner, late: int) -> bool:
        """Return whether it jumps from one sample to the next, at a corner and so much later."""
        first, last = corner.at + late, corner.after + late
        begins, ends = self.share(first, first, last), self.share(last, first, last)
        if begins is None or ends is None or not 2 <= first <= self.torque_nm.shape[0] - 4:
            return False
        # It is over where the corner is: a filtered torque would go on to change.
        further = self.share(first - 2, first, last), self.share(last + 2, first, last)
        over = all(x is not None and min(abs(x), abs(1.0 - x)) < _OFF for x in further)
        return over and (not corner.between or (abs(begins) < _OFF and abs(1.0 - ends) < _OFF))


def late_of(corners: Sequence[Corner], jumps: Jumps) -> int | None:
    """Return by how many samples the torque jumps after the motion; None where it does not jump."""
    told = [corner for corner in corners if jumps.is_there(corner)]
    if len(told) < FEWEST:
        return None
    shares = [
        float(np.mean([jumps.is_sharp(corner, late) for corner in told]))
        for late in range(_MOST_LATE + 1)
    ]
    best = int(np.argmax(shares))
    sharp = [jumps.is_sharp(jumps.refined(corner, best), best) for corner in told]
    return best if shares[best] >= _SEEN and float(np.mean(sharp)) >= _MOSTLY else None
