"""Columns that are earlier by parts of a sample, compiled. Import this late: numba is slow."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True)
def earlier_stretches(
    columns: Floats,
    starts: NDArray[np.int64],
    stops: NDArray[np.int64],
    firsts: NDArray[np.int64],
    weights: Floats,
    out: Floats,
) -> None:
    """Put every stretch's columns, by four points around where each sample is, into `out`.

    Parameters
    ----------
    columns, out : ndarray, shape (N, k)
    starts, stops : ndarray of int, shape (p,)
    firsts : ndarray of int, shape (p,)
        How many samples later the first of the four points stands.
    weights : ndarray, shape (p, 4)
        Of the points.
    """
    width = columns.shape[1]
    for p in range(starts.shape[0]):
        begin, last, first = starts[p], stops[p] - 1, firsts[p]
        one, two, three, four = weights[p]
        # Where none of the points is beyond an end, one run through memory takes all columns.
        lower = min(max(begin, begin - first), stops[p])
        upper = max(min(stops[p], last - first - 2), lower)
        count = (upper - lower) * width
        if count > 0:
            at = (lower + first) * width
            flat, there = columns.reshape(-1), out.reshape(-1)[lower * width :]
            a, b, c, d = (
                flat[at:],
                flat[at + width :],
                flat[at + 2 * width :],
                flat[at + 3 * width :],
            )
            for m in range(count):
                there[m] = (one * a[m] + two * b[m]) + three * c[m] + four * d[m]
        for i in range(begin, lower):
            _at_an_end(columns, i, begin, last, first, weights[p], out)
        for i in range(upper, stops[p]):
            _at_an_end(columns, i, begin, last, first, weights[p], out)


@njit(cache=True, nogil=True)
def _at_an_end(
    columns: Floats, i: int, begin: int, last: int, first: int, weights: Floats, out: Floats
) -> None:
    """Put one sample's columns into `out`; beyond an end goes on what is there."""
    a = min(max(i + first, begin), last)
    b = min(max(i + first + 1, begin), last)
    c = min(max(i + first + 2, begin), last)
    d = min(max(i + first + 3, begin), last)
    for k in range(columns.shape[1]):
        before = weights[0] * columns[a, k] + weights[1] * columns[b, k]
        out[i, k] = before + weights[2] * columns[c, k] + weights[3] * columns[d, k]
