"""The slope of sampled values, true to a tenth of the sampling rate within half a percent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_FEWEST = 5
_EVEN = 1e-3  # of a period: steps that differ by less are even


def slope(values: Floats, period_s: float) -> Floats:
    """Return the time derivative of evenly sampled values, shape (n,), by five points.

    ``(8 (x1 - x-1) - (x2 - x-2)) / (12 T)``: at the angular frequency w it is too small by
    ``(w T)^4 / 30``, where the two-point difference is by ``(w T)^2 / 6``. In a band of a tenth of
    the sampling rate that is 0.5 % against 6.6 %: an inertia that fails to follow sharp
    corners by 6 % looks like a spring.

    Parameters
    ----------
    values : ndarray, shape (n,)
    period_s : float
        Time between samples.

    Returns
    -------
    ndarray, shape (n,)
        The two outermost samples on each side by `numpy.gradient`.
    """
    out = np.gradient(values, period_s)
    if values.shape[0] >= _FEWEST:
        near, far = values[3:-1] - values[1:-3], values[4:] - values[:-4]
        out[2:-2] = (8.0 * near - far) / (12.0 * period_s)
    return np.asarray(out)


def slope_over(time_s: Floats, values: Floats) -> Floats:
    """Return the time derivative of values, shape (n,), by five points where time is even.

    Elsewhere by `numpy.gradient`, whose two points ask for nothing of the steps.
    """
    if time_s.shape[0] < _FEWEST:
        return np.asarray(np.gradient(values, time_s)) if time_s.shape[0] > 1 else 0.0 * values
    steps = np.diff(time_s)
    period_s = float(np.mean(steps))
    if float(np.max(np.abs(steps - period_s))) > _EVEN * period_s:
        return np.asarray(np.gradient(values, time_s))
    return slope(values, period_s)


def bend_over(time_s: Floats, values: Floats) -> Floats:
    """Return the second time derivative of values, shape (n,), by three points; 0 at both ends."""
    out = np.zeros_like(values)
    if values.shape[0] > 2:
        before, after = np.diff(time_s)[:-1], np.diff(time_s)[1:]
        rises = np.diff(values) / np.diff(time_s)
        out[1:-1] = np.diff(rises) / (0.5 * (before + after))
    return out
