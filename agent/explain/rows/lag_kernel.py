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
    for p in range(starts.shape[0]):
        begin, last, first = starts[p], stops[p] - 1, firsts[p]
        one, two, three, four = weights[p]
        for i in range(begin, stops[p]):
            a = min(max(i + first, begin), last)
            b = min(max(i + first + 1, begin), last)
            c = min(max(i + first + 2, begin), last)
            d = min(max(i + first + 3, begin), last)
            for k in range(columns.shape[1]):
                before = one * columns[a, k] + two * columns[b, k]
                out[i, k] = before + three * columns[c, k] + four * columns[d, k]
