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
    for i in range(out.shape[0]):
        # A window of its own lets the compiler see that no index turns round, and take several.
        window, total = extended[i * every : i * every + taps.shape[0]], 0.0
        for k in range(taps.shape[0]):
            total += taps[k] * window[k]
        out[i] = total


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
