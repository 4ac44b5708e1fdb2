"""A signal's sums over an impulse response, compiled. Import this late: numba is slow to load."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz"})
def summed(
    signal: NDArray[np.float64],
    taps: NDArray[np.float64],
    length: int,
    pad: int,
    every: int,
    out: NDArray[np.float64],
) -> None:
    """Put the filtered signal, every so many-th sample of it, into `out`.

    Beyond its ends the signal goes on as in `lowpass`: oddly for `pad` samples, then along a
    straight line to its other end, in a circle of `length`.

    Parameters
    ----------
    signal : ndarray, shape (n,)
    taps : ndarray, shape (2 r + 1,)
        With r below n.
    length, pad, every : int
    out : ndarray, shape (ceil(n / every),)
    """
    samples, reach = signal.shape[0], taps.shape[0] // 2
    extended = np.empty(samples + 2 * reach)
    for i in range(samples):
        extended[reach + i] = signal[i]
    for k in range(reach):
        extended[reach + samples + k] = _beyond(signal, samples + k, length, pad)
        extended[reach - 1 - k] = _beyond(signal, length - 1 - k, length, pad)
    last, width = out.shape[0] - 1, taps.shape[0]
    for i in range(0, out.shape[0], 4):
        # Four sums at a time read a tap once for all of them; past the last one it is taken again.
        b, c, d = min(i + 1, last), min(i + 2, last), min(i + 3, last)
        # Windows of their own let the compiler see that no index turns round, and take several.
        one = extended[i * every : i * every + width]
        two = extended[b * every : b * every + width]
        three = extended[c * every : c * every + width]
        four = extended[d * every : d * every + width]
        first = second = third = fourth = 0.0
        for k in range(width):
            first += taps[k] * one[k]
            second += taps[k] * two[k]
            third += taps[k] * three[k]
            fourth += taps[k] * four[k]
        out[i], out[b], out[c], out[d] = first, second, third, fourth


@njit(cache=True, nogil=True)
def summed_stretches(
    columns: NDArray[np.float64],
    stretches: NDArray[np.int64],
    taps: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Put columns, filtered stretch by stretch and thinned, into `out`; see `summed`.

    Parameters
    ----------
    columns : ndarray, shape (N, k)
    stretches : ndarray of int, shape (s, 9)
        Of each stretch, where it begins and ends among the samples, and among the rows of `out`;
        where its response begins and ends among the taps; `length`, `pad` and `every`.
    taps : ndarray, shape (t,)
        The responses, one behind the other.
    out : ndarray, shape (n, k)
    """
    for s in range(stretches.shape[0]):
        begin, end, row, stop, first, last, length, pad, every = stretches[s]
        response = taps[first:last]
        for j in range(columns.shape[1]):
            summed(columns[begin:end, j], response, length, pad, every, out[row:stop, j])


@njit(cache=True, nogil=True)
def _beyond(signal: NDArray[np.float64], at: int, length: int, pad: int) -> float:
    """Return the signal at a place of its circle that is not negative."""
    samples, i = signal.shape[0], at % length
    first, last = 2.0 * signal[0], 2.0 * signal[-1]
    if i < samples:
        return float(signal[i])
    if i < samples + pad:
        return float(last - signal[2 * samples - 2 - i])
    if i >= length - pad:
        return float(first - signal[length - i])
    way = (i - samples - pad + 1) / (length - samples - 2 * pad + 1)
    behind, before = last - signal[samples - 1 - pad], first - signal[pad]
    return float(behind * (1.0 - way) + before * way)
