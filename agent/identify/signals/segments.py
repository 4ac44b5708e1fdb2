"""Cut a velocity into pieces of constant level: optimal partitioning of block means.

Minimises ``sum of squared deviations from each piece's mean + penalty * pieces`` exactly
(Jackson et al., IEEE Signal Processing Letters 12 (2005) 105). It needs no start value, no unit
and no knowledge of how many levels there are. Ramps fall apart into short pieces.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats


def partition(values: Floats, penalty: float, *, compiled: bool = False) -> list[tuple[int, int]]:
    """Return the half-open index ranges of the optimal piecewise constant fit.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Block means.
    penalty : float
        What one more piece must gain in squared deviation, same unit squared.
    compiled : bool
        For whoever has loaded numba: the same in a thirtieth of the time. Loading it takes longer
        than a few recordings do without.
    """
    n = values.shape[0]
    # Centred first: the sums of squares would otherwise cancel badly for a fast, quiet joint.
    centred = values - values.mean() if n else values
    total = np.concatenate(([0.0], np.cumsum(centred)))
    square = np.concatenate(([0.0], np.cumsum(centred * centred)))
    reciprocal = 1.0 / np.arange(n, 0, -1, dtype=np.float64) if n else np.zeros(0)
    if compiled:
        from agent.identify.signals.segments_kernel import starts_of

        previous = starts_of(total, square, reciprocal, penalty)
    else:
        previous = _starts_of(total, square, reciprocal, penalty)
    pieces = []
    stop = n
    while stop > 0:
        pieces.append((int(previous[stop]), stop))
        stop = int(previous[stop])
    return pieces[::-1]


def _starts_of(
    total: Floats, square: Floats, reciprocal: Floats, penalty: float
) -> NDArray[np.int64]:
    """Return where the piece begins that ends at each place; see `segments_kernel`."""
    n = total.shape[0] - 1
    best = np.zeros(n + 1)
    best[0] = -penalty
    previous = np.zeros(n + 1, dtype=np.int64)
    candidates = np.zeros(1, dtype=np.int64)
    for stop in range(1, n + 1):
        sums = total[stop] - total[candidates]
        cost = square[stop] - square[candidates] - sums * sums * reciprocal[n - stop + candidates]
        value = best[candidates] + cost
        choice = int(np.argmin(value))
        best[stop] = value[choice] + penalty
        previous[stop] = candidates[choice]
        # A start that is already worse than a new piece can never win later (PELT, Killick 2012).
        candidates = np.concatenate((candidates[value <= best[stop]], (stop,)))
    return previous


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
    shapes, spans = _line_and_bow(k)
    deviation = values - level
    found = shapes @ deviation
    rest = deviation - found @ shapes
    rise, bow = (found * spans).tolist()
    return Trend(level, rise, bow, float(np.sqrt(rest @ rest / max(k - 3, 1))))


@lru_cache(maxsize=512)
def _line_and_bow(count: int) -> tuple[Floats, Floats]:
    """Return a line and a parabola over `count` blocks, of unit length and without a mean.

    Returns
    -------
    shapes : ndarray, shape (2, count)
    spans : ndarray, shape (2,)
        How far each rises.
    """
    x = np.linspace(-1.0, 1.0, count)
    shapes = np.stack((x, x * x - np.mean(x * x)))
    shapes /= np.sqrt(np.sum(shapes * shapes, axis=1, keepdims=True))
    spans = np.array([shapes[0, -1] - shapes[0, 0], np.ptp(shapes[1])])
    shapes.flags.writeable = spans.flags.writeable = False
    return shapes, spans


def merge_steady(
    values: Floats, pieces: list[tuple[int, int]], relative: float
) -> list[tuple[int, int]]:
    """Join neighbouring pieces as long as their union is still steady, closest levels first.

    Ripple and stick-slip make the optimal partition finer than the stair is.
    """
    merged = list(pieces)
    gaps = np.array([_gap(values, merged, i, relative) for i in range(len(merged) - 1)])
    while gaps.size:
        i = int(np.argmin(gaps))
        if not np.isfinite(gaps[i]):
            break
        merged[i : i + 2] = [(merged[i][0], merged[i + 1][1])]
        gaps = np.delete(gaps, i)
        for j in (i - 1, i):
            if 0 <= j < gaps.size:
                gaps[j] = _gap(values, merged, j, relative)
    return merged


def _gap(values: Floats, pieces: list[tuple[int, int]], i: int, relative: float) -> float:
    """Return the distance of two neighbours' levels, infinite where their union is not steady."""
    (start, middle), (_, stop) = pieces[i], pieces[i + 1]
    if stop - start < 4 or not trend_of(values[start:stop]).is_steady(stop - start, relative):
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
