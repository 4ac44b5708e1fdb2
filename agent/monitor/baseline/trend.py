"""Does a feature rise or fall from the first cycle on? Bayes factors that may be asked at any time.

A baseline is held to be healthy, and wear that is there before its first cycle is learned as
health. So the first cycles themselves are asked. A feature is, with or without a trend,

    y_i = level x (1 + b . phi(c_i) + s x_i) + noise,

with the columns phi and the priors of b of `compensation`, x_i the time in usual intervals between
cycles, and noise of unknown size whose neighbours are correlated (first order) by an unknown
amount. Without a trend s is zero; with one it is half-normal on its side of zero, of one of several
widths. Level and noise (Jeffreys's priors), b, the correlation and the bend of the temperature's
law are integrated out on both sides, so that a temperature which went one way with time leaves
neither ahead. What grown joints of the same kind show stands beside what is held at large
(`kind`), on both sides.

Such a Bayes factor is a test martingale under the hypothesis without a trend (level and scale are a
group, and theirs the right Haar prior: Hendriksen, de Heide and Grünwald, Bayesian Analysis 16
(2021) 961), so that it ever comes beyond 1/a with a probability of at most a (Ville 1939): it may
be asked after each cycle, and the threshold is the false-alarm probability itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr, ndtr

from agent.identify.result import Floats, Parameter
from agent.monitor.compensation.compensation import PRIORS
from agent.monitor.compensation.held import held_of
from agent.monitor.compensation.kind import LOG_ANY_SIZE, Kind
from agent.monitor.detection.decision import Marks
from agent.monitor.history.table import Features

FEWEST = 10
"""Cycles below which no trend is looked for."""

_DECAYS_K = (math.inf, 32.0, 15.0)
_TIES = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 0.9])
_TIE_SHARES = np.array([0.3, 0.25, 0.2, 0.12, 0.08, 0.05])
_WIDTHS = np.array([0.1, 0.3, 1.0, 3.0]) / 365.0  # of s, shares a usual interval: nightly, a year
_SIZES = 24  # of the noise, to integrate over
_REACH = (0.4, 1.8)  # of the noise that the cycles show, with and without a trend
_OUTLIER = 5.0  # robust deviations
_TINY = 1e-5  # of the level: no noise is smaller
_COUNTS = 1e-4  # of the greatest weight
_GRID = 200  # slopes, for the interval
_LEAST = 0.1  # of the middle level: what the first cycle has at least


@dataclass(frozen=True)
class Trend:
    """What some first cycles say of a trend: sums over shapes, correlations and sizes of the noise.

    Parameters
    ----------
    span : float
        Of the trend's course, from the first of these cycles to the last; in usual intervals.
    log_none : ndarray, shape (shapes, correlations, sizes)
        Logarithm of the likelihood without a trend.
    pull, stiffness : ndarray, of that shape
        A slope s adds s pull - s^2 stiffness / 2 to it.
    """

    span: float
    log_none: Floats
    pull: Floats
    stiffness: Floats

    def against_none(self, side: float) -> float:
        """Return the logarithm of the Bayes factor of a trend up (1) or down (-1)."""
        return _log_sum(self._weights(side)) - _log_sum(self.log_none)

    def rise(self, side: float) -> Parameter:
        """Return the rise from the first cycle to the last with its 95 % interval, given its side.

        As a share of the level at the first cycle.
        """
        log = self._weights(side).ravel()
        weight = np.exp(log - np.max(log))
        some = weight > _COUNTS
        weight = weight[some] / np.sum(weight[some])
        precision = (self.stiffness[..., None] + _WIDTHS**-2.0).ravel()[some]
        mean = np.broadcast_to(side * self.pull[..., None], (*self.pull.shape, _WIDTHS.size))
        mean, spread = mean.ravel()[some] / precision, 1.0 / np.sqrt(precision)
        grid = np.linspace(0.0, float(np.max(np.maximum(mean, 0.0) + 5.0 * spread)), _GRID)
        below, nothing = ndtr((grid[:, None] - mean) / spread), ndtr(-mean / spread)
        share = ((below - nothing) / (1.0 - nothing)) @ weight
        share /= share[-1]
        middle = float(np.sum(0.5 * (grid[1:] + grid[:-1]) * np.diff(share)))
        ends = (float(np.interp(q, share, grid)) for q in (0.025, 0.975))
        low, high = sorted(self._from_first(side * end) for end in ends)
        return Parameter(self._from_first(side * middle), (low, high))

    def _from_first(self, slope: float) -> float:
        """Return the whole rise of a slope, which is a share of the level at the middle cycle."""
        rise = self.span * slope
        return rise / max(1.0 - 0.5 * rise, _LEAST)

    def _weights(self, side: float) -> Floats:
        """Return log likelihoods with a trend, one more axis: the widths of its prior."""
        precision = self.stiffness[..., None] + _WIDTHS**-2.0
        pull = side * self.pull[..., None]
        gain = 0.5 * pull**2 / precision + log_ndtr(pull / np.sqrt(precision))
        prior = np.log(2.0 / _WIDTHS.size) - np.log(_WIDTHS * np.sqrt(precision))
        return np.asarray(self.log_none[..., None] + gain + prior)


def trend(features: Features, time: Floats, name: str, course: Floats | None = None) -> Trend:
    """Return what cycles say of a trend of one feature.

    Parameters
    ----------
    features : Features
        Of n cycles in order of time, n at least `FEWEST`.
    time : ndarray, shape (n,)
        In usual intervals between two cycles.
    name : str
        The feature.
    course : ndarray, shape (n,), optional
        Of the trend, where it is not a straight line over time; it rises by one an interval where
        it is steepest.
    """
    course = time if course is None else course
    return _integrated(float(course[-1] - course[0]), _rows(features, time, course, name))


class _Rows(NamedTuple):
    """What is weighed, one entry for each shape of the conditions' effect.

    `rows`, shape (shapes, p + 3, n): p columns of the conditions in prior deviations, a constant,
    time, and the feature without the priors' middle; all over each cycle's own deviation. `gaps`,
    shape (n - 1,), are the times between the cycles that count. `log_ties`, shape (shapes, ties),
    is what is held of the correlation, and `lent`, shape (shapes,), whether a shape is what joints
    of the kind show, whose `log_size` then holds for the noise.
    """

    rows: Floats
    gaps: Floats
    log_ties: Floats
    lent: Marks
    kind: Kind | None

    @property
    def conditions(self) -> int:
        """Return p."""
        return int(self.rows.shape[1] - 3)

    def log_sizes(self, sizes: Floats) -> Floats:
        """Return what is held of the logarithm of the noise, shape (shapes, 1, sizes)."""
        at_large = np.full(sizes.shape, LOG_ANY_SIZE)
        alike = at_large if self.kind is None else self.kind.log_size(sizes)
        return np.where(self.lent[:, None], alike, at_large)[:, None, :]


def _rows(features: Features, time: Floats, course: Floats, name: str) -> _Rows:
    """Return the rows; cycles far off are left out."""
    values, stated = features.values[name], features.deviations[name]
    size, kind = float(np.median(values)), features.kinds.get(name)
    held = held_of(features.conditions, values, PRIORS[name], kind, _DECAYS_K)
    most = max(one.middle.size for one in held)
    sure = np.minimum(1.0, np.median(stated) / np.maximum(stated, _TINY * abs(size)))
    shapes = []
    for one in held:
        columns = one.columns(features.conditions)
        y = values / size - 1.0 - columns @ one.middle
        x = course - course.mean()
        apart = (columns @ np.linalg.cholesky(one.covariance)).T
        unused = np.zeros((most - one.middle.size, y.size))
        shapes.append(np.vstack((apart, unused, np.ones_like(y), x, y)) * sure)
    rows, lent = np.stack(shapes), np.array([one.lent for one in held])
    kept = _near(rows[-1] / sure)
    at_large = np.log(_TIE_SHARES)
    alike = at_large if kind is None else np.log(kind.tie_shares(_TIES))
    shares = np.array([one.log_share for one in held])
    log_ties = shares[:, None] + np.where(lent[:, None], alike, at_large)
    return _Rows(rows[:, :, kept], np.diff(time[kept]), log_ties, lent, kind)


def _near(rows: Floats) -> Marks:
    """Return which cycles are not far off a plain fit with a trend, (n,): at least four fifths."""
    columns, y = rows[:-1].T, rows[-1]
    held = np.eye(columns.shape[1])[:-2] * 0.01  # priors, as cycles that scatter by 1 %
    fit = np.linalg.lstsq(
        np.vstack((columns, held)), np.append(y, np.zeros(len(held))), rcond=None
    )[0]
    left = y - columns @ fit
    left -= np.median(left)
    robust = 1.4826 * float(np.median(np.abs(left)))
    near: Marks = np.abs(left) <= _OUTLIER * max(robust, _TINY)
    return near if near.mean() >= 0.8 else np.ones_like(near)


def _log_sum(log: Floats) -> float:
    """Return the logarithm of the sum of exponentials."""
    top = float(np.max(log))
    return top + math.log(float(np.sum(np.exp(log - top))))


def _integrated(span: float, given: _Rows) -> Trend:
    """Integrate level and conditions out, for each shape, correlation and size of the noise."""
    rows, gaps, p = given.rows, given.gaps, given.conditions
    near = _TIES[:, None] ** gaps  # (ties, n - 1)
    fresh = (rows[:, None, :, 1:] - near[:, None, :] * rows[:, None, :, :-1]) / np.sqrt(
        1.0 - near[:, None, :] ** 2
    )
    first = np.broadcast_to(rows[:, None, :, :1], (*fresh.shape[:3], 1))
    white = np.concatenate((first, fresh), axis=-1)
    gram = white @ np.swapaxes(white, -1, -2)
    level = gram[..., p, p]
    apart = gram - gram[..., :, p, None] * gram[..., p, None, :] / level[..., None, None]
    apart = np.delete(np.delete(apart, p, axis=-1), p, axis=-2)  # conditions, time, feature
    count = rows.shape[-1] - 1
    sizes = _sizes(apart, p, count)
    inner = apart[..., None, :, :] / sizes[:, None, None] ** 2
    held = inner[..., :p, :p] + np.eye(p)
    solved = np.linalg.solve(held, inner[..., :p, p:])
    left = inner[..., p:, p:] - np.swapaxes(inner[..., :p, p:], -1, -2) @ solved
    determinant = np.linalg.slogdet(held)[1]
    log_none = (
        given.log_ties[..., None]
        + given.log_sizes(sizes)
        - count * np.log(sizes)
        - 0.5 * np.sum(np.log(1.0 - near**2), axis=-1)[:, None]
        - 0.5 * np.log(level)[..., None]
        - 0.5 * determinant
        - 0.5 * left[..., 1, 1]
    )
    return Trend(span, log_none, left[..., 0, 1], left[..., 0, 0])


def _sizes(apart: Floats, p: int, count: int) -> Floats:
    """Return the noise's sizes to integrate over, evenly apart in their logarithm."""
    held = apart + np.diag([1e-4] * p + [0.0, 0.0])
    shown = []
    for known in (p, p + 1):  # without the trend, and with it
        pulled = np.linalg.solve(held[..., :known, :known], apart[..., :known, -1:])
        fitted = np.sum(pulled[..., 0] * apart[..., :known, -1], axis=-1)
        shown.append(np.sqrt(np.maximum(apart[..., -1, -1] - fitted, 0.0) / max(count - known, 1)))
    low = max(_REACH[0] * float(np.min(shown[1])), _TINY)
    return np.geomspace(low, max(_REACH[1] * float(np.max(shown[0])), 2.0 * low), _SIZES)
