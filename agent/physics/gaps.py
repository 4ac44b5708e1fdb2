"""How a motor went on while samples of it were lost: what has a memory keeps it meanwhile."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LONGEST_GAP_S = 0.25
"""Without samples: of more nobody knows how the motor went."""

_OF_THE_CHANGE, _OF_THE_RATE = 0.5, 0.02  # by more no rate bends between its ends


def between(count: int) -> Floats:
    """Return how far on lost samples stand, evenly between two that were not, shape (count,)."""
    return np.linspace(0.0, 1.0, count + 2)[1:-1]


def bridge(before: Floats, after: Floats, went: Floats, gap_s: Floats, share: Floats) -> Floats:
    """Return a rate by time at samples that were lost, all shape (n,).

    A straight line, bent so that it leads as far as the way that was gone; left straight where no
    motion bends so much in between: there it is a time stamp that is off.

    Parameters
    ----------
    before, after : ndarray
        The rates beside the gap.
    went : ndarray
        How far it went meanwhile; NaN where that is not known.
    gap_s : ndarray
        How long it took.
    share : ndarray
        How far on, as `between` has it.
    """
    mean = 0.5 * (before + after)
    missing = went / gap_s - mean
    bends = np.abs(missing) <= _OF_THE_CHANGE * np.abs(after - before) + _OF_THE_RATE * np.abs(mean)
    bent = 6.0 * np.where(bends, missing, 0.0) * share * (1.0 - share)
    return np.asarray(before + (after - before) * share + bent)
