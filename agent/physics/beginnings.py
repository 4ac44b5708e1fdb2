"""What is hidden as a recording begins: how far springs are drawn out, and how an arm moves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_STILL = 0.01  # of the greatest speed


def begins_at_rest(velocity_rad_s: NDArray[np.float64]) -> bool:
    """Return whether a motion, shape (n,), sets off from rest.

    Springs are relaxed then, as far as anybody knows, and an arm stands still: a motion that was
    under way would hardly be recorded from where its speed is nothing.
    """
    if not velocity_rad_s.shape[0]:
        return True
    fastest = float(np.nanmax(np.abs(velocity_rad_s), initial=0.0))
    return bool(abs(float(velocity_rad_s[0])) <= _STILL * fastest)


def drawn_at_first(velocity_rad_s: NDArray[np.float64], direction: NDArray[np.float64]) -> float:
    """Return how far friction's springs are drawn out as a motion, shape (n,), begins, -1 to 1.

    As far as the motion draws them, or not at all where it sets off from rest: which way they were
    left nobody has recorded, and either way would be wrong by twice as much.
    """
    return 0.0 if begins_at_rest(velocity_rad_s) else float(direction[0])
