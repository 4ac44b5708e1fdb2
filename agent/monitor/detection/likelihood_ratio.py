"""The two-window likelihood ratio of thesis section 2.3: a slow model against a fast one.

The slow window is the baseline, the fast one the last few cycles. For normal residuals of known
scatter the generalised likelihood ratio of "the mean rose" against "it did not" is

    2 log L = (mean_fast - mean_slow)^2 / (sigma^2 L (1/m + 1/n)),   zero where the mean fell

and it is held against its quantile for the accepted false alarms. Neighbouring windows overlap, so
taking each cycle as a new trial errs to the safe side. H0 and H1 differ as in `cusum`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.stats import t as student

from agent.identify.result import Floats
from agent.monitor.detection.cusum import DECIDING, recent_median, warned_states
from agent.monitor.detection.series import FeatureSeries, Judgement, State, Trace
from agent.monitor.detection.standing import standing
from agent.monitor.detection.tuning import Target, allowance, cycles_per_year


@dataclass(frozen=True)
class LikelihoodRatio:
    """The ratio for the low-speed friction.

    Parameters
    ----------
    window : int
        Cycles of the fast model: few see a jump soon, many a small rise at all.
    target : Target
        Only its false-alarm rates are used; the test knows no smallest rise.
    high_rise : float
        As for `Cusum`.
    """

    window: int = 7
    target: Target = field(default_factory=Target)
    high_rise: float = 0.2

    def __post_init__(self) -> None:
        if self.window < 2:
            raise ValueError(f"expected a window of at least 2 cycles, got {self.window}")

    @property
    def name(self) -> str:
        """Return the word for it."""
        return "likelihood-ratio"

    def judge(self, series: FeatureSeries) -> Judgement:
        """Return the state at each cycle; without a baseline to stand on, no fault throughout."""
        found = standing(series, DECIDING) if DECIDING in series.values else None
        if found is None:
            return Judgement(self.name, (State.NO_FAULT,) * series.time_s.size, {})
        spread = np.sqrt(found.long_run * (1.0 / self.window + 1.0 / found.cycles))
        excess = (
            fast_mean(found.z, self.window, series.healthy)
            - allowance(self.target.increased_per_year)
            * fast_mean(found.shared, self.window, series.healthy)
        ) / spread
        ratio = np.maximum(0.0, np.nan_to_num(excess)) ** 2
        per_year = cycles_per_year(series)
        increased, high = (
            float(student.isf(rate / per_year, found.cycles - 1.0)) ** 2
            for rate in (self.target.increased_per_year, self.target.high_per_year)
        )
        far = recent_median(found.rise(allowance(self.target.high_per_year))) > self.high_rise
        return Judgement(
            self.name,
            warned_states(ratio > increased, (ratio > high) & far),
            {DECIDING: Trace(ratio, np.full_like(ratio, increased))},
        )


def fast_mean(z: Floats, window: int, healthy: int) -> Floats:
    """Return the mean of the last `window` cycles after the baseline that carry the feature.

    Parameters
    ----------
    z : ndarray, shape (n,)
    window, healthy : int

    Returns
    -------
    ndarray, shape (n,)
        NaN until the window is full.
    """
    carried = np.flatnonzero(np.isfinite(z))
    carried = carried[carried >= healthy]
    out = np.full_like(z, np.nan)
    if carried.size < window:
        return out
    total = np.concatenate(([0.0], np.cumsum(z[carried])))
    out[carried[window - 1 :]] = (total[window:] - total[:-window]) / window
    last = np.maximum.accumulate(np.where(np.isfinite(out), np.arange(z.size), 0))
    return out[last]
