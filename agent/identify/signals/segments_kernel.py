"""The search of `segments.partition`, compiled. Import this late: numba is slow to load."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def starts_of(
    total: NDArray[np.float64],
    square: NDArray[np.float64],
    reciprocal: NDArray[np.float64],
    penalty: float,
) -> NDArray[np.int64]:
    """Return where the piece begins that ends at each place, shape (n + 1,).

    Parameters
    ----------
    total, square : ndarray, shape (n + 1,)
        Sums of the values and of their squares, from 0.
    reciprocal : ndarray, shape (n,)
        One over a piece's length, the longest first.
    penalty : float
    """
    n = total.shape[0] - 1
    best, previous = np.zeros(n + 1), np.zeros(n + 1, dtype=np.int64)
    candidates, value = np.zeros(n + 1, dtype=np.int64), np.zeros(n + 1)
    best[0], count = -penalty, 1
    for stop in range(1, n + 1):
        choice = 0
        for i in range(count):
            start = candidates[i]
            sums = total[stop] - total[start]
            cost = square[stop] - square[start] - sums * sums * reciprocal[n - stop + start]
            value[i] = best[start] + cost
            if value[i] < value[choice]:
                choice = i
        best[stop] = value[choice] + penalty
        previous[stop] = candidates[choice]
        kept = 0
        for i in range(count):
            if value[i] <= best[stop]:
                candidates[kept] = candidates[i]
                kept += 1
        candidates[kept] = stop
        count = kept + 1
    return previous
