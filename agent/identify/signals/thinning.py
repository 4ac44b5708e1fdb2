"""The same low-pass where only every so many-th sample is kept: a sum over its impulse response.

A transform gives all samples, and costs the more the longer a stretch is. The filter's response
has died away after some ten periods of the cutoff; where a few samples are kept for each of these,
that sum is less work than the transform, for every band alike.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from agent.identify.result import Floats
from agent.identify.signals.lowpass import circular_length, extension, lowpass, response

_GONE = 1e-9  # of the response's sum: what is left out of it
_MOST_WORK = 160  # products for each sample: with more, the transform is quicker


def thinned_lowpass(rows: Floats, period_s: float, cutoff_hz: float, every: int) -> Floats:
    """Return every so many-th sample of rows, the first one first, low-passed as by `lowpass`.

    Parameters
    ----------
    rows : ndarray, shape (k, n)
        Signals sampled evenly in time.
    period_s : float
        Time between samples.
    cutoff_hz : float
        Where the response has fallen to one half.
    every : int

    Returns
    -------
    ndarray, shape (k, ceil(n / every))
        To a billionth what `lowpass` returns at these samples.
    """
    samples, cutoff = rows.shape[-1], cutoff_hz * period_s
    if samples < 3 or cutoff >= 0.5:
        return rows[:, ::every].astype(np.float64, copy=True)
    length, pad = circular_length(samples, cutoff), extension(samples, cutoff)
    taps = _taps(length, cutoff)
    if taps.shape[0] > samples or taps.shape[0] > _MOST_WORK * every:
        return np.ascontiguousarray(lowpass(rows, period_s, cutoff_hz)[:, ::every])
    from agent.identify.signals.thinning_kernel import summed

    out = np.empty((rows.shape[0], -(-samples // every)))
    for row, kept in zip(rows, out, strict=True):
        summed(np.ascontiguousarray(row, dtype=np.float64), taps, length, pad, every, kept)
    return out


@lru_cache(maxsize=256)
def _taps(length: int, cutoff: float) -> Floats:
    """Return the filter's response to one sample, both ways, as far as it counts, shape (2 r + 1,).

    Parameters
    ----------
    length : int
        Samples of the transform whose response it is.
    cutoff : float
        In cycles per sample.
    """
    impulse = np.fft.irfft(response(length, cutoff), n=length)
    half = impulse[: length // 2]
    beyond = 2.0 * np.cumsum(np.abs(half[::-1]))[::-1]
    reach = int(np.count_nonzero(beyond > _GONE)) - 1
    taps = np.concatenate((half[reach:0:-1], half[: reach + 1]))
    taps.flags.writeable = False
    return np.asarray(taps)
