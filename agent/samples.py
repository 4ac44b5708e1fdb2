"""Which samples of a column can be used: one rule for the recording and for what is made of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BEYOND = 1e20
"""No joint's, in any unit of ours: unread memory, or the number that a logger writes for nothing.

Its square still is a number, so that what is below it can be reckoned with.
"""


def usable(column: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Return where a column holds a number that can be one, shape (n,); NaN and infinite cannot."""
    told: NDArray[np.bool_] = np.abs(np.asarray(column, dtype=np.float64)) < BEYOND
    return told
