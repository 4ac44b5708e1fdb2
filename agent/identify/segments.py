"""Cut a velocity into pieces of constant level: optimal partitioning of block means.

Minimises ``sum of squared deviations from each piece's mean + penalty * pieces`` exactly
(Jackson et al., IEEE Signal Processing Letters 12 (2005) 105). It needs no start value, no unit
and no knowledge of how many levels there are. Ramps fall apart into short pieces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats


def partition(values: Floats, penalty: float) -> list[tuple[int, int]]:
    """Return the half-open index ranges of the optimal piecewise constant fit.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Block means.
    penalty : float
        What one more piece must gain in squared deviation, same unit squared.
    """
    n = values.shape[0]
    # Centred first: the sums of squares would otherwise cancel badly for a fast, quiet joint.
    centred = values - values.mean() if n else values
    total = np.concatenate(([0.0], np.cumsum(centred)))
    square = np.concatenate(([0.0], np.cumsum(centred * centred)))
    best = np.zeros(n + 1)
    best[0] = -penalty
    previous = np.zeros(n + 1, dtype=np.int64)
    reciprocal = 1.0 / np.arange(n, 0, -1, dtype=np.float64) if n else np.zeros(0)
    candidates = np.zeros(1, dtype=np.int64)
    for stop in range(1, n + 1):
        sums = total[stop] - total[candidates]
        cost = square[stop] - square[candidates] - sums * sums * reciprocal[n - stop + candidates]
        value = best[candidates] + cost
        choice = int(np.argmin(value))
        best[stop] = value[choice] + penalty
        previous[stop] = candidates[choice]
        # A start that is already worse than a new piece can never win later (PELT, Killick 2012).
        candidates = np.append(candidates[value <= best[stop]], stop)
    pieces = []
    stop = n
    while stop > 0:
        pieces.append((int(previous[stop]), stop))
        stop = int(previous[stop])
    return pieces[::-1]


@dataclass(frozen=True)
class Trend:
    """How a piece of velocity behaves: level, drift and bow over its length, scatter around them.

    From a fit of the first three Legendre polynomials over the piece.
    """

    level: float
    rise: float
    bow: float
    scatter: float

    def is_steady(self, samples: int, relative: float) -> bool:
        """Whether drift and bow are small against the level, or drown in the scatter.

        A ramp rises by far more than it scatters; stationary noise, coloured or not, does not.
        """
        drift = max(abs(self.rise), abs(self.bow))
        chance = 2.5 * np.sqrt(12.0 / samples)
        return bool(drift <= max(relative * abs(self.level), (0.8 + chance) * self.scatter))


def trend_of(values: Floats) -> Trend:
    """Return the trend of block means, shape (k,), k >= 1."""
    k = values.shape[0]
    level = float(np.mean(values))
    if k < 4:
        return Trend(level, float(values[-1] - values[0]), 0.0, 0.0)
    x = np.linspace(-1.0, 1.0, k)
    linear = x / np.sqrt(np.sum(x * x))
    curve = x * x - np.mean(x * x)
    curve /= np.sqrt(np.sum(curve * curve))
    deviation = values - level
    a, b = float(linear @ deviation), float(curve @ deviation)
    rest = deviation - a * linear - b * curve
    return Trend(
        level,
        a * float(linear[-1] - linear[0]),
        b * float(curve.max() - curve.min()),
        float(np.sqrt(np.sum(rest * rest) / max(k - 3, 1))),
    )


def merge_steady(
    values: Floats, pieces: list[tuple[int, int]], relative: float
) -> list[tuple[int, int]]:
    """Join neighbouring pieces as long as their union is still steady, closest levels first.

    Ripple and stick-slip make the optimal partition finer than the stair is.
    """
    merged = list(pieces)
    gaps = [_gap(values, merged, i, relative) for i in range(len(merged) - 1)]
    while gaps:
        i = int(np.argmin(gaps))
        if not np.isfinite(gaps[i]):
            break
        merged[i : i + 2] = [(merged[i][0], merged[i + 1][1])]
        del gaps[i]
        for j in (i - 1, i):
            if 0 <= j < len(gaps):
                gaps[j] = _gap(values, merged, j, relative)
    return merged


def _gap(values: Floats, pieces: list[tuple[int, int]], i: int, relative: float) -> float:
    """Return the distance of two neighbours' levels, infinite where their union is not steady."""
    (start, middle), (_, stop) = pieces[i], pieces[i + 1]
    joined = trend_of(values[start:stop])
    if stop - start < 4:
        return np.inf
    if not joined.is_steady(stop - start, relative):
        return np.inf
    return abs(float(values[start:middle].mean() - values[middle:stop].mean()))


def monotone_chain(levels: Floats, resolution: float) -> NDArray[np.bool_]:
    """Mark pieces that are single steps of a slow, coarsely quantised ramp, shape (k,).

    Such a piece lies between two neighbours, one below and one above, each within one and a half
    of the velocity's resolution.
    """
    out = np.zeros(levels.shape[0], dtype=np.bool_)
    if levels.shape[0] >= 3 and resolution > 0.0:
        step = np.diff(levels)
        small = np.abs(step) <= 1.5 * resolution
        out[1:-1] = small[:-1] & small[1:] & (step[:-1] * step[1:] > 0.0)
    return out
