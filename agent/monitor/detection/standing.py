"""Where each cycle stands against the baseline: in units of what one healthy cycle scatters.

The stated deviation of a cycle's feature is what its own recording and the compensation know. Two
healthy cycles differ by more (grease, rest, reference run), so the scatter is measured from the
baseline, robustly. Where the compensation reaches out of what it learned, its error is shared by
all cycles run there and does not average away: it is kept apart in `shared`, and a sum of
deviations must allow for it at every step. Where a series does not say which part is shared, what
a later cycle's stated deviation has beyond the baseline's usual one is taken for both: for noise
of its own, and for shared.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.compensation.kind import Kind
from agent.monitor.detection.decision import Marks
from agent.monitor.detection.series import FeatureSeries

FEWEST = 5
"""Cycles of a baseline below which a scatter is not worth the name."""

_MAD_TO_SIGMA = 1.4826
_OUTLIER = 4.0
_MOST_TIED = 0.8
_DOUBT = 20.0  # cycles: how fast a measured autocorrelation is believed
_TINY = 1e-9


@dataclass(frozen=True)
class Standing:
    """One feature against its baseline.

    Parameters
    ----------
    level : float
        The baseline's mean, outliers left out, in the feature's unit.
    scatter : float
        Standard deviation of one healthy cycle, in the feature's unit.
    cycles : int
        Of the baseline, those that count.
    autocorrelation : float
        Of neighbouring healthy cycles, 0 to 0.8, drawn to zero where the baseline is short.
    z : ndarray, shape (n,)
        Each cycle's distance from the level over that cycle's own deviation; NaN where missing.
    shared : ndarray, shape (n,)
        Deviation of the error shared with like cycles, in the same unit as z.
    own : ndarray, shape (n,)
        That unit: each cycle's own deviation, in the feature's unit.
    left_out : int
        Cycles of the baseline that do not count, for they lie too far off.
    borrowed : float
        As many cycles of joints of the same kind tell the scatter beside the joint's own.
    """

    level: float
    scatter: float
    cycles: int
    autocorrelation: float
    z: Floats
    shared: Floats
    own: Floats
    left_out: int = 0
    borrowed: float = 0.0

    def rise(self, allowance: float) -> Floats:
        """Return each cycle's rise over the level as a share, less what the shared error may be."""
        return (self.z - allowance * self.shared) * self.own / self.level

    @property
    def long_run(self) -> float:
        """Return how much more the mean of many cycles varies than if they were independent."""
        return (1.0 + self.autocorrelation) / (1.0 - self.autocorrelation)

    @property
    def level_deviation(self) -> float:
        """Return the standard deviation of the level, in the feature's unit."""
        return self.scatter * math.sqrt(self.long_run / self.cycles)


def standing(series: FeatureSeries, feature: str) -> Standing | None:
    """Return where each cycle stands, or None where the baseline has fewer than `FEWEST` cycles."""
    y, stated = series.values[feature], series.deviations[feature]
    healthy = y[: series.healthy]
    kept = np.isfinite(healthy)
    if kept.sum() < FEWEST:
        return None
    carried = int(kept.sum())
    kept &= ~_outliers(np.where(kept, healthy, np.nan))
    level = float(np.mean(healthy[kept]))
    shared = series.shared.get(feature, np.zeros_like(y))
    stated = np.sqrt(np.maximum(0.0, np.nan_to_num(stated) ** 2 - np.nan_to_num(shared) ** 2))
    usual = _usual(stated[: series.healthy][kept])
    scatter = max(
        float(np.std(healthy[kept], ddof=1)), 0.1 * usual, _TINY * abs(level), np.finfo(float).tiny
    )
    kind, free, borrowed = series.kinds.get(feature), float(kept.sum()) - 1.0, 0.0
    own_z = (healthy[kept] - level) / scatter
    tie = autocorrelation(own_z) if kind is None else _tie_beside(own_z, kind)
    if kind is not None and level > 0.0:
        free *= (1.0 - tie) / (1.0 + tie)
        borrowed = kind.borrowed(scatter / level, free)
        squares = free * scatter**2 + borrowed * (kind.scatter * level) ** 2
        scatter = math.sqrt(squares / (free + borrowed))
    beyond = np.maximum(0.0, stated**2 - usual**2)
    own = np.sqrt(scatter**2 + beyond)
    if feature not in series.shared:
        shared = np.sqrt(beyond)
    return Standing(
        level,
        scatter,
        int(kept.sum()),
        tie,
        (y - level) / own,
        np.nan_to_num(shared) / own,
        own,
        carried - int(kept.sum()),
        borrowed,
    )


def _usual(stated: Floats) -> float:
    known = stated[np.isfinite(stated)]
    return float(np.median(known)) if known.size else 0.0


def _outliers(healthy: Floats) -> Marks:
    """Return which healthy cycles lie too far off to belong to the level, NaN being none."""
    centre = np.nanmedian(healthy)
    spread = _MAD_TO_SIGMA * np.nanmedian(np.abs(healthy - centre))
    far: Marks = np.abs(healthy - centre) > _OUTLIER * max(spread, np.finfo(float).tiny)
    return far


def autocorrelation(z: Floats) -> float:
    """Return the correlation of neighbours, 0 to 0.8, of n residuals about their own mean.

    The estimate's bias, -(1 + 4 phi) / n, is taken back, and n / (n + 20) of it is believed.
    """
    n = z.size
    return float(np.clip(shown_tie(z) * n / (n + _DOUBT), 0.0, _MOST_TIED))


def shown_tie(z: Floats) -> float:
    """Return the correlation of neighbours that n residuals about their own mean show."""
    n = z.size
    power = float(z @ z)
    if n < 4 or power <= 0.0:
        return 0.0
    raw = float(z[1:] @ z[:-1]) / power
    return (raw + 1.0 / n) / (1.0 - 4.0 / n) if n > 8 else raw


def _tie_beside(z: Floats, kind: Kind) -> float:
    """Return the correlation of neighbours, drawn to that of joints of the same kind."""
    n, shown = z.size, shown_tie(z)
    borrowed = kind.tie_borrowed(shown, n)
    doubt = _DOUBT * (1.0 - borrowed / kind.tie_worth)
    drawn = (n * shown + borrowed * kind.tie) / (n + borrowed + doubt)
    return float(np.clip(drawn, 0.0, _MOST_TIED))
