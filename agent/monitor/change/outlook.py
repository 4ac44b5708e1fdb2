"""If nothing changes: between when and when a feature reaches a limit. Never a promised life.

The trend and its uncertainty are those of `posterior`: every candidate time and shape of
change carries its own line forward, weighted with its probability. What has no trend (a step, or
nothing yet) has no outlook, and an outlook reaches no further ahead than three times as long as
the trend has been watched.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.change.change_time import CERTAIN
from agent.monitor.change.posterior import Posterior, change_posterior
from agent.monitor.detection.series import FeatureSeries

_DRAWS = 4000
_SEED = 6  # the draws are part of the method: the same series has the same outlook
AHEAD = 3.0
"""An outlook reaches so many times as far ahead as the trend has been watched."""

_DAY_S = 86400.0


@dataclass(frozen=True)
class Outlook:
    """When a limit is reached if the trend goes on.

    Parameters
    ----------
    decidable : bool
    limit_rise : float
        The limit, as a share above the baseline's level.
    earliest_s, latest_s : float
        95 % interval on the series' clock; `latest_s` infinite where the data set no latest;
        NaN if not decidable.
    sentence : str
    """

    decidable: bool
    limit_rise: float
    earliest_s: float
    latest_s: float
    sentence: str


def outlook(
    series: FeatureSeries, limit_rise: float = 0.5, feature: str = "low_integral_w"
) -> Outlook:
    """Return when a feature's rise reaches a limit if nothing changes.

    Parameters
    ----------
    series : FeatureSeries
    limit_rise : float
        Above zero: 0.5 is half as much again as the baseline's level.
    feature : str
    """
    if limit_rise <= 0.0:
        raise ValueError(f"expected a limit above the baseline's level, got {limit_rise}")
    posterior = change_posterior(series, feature)
    if posterior is None:
        return undecided(limit_rise, "too few cycles in the baseline or after it")
    if posterior.changed < CERTAIN:
        return undecided(limit_rise, "no change stands out of the noise, so there is no trend")
    now = float(series.time_s[-1])
    reached, trending = _reached(posterior, limit_rise)
    if trending < CERTAIN:
        return undecided(
            limit_rise,
            f"a trend is not sure (probability {100.0 * trending:.0f} %); it may be a single step",
        )
    earliest, latest = (float(q) for q in np.quantile(reached, (0.025, 0.975), method="nearest"))
    onset = float(np.sum(np.sum(posterior.weight, axis=0) * posterior.onset_s()))
    horizon = now + AHEAD * (now - onset)
    if earliest > horizon:
        return undecided(
            limit_rise,
            f"a rise of {100.0 * limit_rise:.0f} % lies more than "
            f"{(horizon - now) / _DAY_S:.0f} days ahead, further than the trend bears",
        )
    earliest, latest = max(earliest, now), max(latest, now)
    latest = latest if latest <= horizon else math.inf
    return Outlook(
        True, limit_rise, earliest, latest, sentence_of(limit_rise, now, earliest, latest)
    )


def _reached(posterior: Posterior, limit_rise: float) -> tuple[Floats, float]:
    """Return draws of when the limit is reached, and the probability of a rising trend.

    A draw of a step, or of a fall, reaches it never (infinity).
    """
    rng = np.random.default_rng(_SEED)
    flat = rng.choice(posterior.weight.size, _DRAWS, p=posterior.weight.ravel())
    noise = (
        posterior.noise_variance.ravel()[flat]
        * posterior.worth
        / rng.chisquare(posterior.worth, _DRAWS)
    )
    level_sd = np.sqrt(posterior.level_variance.ravel()[flat] * noise)
    rise_sd = np.sqrt(posterior.rise_variance.ravel()[flat] * noise)
    tie = posterior.covariance.ravel()[flat] * noise / (level_sd * rise_sd)
    first, second = rng.standard_normal((2, _DRAWS))
    level = posterior.level.ravel()[flat] + level_sd * first
    rise = posterior.rise.ravel()[flat] + rise_sd * (
        tie * first + np.sqrt(np.maximum(0.0, 1.0 - tie**2)) * second
    )
    shape, candidate = np.unravel_index(flat, posterior.weight.shape)
    onset = posterior.onset_s()[candidate]
    limit = limit_rise * posterior.found.level / posterior.found.scatter
    grows = (shape > 0) & (rise > 0.0)
    share = np.maximum(0.0, limit - level) / np.where(grows, rise, 1.0)
    share = np.where(shape == 2, np.sqrt(share), share)
    reached = np.where(grows, onset + share * (posterior.time_s[-1] - onset), np.inf)
    return reached, float(np.mean(grows))


def sentence_of(limit_rise: float, now: float, earliest: float, latest: float) -> str:
    """Return an outlook in words; times in seconds, `latest` infinite where there is none."""
    what = f"if nothing changes, a rise of {100.0 * limit_rise:.0f} % is reached"
    days = (earliest - now) / _DAY_S
    if math.isinf(latest):
        return f"{what} in {days:.0f} days at the earliest; the data set no latest day"
    if latest <= now:
        return f"a rise of {100.0 * limit_rise:.0f} % is reached already"
    return f"{what} between {days:.0f} and {(latest - now) / _DAY_S:.0f} days from now (95 %)"


def undecided(limit_rise: float, reason: str) -> Outlook:
    """Return that there is none, and why."""
    return Outlook(False, limit_rise, math.nan, math.nan, f"outlook not decidable: {reason}")
