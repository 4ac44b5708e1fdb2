"""What a short baseline leaves open, and the CUSUM that finds a rise soonest under it.

Everything is in units of the scatter that the baseline shows. What it leaves open is a set of
equally likely joints (`Doubt`): each is off by its own offset of the level and scatters by its own
scale. A threshold keeps the rate of false alarms that is expected over all of them; of several
drifts, the one that then finds the rise soonest, expected over all of them too, is taken.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2, norm

from agent.identify.result import Floats
from agent.monitor.detection.run_length import siegmund

_DRIFTS = np.linspace(0.4, 0.95, 8)  # of the rise
_LARGEST = 200.0  # threshold over scatter
_NEVER_CYCLES = 300.0  # a delay counts as no longer than this


@dataclass(frozen=True)
class Doubt:
    """Equally likely joints, each of shape (draws,), in units of the estimated scatter.

    `offset` is by how much the level lies below the estimated one, `scale` the scatter, that of
    neighbours which are alike included.
    """

    offset: Floats
    scale: Floats

    def rates(self, drift: Floats, threshold: Floats, per_year: float) -> Floats:
        """Return false alarms in a year, shape (drifts, draws)."""
        run = siegmund((self.offset - drift[:, None]) / self.scale, threshold[:, None] / self.scale)
        return per_year / run

    def delays(self, rise: float, drift: Floats, threshold: Floats) -> Floats:
        """Return the expected delay after a lasting rise, shape (drifts,)."""
        run = siegmund(
            (rise + self.offset - drift[:, None]) / self.scale, threshold[:, None] / self.scale
        )
        return np.asarray(np.mean(np.minimum(run, _NEVER_CYCLES), axis=1))


@functools.lru_cache(maxsize=256)
def doubt_of(cycles: int, long_run: float, borrowed: float = 0.0) -> Doubt:
    """Return what a baseline leaves open, at the quantiles of both laws.

    Parameters
    ----------
    cycles : int
        Healthy ones.
    long_run : float
        How much more the mean of many varies than if they were independent (`Standing.long_run`).
    borrowed : float
        As many cycles of others tell the scatter beside them, and never the level.
    """
    worth = max(2.0, cycles / long_run)
    free = worth - 1.0 + borrowed
    middle = (np.arange(11) + 0.5) / 11.0
    scale = np.sqrt(free / chi2.ppf((np.arange(7) + 0.5) / 7.0, free))
    offset = norm.ppf(middle)[:, None] * scale[None, :] / np.sqrt(worth)
    return Doubt(offset.ravel(), np.broadcast_to(scale * np.sqrt(long_run), offset.shape).ravel())


class Soonest(NamedTuple):
    """The drift and threshold that find a rise soonest, and how soon, in cycles."""

    drift: float
    threshold: float
    delay: float


def soonest(doubt: Doubt, rise: float, rate: float, per_year: float) -> Soonest:
    """Return the CUSUM of a few drifts that finds a rise soonest; its delay may be infinite.

    Parameters
    ----------
    doubt : Doubt
    rise : float
        In scatters.
    rate : float
        Expected false alarms in a year that are accepted.
    per_year : float
        Cycles.
    """
    drifts = _DRIFTS * rise
    lines = thresholds(doubt, drifts, rate, per_year)
    delays = np.where(np.isfinite(lines), doubt.delays(rise, drifts, lines), np.inf)
    best = int(np.argmin(delays))
    return Soonest(float(drifts[best]), float(lines[best]), float(delays[best]))


def thresholds(doubt: Doubt, drifts: Floats, rate: float, per_year: float) -> Floats:
    """Return the smallest threshold that keeps the expected rate, shape (drifts,), or infinity."""
    low, high = np.zeros_like(drifts), np.full_like(drifts, _LARGEST)
    reachable = np.mean(doubt.rates(drifts, high, per_year), axis=1) <= rate
    for _ in range(26):
        middle = 0.5 * (low + high)
        too_many = np.mean(doubt.rates(drifts, middle, per_year), axis=1) > rate
        low, high = np.where(too_many, middle, low), np.where(too_many, high, middle)
    return np.where(reachable, high, np.inf)
