"""Whether innovations are white: the test of Ljung and Box (Biometrika 65 (1978) 297)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats

LAGS = 8


@dataclass(frozen=True)
class Whiteness:
    """Ljung and Box's test of one recording's innovations.

    `statistic` is chi-squared with `degrees` degrees of freedom where they are white, so that
    `threshold` is passed at `false_rate` then.
    """

    statistic: float
    degrees: int
    threshold: float
    false_rate: float
    innovations: int

    @property
    def white(self) -> bool:
        """Tell whether nothing speaks against whiteness."""
        return self.statistic <= self.threshold


def whiteness(innovations: Floats, false_rate: float = 0.01, lags: int = LAGS) -> Whiteness:
    """Test innovations for whiteness; pairs across a new beginning do not count.

    ``Q = sum over channels and lags l of n_l r_l^2 (n + 2)/n``, with r_l the correlation of the
    n_l pairs that are there.

    Parameters
    ----------
    innovations : ndarray, shape (n, channels)
        Whitened by the filter's own covariance; NaN where there is none.
    false_rate : float
        How often white innovations are called coloured.
    lags : int
        How many lags are looked at.
    """
    from scipy.special import chdtri

    statistic = 0.0
    for column in innovations.T:
        centred = column - np.nanmean(column)
        power = float(np.nanmean(centred**2))
        for lag in range(1, lags + 1):
            products = centred[lag:] * centred[:-lag]
            products = products[np.isfinite(products)]
            if products.size > 1 and power > 0.0:
                statistic += float(np.mean(products) / power) ** 2 * (products.size + 2.0)
    degrees = lags * innovations.shape[1]
    seen = int(np.count_nonzero(np.isfinite(innovations[:, 0])))
    return Whiteness(statistic, degrees, float(chdtri(degrees, false_rate)), false_rate, seen)
