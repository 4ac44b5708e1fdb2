"""What a share of the replays catches, and shares of replays, with their intervals."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from agent.identify.result import Floats

_NORMAL_975 = 1.959963984540054


def catching(missed: Floats, caught: Floats, share: float) -> tuple[float, float, float]:
    """Return the rise that a share of the replays catches, with a 95 % interval.

    Probit curve of the share that is caught over the rise, by maximum likelihood: each replay says
    that its own smallest rise lies between two. Replays that catch less than half of them do count
    as just that, for what a replay catches without much of a rise is its own luck and says nothing
    of where nearly all catch. The interval is that of the likelihood's curvature, on a scale of
    ratios, so that it is finite wherever the curve is known.

    Parameters
    ----------
    missed, caught : ndarray, shape (n,)
        The largest rise that each replay misses, 0 for none, and the smallest that it catches,
        infinite for none.
    share : float
        Above a half.

    Returns
    -------
    rise, low, high : float
        All infinite where half of the replays catch nothing at all.
    """
    from scipy.optimize import minimize
    from scipy.special import log_ndtr, ndtri

    middle = float(np.quantile(caught, 0.5, method="higher"))
    if not math.isfinite(middle):
        return math.inf, math.inf, math.inf
    lucky = caught <= middle
    low = np.where(lucky, -np.inf, missed)
    high = np.where(lucky, middle, caught)
    reach = float(ndtri(share))
    known = caught[np.isfinite(caught)]
    spread = max(float(np.quantile(known, share)) - middle, 0.05 * middle) / reach

    def unlikely(at: Floats) -> float:
        """Return minus the log-likelihood of the rise that is asked for and the curve's width."""
        width = math.exp(at[1])
        centre = at[0] - reach * width
        ends = [log_ndtr((end - centre) / width) for end in (high, low)]
        logs = ends[0] + np.log1p(-np.exp(np.minimum(ends[1] - ends[0], -1e-12)))
        return -float(np.sum(np.maximum(logs, -1e3)))

    start = np.array([middle + reach * spread, math.log(spread)])
    best = minimize(unlikely, start, method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-6}).x
    rise, width = float(best[0]), math.exp(float(best[1]))
    curvature = _curvature(unlikely, best, np.array([0.05 * width, 0.05]))
    deviation = math.sqrt(max(float(np.linalg.pinv(curvature)[0, 0]), 0.0)) / rise
    factor = math.exp(_NORMAL_975 * deviation)
    return rise, rise / factor, rise * factor


def _curvature(of: Callable[[Floats], float], at: Floats, step: Floats) -> Floats:
    """Return a function's second derivatives at a point by central differences, shape (m, m)."""
    moves = np.diag(step)
    out = np.empty((at.size, at.size))
    for i, one in enumerate(moves):
        for j, other in enumerate(moves):
            around = of(at + one + other) - of(at + one - other)
            around += of(at - one - other) - of(at - one + other)
            out[i, j] = around / (4.0 * step[i] * step[j])
    return out


def apart(found: float, end: float, doubt: float) -> float:
    """Return an interval's end moved out by a relative doubt, the two taken as independent."""
    if not (math.isfinite(found) and math.isfinite(end)):
        return end
    return found * math.exp(math.copysign(math.hypot(math.log(end / found), doubt), doubt))


def wilson(hits: int, total: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share."""
    z = _NORMAL_975
    share, spread = hits / total, z * z / total
    middle = (share + 0.5 * spread) / (1.0 + spread)
    half = z * math.sqrt(share * (1.0 - share) / total + 0.25 * spread / total) / (1.0 + spread)
    return max(middle - half, 0.0), min(middle + half, 1.0)
