"""Loops that must run sample by sample, compiled. Import this late: numba is slow to load."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True)
def relax(steady: Floats, keep: Floats, start: float) -> Floats:  # pragma: no cover
    """Return a state after each pair of pieces, shape (n,).

    ``x <- steady + (x - steady) keep`` for each of the 2 n pieces.
    """
    samples = steady.shape[0] // 2
    state = start
    out = np.empty(samples)
    for k in range(samples):
        for j in (2 * k, 2 * k + 1):
            state = steady[j] + (state - steady[j]) * keep[j]
        out[k] = state
    return out


@njit(cache=True)
def gap_angle(
    twist_rad: Floats, step_s: Floats, half_gap_rad: float, rate_per_s: float
) -> Floats:  # pragma: no cover
    """Return the clearance's angle, shape (n,), of a spring and damper in series with a gap.

    Freely the spring relaxes at `rate_per_s`; the walls at plus and minus `half_gap_rad` stop it.
    """
    out = np.empty(twist_rad.shape[0])
    gap = min(max(twist_rad[0], -half_gap_rad), half_gap_rad)
    out[0] = gap
    for k in range(1, twist_rad.shape[0]):
        spring = (twist_rad[k - 1] - gap) * math.exp(-rate_per_s * step_s[k])
        gap = min(max(twist_rad[k] - spring, -half_gap_rad), half_gap_rad)
        out[k] = gap
    return out
