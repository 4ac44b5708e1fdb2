"""The change time of a feature with its 95 % interval, and how the change went."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Parameter
from agent.monitor.change_posterior import SHAPES, Posterior, change_posterior
from agent.monitor.series import FeatureSeries

CERTAIN = 0.95
_DAY_S = 86400.0


@dataclass(frozen=True)
class ChangeTime:
    """When the first changed cycle was.

    Parameters
    ----------
    decidable : bool
        Whether a change stands out of the noise with 95 % probability.
    cycle : int
        The series' index of the first changed cycle, the posterior's median; -1 if not decidable.
    cycle_ci95 : tuple of int
        Between these cycles, both included, the first changed one lies with 95 %.
    time_s, time_ci95_s : float, tuple of float
        The same as time; the interval begins at the last cycle that was surely unchanged.
    shapes : mapping of str to float
        Probability of each of `SHAPES`.
    rise : Parameter
        The rise now as a share of the baseline's level.
    sentence : str
    """

    decidable: bool
    cycle: int
    cycle_ci95: tuple[int, int]
    time_s: float
    time_ci95_s: tuple[float, float]
    shapes: Mapping[str, float]
    rise: Parameter
    sentence: str


def change_time(series: FeatureSeries, feature: str = "low_integral_w") -> ChangeTime:
    """Return when a feature changed, from all cycles of a series."""
    posterior = change_posterior(series, feature)
    if posterior is None:
        return _undecided("too few cycles in the baseline or after it")
    if posterior.changed < CERTAIN:
        return _undecided(f"no change stands out (probability {posterior.changed:.0%})")
    by_time = np.cumsum(np.sum(posterior.weight, axis=0))
    low, middle, high = (
        int(np.searchsorted(by_time, q * by_time[-1])) for q in (0.025, 0.5, 0.975)
    )
    places = posterior.cycle[posterior.first]
    shapes = dict(zip(SHAPES, np.sum(posterior.weight, axis=1).tolist(), strict=True))
    rise = _rise(posterior)
    start, end = (float(posterior.onset_s()[low]), float(series.time_s[places[high]]))
    likely = max(shapes, key=lambda name: shapes[name])
    return ChangeTime(
        True,
        int(places[middle]),
        (int(places[low]), int(places[high])),
        float(series.time_s[places[middle]]),
        (start, end),
        shapes,
        rise,
        f"the change began between day {start / _DAY_S:.0f} and day {end / _DAY_S:.0f} "
        f"(95 %), as a {likely} with probability {shapes[likely]:.0%}",
    )


def _rise(posterior: Posterior) -> Parameter:
    """Return the mixture's mean and its 95 % interval as if it were normal."""
    mean = float(np.sum(posterior.weight * posterior.rise))
    variance = posterior.rise_variance * posterior.noise_variance
    spread = math.sqrt(float(np.sum(posterior.weight * (variance + (posterior.rise - mean) ** 2))))
    unit = posterior.found.scatter / posterior.found.level
    return Parameter(unit * mean, (unit * (mean - 1.96 * spread), unit * (mean + 1.96 * spread)))


def _undecided(reason: str) -> ChangeTime:
    return ChangeTime(
        False,
        -1,
        (-1, -1),
        math.nan,
        (math.nan, math.nan),
        {},
        Parameter.not_identified(reason),
        f"change time not decidable: {reason}",
    )
