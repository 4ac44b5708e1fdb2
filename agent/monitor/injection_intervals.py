"""Quantiles and shares over replays, with their intervals."""

from __future__ import annotations

import math

import numpy as np

from agent.identify.result import Floats


def quantile(rising: Floats, share: float) -> tuple[float, float, float]:
    """Return a quantile and the order statistics that bound it with 95 %; infinite for none."""
    from scipy.special import bdtr

    n = rising.size
    below = bdtr(np.arange(n + 1, dtype=np.float64), n, share)  # P(at most k lie below it)
    low = int(np.searchsorted(below, 0.025))
    high = int(np.searchsorted(below, 0.975))
    at = min(math.ceil(share * (n + 1)), n) - 1  # below which the next one lies with that share
    return (
        float(rising[at]),
        float(rising[max(low - 1, 0)]),
        float(rising[high]) if high < n else math.inf,
    )


def apart(found: float, end: float, doubt: float) -> float:
    """Return an interval's end moved out by a relative doubt, the two taken as independent."""
    if not (math.isfinite(found) and math.isfinite(end)):
        return end
    return found * math.exp(math.copysign(math.hypot(math.log(end / found), doubt), doubt))


def wilson(hits: int, total: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share."""
    z = 1.959963984540054
    share, spread = hits / total, z * z / total
    middle = (share + 0.5 * spread) / (1.0 + spread)
    half = z * math.sqrt(share * (1.0 - share) / total + 0.25 * spread / total) / (1.0 + spread)
    return max(middle - half, 0.0), min(middle + half, 1.0)
