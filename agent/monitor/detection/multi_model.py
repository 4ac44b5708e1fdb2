"""The multi-model filter of thesis section 2.3: a bank of hypotheses, each with its probability.

"No change" stands beside "the level rose by r at some cycle" for each r of the bank. The matched
filter of a hypothesis is the feature less that rise, whose residuals are white from the change on.
A change comes with probability rho at each cycle (Shiryaev 1963), so the probability of each rise,
summed over all times it could have begun, runs recursively:

    w_r <- (w_r + rho prior_r w_0) p(z | r) / p(z | 0),   w_0 <- (1 - rho) w_0

where p(z | r) is normal about the rise a_r in units of the scatter, wide enough that the bank has
no gap between its rises, and has a floor for bad cycles: no single one decides. H0 is where the
rises together have a probability beyond what the accepted false alarms ask for, H1 where those of
at least `high_rise` have.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.stats import norm

from agent.identify.result import Floats
from agent.monitor.detection.cusum import DECIDING, warned_states
from agent.monitor.detection.series import FeatureSeries, Judgement, State, Trace
from agent.monitor.detection.standing import Standing, standing
from agent.monitor.detection.tuning import Target, allowance, cycles_per_year

_BAD_CYCLE = 1e-4  # density: one cycle in a hundred lies anywhere within a hundred scatters
_WANDER = 1.0 / 3.0  # of a rise: the bank's rises are a factor of two apart


@dataclass(frozen=True)
class MultiModel:
    """The bank for the low-speed friction.

    Parameters
    ----------
    rises : tuple of float
        The hypotheses, as shares of the baseline's level.
    changes_per_year : float
        How often a change is expected beforehand.
    target : Target
        Its rates set the certainty: with the right models the probability of a false alarm is
        one less the certainty per change, so certainty = 1 - rate / (changes_per_year + rate).
    high_rise : float
        H1 is for the hypotheses of at least this rise.
    """

    rises: tuple[float, ...] = (0.025, 0.05, 0.1, 0.2, 0.4, 0.8)
    changes_per_year: float = 0.2
    target: Target = field(default_factory=Target)
    high_rise: float = 0.2

    @property
    def name(self) -> str:
        """Return the word for it."""
        return "multi-model"

    def judge(self, series: FeatureSeries) -> Judgement:
        """Return the state at each cycle; without a baseline to stand on, no fault throughout."""
        found = standing(series, DECIDING) if DECIDING in series.values else None
        if found is None or found.level <= 0.0:
            return Judgement(self.name, (State.NO_FAULT,) * series.time_s.size, {})
        chances = self.probabilities(found, series.healthy, cycles_per_year(series))
        great = np.asarray(self.rises) >= self.high_rise
        increased, high = (
            1.0 - rate / (self.changes_per_year + rate)
            for rate in (self.target.increased_per_year, self.target.high_per_year)
        )
        any_rise = np.sum(chances, axis=1)
        states = warned_states(any_rise > increased, np.sum(chances[:, great], axis=1) > high)
        return Judgement(
            self.name, states, {DECIDING: Trace(any_rise, np.full_like(any_rise, increased))}
        )

    def probabilities(self, found: Standing, healthy: int, per_year: float) -> Floats:
        """Return the probability of each rise at each cycle, shape (n, rises).

        The level's own uncertainty and the neighbours' correlation widen the scatter, so that
        what the baseline leaves open is not taken for certainty.
        """
        wide = np.sqrt(found.long_run * (1.0 + 1.0 / found.cycles))
        sizes = np.asarray(self.rises) * found.level / found.scatter / wide
        widths = np.hypot(1.0, _WANDER * sizes)
        allowed = allowance(self.target.increased_per_year) * found.shared
        z = np.sign(found.z) * np.maximum(0.0, np.abs(found.z) - allowed) / wide
        hazard = min(0.5, self.changes_per_year / per_year)
        weights, none = np.zeros(sizes.size), 1.0
        out = np.zeros((z.size, sizes.size))
        for i, value in enumerate(z.tolist()):
            if i >= healthy and np.isfinite(value):
                weights = weights + hazard * none / sizes.size
                none *= 1.0 - hazard
                density = norm.pdf(value, sizes, widths) + _BAD_CYCLE
                weights = weights * density / (norm.pdf(value) + _BAD_CYCLE)
                total = none + float(np.sum(weights))
                weights, none = weights / total, none / total
            out[i] = weights
        return out
