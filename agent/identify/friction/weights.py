"""What a point of the friction curve counts in the fit of a law.

A fast pass is short and its point errs more than a slow one's. Were the points' errors all that a
law leaves, each would count by ``1/s^2``; but no law is exact, and a speed that happens to be quiet
must not draw the law to itself. Every point is therefore taken to have a common misfit m of the law
beside its own error, ``1/(s^2 + m^2)``. How large m is the residuals tell (Paule and Mandel, J.
Res. NBS 87 (1982) 377); it is not taken for less than the typical point's error, which costs a law
that is exact a hundredth of its precision.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats

_LEAST_MISFIT = 1.0  # of the median standard error
_BISECTIONS = 40


@dataclass(frozen=True)
class Weights:
    """Square roots of the points' weights, shape (n,), at most 1, and the law's misfit, N m.

    `misfit_nm` is what the residuals tell; 0 where the points' errors explain them all.
    """

    root: Floats
    misfit_nm: float = 0.0


def weights(standard_error_nm: Floats, misfit_nm: float = 0.0) -> Weights:
    """Return the weights of points for a law of a given misfit; even without known errors.

    Parameters
    ----------
    standard_error_nm : ndarray, shape (n,)
        Of the points.
    misfit_nm : float
        Of the law.
    """
    count = standard_error_nm.shape[0]
    if not np.all(np.isfinite(standard_error_nm)):
        return Weights(np.ones(count), misfit_nm)
    least = _LEAST_MISFIT * float(np.median(standard_error_nm))
    whole = np.hypot(standard_error_nm, max(misfit_nm, least))
    if not np.all(whole > 0.0):
        return Weights(np.ones(count), misfit_nm)
    return Weights(np.asarray(whole.min() / whole, dtype=np.float64), misfit_nm)


def misfit(residual_nm: Floats, standard_error_nm: Floats, freedom: int) -> float:
    """Return the misfit that leaves residuals as large as they are expected, N m.

    It solves ``sum r^2/(s^2 + m^2) = freedom``; 0 where the points' errors explain the residuals,
    or where there are too few points to tell.

    Parameters
    ----------
    residual_nm, standard_error_nm : ndarray, shape (n,)
        What a law leaves of the points, and their errors.
    freedom : int
        Points beyond the law's parameters.
    """
    if freedom < 1 or not np.all(np.isfinite(standard_error_nm)):
        return 0.0
    square, own = residual_nm**2, standard_error_nm**2
    low, high = 0.0, float(np.sum(square)) / freedom
    if high == 0.0 or (np.all(own > 0.0) and float(np.sum(square / own)) <= freedom):
        return 0.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        larger = float(np.sum(square / (own + middle))) > freedom
        low, high = (middle, high) if larger else (low, middle)
    return float(np.sqrt(0.5 * (low + high)))
