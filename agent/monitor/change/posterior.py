"""When and how a feature changed: the posterior over the time of change and its shape.

Each candidate is a level and a rise, y_t = mu + a x_t(k, shape) + noise, where x is zero up to the
cycle before k and one at the last cycle:

- step: one from k on;
- ramp: growing with time;
- accelerating: growing with its square.

So `a` is the rise now, whatever the shape, and all candidates share its prior, N(0, half of the
level); mu and the noise's variance are integrated out (Jeffreys' prior), which leaves

    p(k, shape | y) ~ gap_k (S_xx + lambda)^(-1/2) RSS^(-(n - 1) / 2)

Beforehand a change is as likely at any time, so a candidate counts as much as its gap is long.
Where neighbouring cycles are correlated, level, rise and feature are first whitened as a
first-order autoregression, in which form the same sums hold. The correlation is the baseline's at
first, then that of all cycles about the likeliest course. Basseville and Nikiforov, Detection
of Abrupt Changes (1993), section 2.6, have the likelihood part.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import median_filter

from agent.identify.result import Floats
from agent.monitor.detection.decision import Marks
from agent.monitor.detection.series import FeatureSeries
from agent.monitor.detection.standing import Standing, autocorrelation, standing

SHAPES: Mapping[str, Callable[[Floats], Floats]] = {
    "step": np.ceil,
    "ramp": lambda share: share,
    "accelerating": lambda share: share**2,
}
"""The rise over its present size, from the share of the time since the change that has passed."""

FEWEST_AFTER = 3
_RISE_PRIOR = 0.5  # of the level
_BAD_CYCLE = 4.0  # scatters from the median of its neighbours
_NEIGHBOURS = 7


@dataclass(frozen=True)
class Posterior:
    """All candidates with what the data say of each; in units of one healthy cycle's scatter.

    Parameters
    ----------
    found : Standing
    time_s : ndarray, shape (n,)
        Of the cycles that count.
    cycle : ndarray of int, shape (n,)
        Their places in the series.
    first : ndarray of int, shape (c,)
        Of each candidate time: which of these n cycles is the first changed one.
    weight : ndarray, shape (shapes, c)
        Probability of each candidate given that there was a change; sums to one.
    level, rise : ndarray, shape (shapes, c)
        Posterior means of mu and a.
    level_variance, rise_variance, covariance : ndarray, shape (shapes, c)
        Over the noise's variance.
    noise_variance : ndarray, shape (shapes, c)
        Its posterior scale.
    worth : float
        Degrees of freedom.
    changed : float
        Probability that there was a change at all, one half beforehand.
    """

    found: Standing
    time_s: Floats
    cycle: np.ndarray[tuple[int], np.dtype[np.intp]]
    first: np.ndarray[tuple[int], np.dtype[np.intp]]
    weight: Floats
    level: Floats
    rise: Floats
    level_variance: Floats
    rise_variance: Floats
    covariance: Floats
    noise_variance: Floats
    worth: float
    changed: float

    def onset_s(self) -> Floats:
        """Return the time of the last unchanged cycle of each candidate, shape (c,)."""
        return self.time_s[self.first - 1]


def change_posterior(series: FeatureSeries, feature: str) -> Posterior | None:
    """Return the posterior, or None where baseline or cycles after it are too few.

    The baseline is held to be without fault: no candidate lies within it.
    """
    found = standing(series, feature)
    if found is None:
        return None
    own = found.own * np.hypot(1.0, found.shared)
    y = found.z * found.own / found.scatter
    kept = np.flatnonzero(_kept(y))
    first = np.flatnonzero(kept >= max(1, series.healthy))
    first = first[first >= 1]
    if first.size < FEWEST_AFTER:
        return None
    precision = (found.scatter / own[kept]) ** 2
    prior = (found.scatter / (_RISE_PRIOR * found.level)) ** 2
    times = series.time_s[kept]
    once = _posterior(found, times, y[kept], precision, kept, first, prior)
    tied = replace(found, autocorrelation=_tie(once, y[kept], np.sqrt(precision)))
    return _posterior(tied, times, y[kept], precision, kept, first, prior)


def _tie(once: Posterior, y: Floats, root: Floats) -> float:
    """Return the correlation of neighbours that all cycles show about the likeliest course.

    The baseline alone is short, and what it shows is drawn to none: with too small a correlation,
    a wander of some nights passes for the change's beginning.
    """
    shape, at = np.unravel_index(int(np.argmax(once.weight)), once.weight.shape)
    onset = once.time_s[once.first[at] - 1]
    share = np.maximum(0.0, once.time_s - onset) / (once.time_s[-1] - onset)
    course = list(SHAPES.values())[shape](share)
    left = root * (y - once.level[shape, at] - once.rise[shape, at] * course)
    return autocorrelation(left - np.mean(left))


def _posterior(
    found: Standing,
    time_s: Floats,
    y: Floats,
    precision: Floats,
    cycle: np.ndarray[tuple[int], np.dtype[np.intp]],
    first: np.ndarray[tuple[int], np.dtype[np.intp]],
    prior: float,
) -> Posterior:
    """Weigh every candidate; the sums run over the n cycles, arrays have shape (shapes, c)."""
    onset = time_s[first - 1][:, None]
    share = np.maximum(0.0, time_s - onset) / (time_s[-1] - onset)
    root, tie = np.sqrt(precision), found.autocorrelation
    ones, seen = _whitened(root, tie, cycle), _whitened(root * y, tie, cycle)
    total, worth = float(ones @ ones), y.size - 1.0
    y_mean = float(ones @ seen) / total
    apart = seen - y_mean * ones
    s_yy = float(apart @ apart)
    rows = []
    for shape in SHAPES.values():
        x = _whitened(root * shape(share), tie, cycle)
        x_mean = x @ ones / total
        rows.append((x_mean, np.sum(x**2, axis=1) - total * x_mean**2, x @ apart))
    x_mean, s_xx, s_xy = (np.array(part) for part in zip(*rows, strict=True))
    rise = s_xy / (s_xx + prior)
    left = np.maximum(s_yy - s_xy * rise, 1e-12 * max(s_yy, 1e-12))
    gaps = np.diff(time_s)[first - 1]
    log = np.log(gaps / np.sum(gaps) / len(SHAPES)) + 0.5 * np.log(prior / (s_xx + prior))
    log = log - 0.5 * worth * np.log(left / max(s_yy, 1e-12))
    top = float(np.max(log))
    weight = np.exp(log - top)
    evidence = top + float(np.log(np.sum(weight)))
    rise_variance = 1.0 / (s_xx + prior)
    return Posterior(
        found,
        time_s,
        cycle,
        first,
        weight / np.sum(weight),
        y_mean - x_mean * rise,
        rise,
        1.0 / total + x_mean**2 * rise_variance,
        rise_variance,
        -x_mean * rise_variance,
        left / worth,
        worth,
        float(1.0 / (1.0 + np.exp(-np.clip(evidence, -700.0, 700.0)))),
    )


def _whitened(rows: Floats, tie: float, cycle: np.ndarray[tuple[int], np.dtype[np.intp]]) -> Floats:
    """Return rows, shape (..., n), whose neighbours are not correlated any more.

    Cycles that are d apart are taken to be correlated by ``tie ** d`` (first order).
    """
    near = tie ** np.diff(cycle)
    fresh = (rows[..., 1:] - near * rows[..., :-1]) / np.sqrt(1.0 - near**2)
    return np.concatenate((rows[..., :1], fresh), axis=-1)


def _kept(y: Floats) -> Marks:
    """Return which cycles count: those carried that do not stand far out of their neighbours."""
    kept: Marks = np.isfinite(y)
    carried = y[kept]
    centre = median_filter(carried, _NEIGHBOURS, mode="nearest")
    kept[kept] = np.abs(carried - centre) <= _BAD_CYCLE * max(
        1.0, 1.4826 * float(np.median(np.abs(carried - centre)))
    )
    return kept
