"""How long a CUSUM runs before it crosses its threshold: Siegmund's law.

The sum is g_t = max(0, g_{t-1} + x_t) with x_t normal, mean `drift`, deviation one, and it ends
above `threshold`. Siegmund (1985, eq. 2.57) replaces the walk by Brownian motion whose threshold
is 1.166 further out, for the overshoot at both ends:

    ARL = (exp(-2 m b) + 2 m b - 1) / (2 m^2),  b = threshold + 1.166

The Markov chain of Brook and Evans judges it (`tests/science/run_length_chain.py`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from agent.identify.result import Floats

_OVERSHOOT = 1.166
_LARGEST_EXPONENT = 600.0


def siegmund(drift: ArrayLike, threshold: ArrayLike) -> Floats:
    """Return the average run length of a CUSUM from zero.

    Parameters
    ----------
    drift : array_like
        Mean of a step over its standard deviation; negative while nothing has changed.
    threshold : array_like
        Over the step's standard deviation. Broadcasts with `drift`.

    Returns
    -------
    ndarray
        In steps, at least one.
    """
    m, b = np.broadcast_arrays(
        np.asarray(drift, dtype=np.float64), np.asarray(threshold, dtype=np.float64) + _OVERSHOOT
    )
    x = -2.0 * m * b
    small = np.abs(x) < 1e-4
    safe = np.where(small, 1.0, m)
    law = (np.expm1(np.minimum(x, _LARGEST_EXPONENT)) - x) / (2.0 * safe**2)
    lengths: Floats = np.maximum(1.0, np.where(small, b**2 * (1.0 + x / 3.0), law))
    return lengths


def threshold_for(drift: float, steps: float) -> float:
    """Return the threshold, not below zero, at which `siegmund` gives a run of `steps`."""
    low, high = 0.0, 1.0
    while siegmund(drift, high) < steps and high < 1e6:
        high *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if siegmund(drift, middle) < steps else (low, middle)
    return high
