"""Dahl's state along a motion, compiled. Import this late: numba is slow to load."""

from __future__ import annotations

import numpy as np
from numba import njit

from agent.identify.result import Floats


@njit(cache=True, nogil=True)
def relaxed(velocity: Floats, keep: Floats, start: float) -> Floats:
    """Return a state that goes to the sign of a velocity, shape (n,).

    Parameters
    ----------
    velocity : ndarray, shape (n,)
    keep : ndarray, shape (n,)
        Which share of its way each sample leaves; where nothing moves the state stays.
    start : float
        Where it is at first.
    """
    out = np.empty(velocity.shape[0])
    state = start
    for i in range(velocity.shape[0]):
        settled = 0.0
        if velocity[i] > 0.0:
            settled = 1.0
        elif velocity[i] < 0.0:
            settled = -1.0
        if settled != 0.0:
            state = settled + (state - settled) * keep[i]
        out[i] = state
    return out
