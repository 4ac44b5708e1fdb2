"""Where a speed has corners, and the short ramps between two of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats

_SHARP, _CLEAR = 3.5, 5.0  # times what the speed bends by at the samples around, and its noise
_ROUNDED = 1e-9  # of the greatest speed: what bends by less was rounded
_ALONE = 3  # samples on either side of a corner that another one keeps away from
AT_A_SAMPLE = 0.03  # of a sample: a corner that is no further from it is there
_UNSURE = 1.5  # times the noise over the jump, of a sample: where a corner may be as well
STANDS = 1e-3  # of the greatest speed
_SHORT = 8  # samples: a ramp that is longer has corners that stand alone
_BACK = 0.2  # of a ramp's corners together: how much more one of them bends than the other


@dataclass(frozen=True)
class Corner:
    """Where a speed has a corner: at a sample, or between it and the next."""

    at: int
    between: bool

    @property
    def after(self) -> int:
        """Return the first sample that is not before it."""
        return self.at + self.between


@dataclass(frozen=True)
class Ramp:
    """A ramp whose corners do not stand alone: the samples around it, and by what it changes."""

    first: int
    last: int
    change: float


def _bends(speed: Floats) -> tuple[Floats, float, float]:
    """Return by how much a speed bends at its samples, the noise of that, and the least corner."""
    bends = np.zeros_like(speed)
    bends[1:-1] = np.diff(speed, n=2)
    noise = float(np.median(np.abs(bends))) / 0.6745
    return bends, noise, max(_CLEAR * noise, _ROUNDED * float(np.max(np.abs(speed), initial=0.0)))


def ramps_of(speed: Floats, begins: int) -> list[Ramp]:
    """Return what a speed changes by within a few samples, between stretches that do not bend.

    Parameters
    ----------
    speed : ndarray, shape (m,)
    begins : int
        How many samples of the motion are before the first one of the speed, half ones up.
    """
    bends, _, least = _bends(speed)
    standing = STANDS * float(np.max(np.abs(speed), initial=0.0))
    bent = np.flatnonzero(np.abs(bends) > 0.5 * least)
    out, margin = list[Ramp](), _ALONE + 2
    for group in np.split(bent, np.flatnonzero(np.diff(bent) > _ALONE) + 1):
        if group.shape[0] < 2 or group[-1] - group[0] > _SHORT:
            continue
        first, last = int(group[0]) - 1, int(group[-1]) + 1
        if first < margin or last >= speed.shape[0] - margin:
            continue
        own = bends[group]
        alike = abs(float(own.sum())) < _BACK * float(np.abs(own).sum())
        moves = min(abs(speed[first]), abs(speed[last])) > standing
        if alike and moves and float(np.abs(own).max()) > least:
            line = 0.5 * (speed[first] - speed[first - 1] + speed[last + 1] - speed[last])
            change = float(speed[last] - speed[first] - line * (last - first))
            out.append(Ramp(first, last + begins, change))
    return out


def corners_of(speed: Floats, begins: float) -> list[Corner]:
    """Return the corners of a speed that stand alone, in the order of time.

    Parameters
    ----------
    speed : ndarray, shape (m,)
    begins : float
        When the first of its samples is, in samples.
    """
    bends, noise, least = _bends(speed)
    size = np.abs(bends)
    margin, out = _ALONE + 2, list[Corner]()
    for k in np.flatnonzero(size > 0.5 * least).tolist():
        # At the end one more, as the torque may have it a sample later.
        if not margin <= k < speed.shape[0] - margin - 1 or size[k] < max(size[k - 1 : k + 2]):
            continue
        own = np.maximum(bends[k - 1 : k + 2] * np.sign(bends[k]), 0.0)
        jump = float(own.sum())
        around = max(size[k - 1 - _ALONE : k - 1].max(), size[k + 2 : k + 2 + _ALONE].max())
        if not jump > max(least, _SHARP * around):
            continue
        at = begins + k + float(own[2] - own[0]) / jump
        between = abs(at - round(at)) > max(AT_A_SAMPLE, _UNSURE * noise / jump)
        corner = Corner(math.floor(at) if between else round(at), between)
        if not out or corner.at > out[-1].at + _ALONE:
            out.append(corner)
    return out


def moves(speed: Floats, before: int, after: int) -> bool:
    """Return whether a speed is more than a standstill's at two of its samples, and of one sign."""
    least = STANDS * float(np.max(np.abs(speed), initial=0.0))
    return bool(speed[before] * speed[after] > least**2)
