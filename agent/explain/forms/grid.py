"""Places to try between two ends."""

from __future__ import annotations

import math

import numpy as np


def log_grid(lower: float, upper: float, count: int) -> tuple[float, ...]:
    """Return `count` points even in their logarithm."""
    if not (0.0 < lower < upper) or math.isinf(upper):
        return (max(lower, upper),)
    return tuple(float(x) for x in np.geomspace(lower, upper, count))
