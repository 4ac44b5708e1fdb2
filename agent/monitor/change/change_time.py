"""The change time of a feature with its 95 % interval, and how the change went.

Cycles are not divisible: the interval is the shortest run of cycles whose posterior probability
reaches 95 %, or the one that is a cycle shorter where its probability is nearer to 95 %. What it
really holds is said beside it; a change far out of the noise is one cycle with 99 %.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.monitor.change.posterior import SHAPES, Posterior, change_posterior
from agent.monitor.detection.series import FeatureSeries

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
        Between these cycles, both included, the first changed one lies with `probability`.
    probability : float
        As near to 0.95 as whole cycles allow; NaN if not decidable.
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
    probability: float
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
    by_cycle = np.sum(posterior.weight, axis=0)
    middle = int(np.searchsorted(np.cumsum(by_cycle), 0.5))
    low, high, probability = credible(by_cycle)
    places = posterior.cycle[posterior.first]
    shapes = dict(zip(SHAPES, np.sum(posterior.weight, axis=1).tolist(), strict=True))
    rise = _rise(posterior)
    start, end = (float(posterior.onset_s()[low]), float(series.time_s[places[high]]))
    likely = max(shapes, key=lambda name: shapes[name])
    return ChangeTime(
        True,
        int(places[middle]),
        (int(places[low]), int(places[high])),
        probability,
        float(series.time_s[places[middle]]),
        (start, end),
        shapes,
        rise,
        f"the change began between day {start / _DAY_S:.0f} and day {end / _DAY_S:.0f} "
        f"({100.0 * probability:.0f} %), as a {likely} with probability {shapes[likely]:.0%}",
    )


def credible(probability: Floats) -> tuple[int, int, float]:
    """Return the run of cycles whose probability is nearest to 95 %, and what it is.

    Parameters
    ----------
    probability : ndarray, shape (n,)
        Of each cycle; sums to one.

    Returns
    -------
    tuple of int, int, float
        First and last place of the run, both included, and its probability: of the shortest run
        that reaches 95 % and the likeliest that is one cycle shorter, the nearer one.
    """
    below = np.concatenate(([0.0], np.cumsum(probability)))
    shorter: tuple[int, int, float] | None = None
    for length in range(1, probability.size + 1):
        held = below[length:] - below[:-length]
        at = int(np.argmax(held))
        run = (at, at + length - 1, float(held[at]))
        if run[2] >= CERTAIN:
            if shorter is not None and CERTAIN - shorter[2] < run[2] - CERTAIN:
                return shorter
            return run
        shorter = run
    return 0, probability.size - 1, float(below[-1])


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
        math.nan,
        (math.nan, math.nan),
        {},
        Parameter.not_identified(reason),
        f"change time not decidable: {reason}",
    )
