"""Few points instead of many, for lines that look the same: no peak lost, no gap bridged."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats

_GAP_STEPS, _GAP_NEIGHBOURS = 10.0, 3.0
_LEAST_PER_STRETCH = 4


def extremes(values: Floats, bins: int) -> NDArray[np.intp]:
    """Return the indices that keep a line's look when only so many points can be drawn.

    Each of `bins` equal stretches of the array gives its smallest and its largest sample, in the
    order in which they occur, so that no peak is lost; first and last sample are always kept. A
    stretch without a finite sample gives one that is not finite: a gap stays a gap.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The line's ordinates, in any unit.
    bins : int
        Number of stretches; at most 2 bins + 2 indices come back.
    """
    count = values.shape[0]
    if count <= 2 * bins:
        return np.arange(count)
    edges = np.linspace(0, count, bins + 1).astype(np.intp)
    width = int(np.diff(edges).max())
    # Rows of equal width: a short stretch repeats its last sample, which changes no extreme.
    index = np.minimum(edges[:-1, None] + np.arange(width), edges[1:, None] - 1)
    stretch = values[index]
    finite = np.isfinite(stretch)
    row = np.arange(bins)
    lowest = index[row, np.argmin(np.where(finite, stretch, np.inf), axis=1)]
    highest = index[row, np.argmax(np.where(finite, stretch, -np.inf), axis=1)]
    return np.unique(np.concatenate((lowest, highest, [0, count - 1])))


def gaps(time_s: Floats) -> NDArray[np.bool_]:
    """Tell after which samples others are missing, so that a line must be broken there.

    A step in time is a gap when it is far longer than usual and than its neighbours: slower
    sampling, where every step is long, is none.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Finite and rising, n > 1.

    Returns
    -------
    ndarray of bool, shape (n - 1,)
    """
    steps = np.diff(time_s)
    beside = np.pad(steps, 1)
    neighbours = np.maximum(beside[:-2], beside[2:])
    return (steps > _GAP_STEPS * np.median(steps)) & (steps > _GAP_NEIGHBOURS * neighbours)


def polyline(time_s: Floats, values: Floats, bins: int) -> tuple[Floats, Floats]:
    """Return a line's points as drawn: thinned by `extremes`, broken where samples are missing.

    Parameters
    ----------
    time_s, values : ndarray, shape (n,)
        Seconds, and ordinates in any unit.
    bins : int
        As in `extremes`.

    Returns
    -------
    tuple of ndarray, shape (m,)
        Time and value; a break is a NaN in both.
    """
    kept = extremes(values, bins)
    piece = np.concatenate(([0], np.cumsum(gaps(time_s))))
    breaks = np.flatnonzero(np.diff(piece[kept])) + 1
    return np.insert(time_s[kept], breaks, np.nan), np.insert(values[kept], breaks, np.nan)


def envelope(time_s: Floats, values: Floats, bins: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Return time, smallest, mean and largest value of equal stretches of time of a noisy line.

    Parameters
    ----------
    time_s, values : ndarray, shape (n,)
        Time is finite and rises; `values` may have gaps (not finite).
    bins : int
        Number of stretches; fewer where there are few samples.

    Returns
    -------
    tuple of ndarray, shape (m,)
        Each stretch's middle, minimum, mean and maximum; the last three NaN where a stretch has
        no value, so that a gap stays a gap.
    """
    bins = max(1, min(bins, values.shape[0] // _LEAST_PER_STRETCH))
    edges = np.linspace(time_s[0], time_s[-1], bins + 1)
    stretch = np.clip(np.searchsorted(edges, time_s, side="right") - 1, 0, bins - 1)
    finite = np.isfinite(values)
    stretch, values = stretch[finite], values[finite]
    count = np.bincount(stretch, minlength=bins)
    low, high = np.full(bins, np.nan), np.full(bins, np.nan)
    np.fmin.at(low, stretch, values)
    np.fmax.at(high, stretch, values)
    total = np.bincount(stretch, weights=values, minlength=bins)
    mean = np.divide(total, count, out=np.full(bins, np.nan), where=count > 0)
    return (edges[:-1] + edges[1:]) / 2.0, low, mean, high


def time_span_s(time_s: Floats) -> tuple[float, float]:
    """Return where a time axis begins and ends: the last sample has a stretch of its own."""
    finite = time_s[np.isfinite(time_s)]
    first, last = float(finite[0]), float(finite[-1])
    return first, last + (last - first) / max(finite.size - 1, 1)
