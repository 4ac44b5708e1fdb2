"""The law of a cooling curve with its likelihood: which r, settled and initial temperature fit.

Newton's law is linear in everything but its rate r: r is scanned on a grid, every point weighted
by its likelihood with coloured residuals, and (r, settled, initial) is drawn from it. The interval
of a law that bends is not symmetric, and draws carry that into everything that follows from them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.uncertainty import correlation_time, student_975
from agent.physics.thermal import followed_k, relaxation_columns

DRAWS = 4000
_GRID = 240
_SLOWEST, _FASTEST = 2e-3, 60.0  # r times the curve's duration
_EDGE_WEIGHT = 0.02
_LAGS = 10
_GAP = 10.0  # times the usual step of time
_SIGNIFICANT = 2.0


@dataclass(frozen=True)
class CoolingDraws:
    """The law that fits best, and draws in proportion to the likelihood.

    Parameters
    ----------
    rate_per_s, settled_degc, initial_degc : float
        Of the best fit.
    draws : ndarray, shape (m, 3)
        (r, settled, initial).
    rmse_degc : float
        What is left of the curve.
    wander_degc : float
        The part of it that is no noise of the reading: slow, so that a forecast must count it.
    bends : bool
        Whether r is kept from zero by the curve: a straight line has no settled temperature.
    """

    rate_per_s: float
    settled_degc: float
    initial_degc: float
    draws: Floats
    rmse_degc: float
    wander_degc: float
    bends: bool


def neighbours(time_s: Floats, most: int) -> NDArray[np.int64]:
    """Return the block of every sample, rising from 0: about `most` of equal numbers of samples.

    No block reaches over a gap, as between two recordings: a mean over it would be at no time that
    was measured.
    """
    step = np.diff(time_s)
    gap = step > _GAP * np.median(step) if step.size else np.zeros(0, dtype=np.bool_)
    first = np.concatenate(([0], np.flatnonzero(gap) + 1))
    lengths = np.diff(np.append(first, time_s.size))
    own = np.arange(time_s.size) - np.repeat(first, lengths)
    width = max(-(-time_s.size // most), 1)
    return np.cumsum(own % width == 0).astype(np.int64) - 1


def followed(rate_per_s: float, time_s: Floats, ambient_degc: Floats | None) -> Floats:
    """Return the gearbox's answer to the ambient temperature's changes about its mean."""
    if ambient_degc is None or float(np.ptp(ambient_degc)) == 0.0:
        return np.zeros_like(time_s)
    return followed_k(rate_per_s, time_s, ambient_degc - ambient_degc.mean())


def colour(residuals: Floats) -> float:
    """Return the correlation time of residuals in samples; 1 unless they are clearly coloured.

    A correlation time is never below 1, so that its own scatter would widen every interval of
    white noise; it counts where the first autocorrelations are above zero by more than chance.
    """
    centred = residuals - residuals.mean()
    power = float(centred @ centred)
    lags = range(1, min(_LAGS, residuals.size // 4) + 1)
    if power <= 0.0 or not lags:
        return 1.0
    rho = np.array([float(centred[k:] @ centred[:-k]) for k in lags]) / power
    scores = np.array((rho[0], math.sqrt(rho.size) * rho.mean())) * math.sqrt(residuals.size)
    return correlation_time([residuals]) if scores.max() > _SIGNIFICANT else 1.0


def fit_cooling(
    time_s: Floats, temperature_degc: Floats, ambient_degc: Floats | None
) -> CoolingDraws:
    """Fit the law to readings whose noise is finer than the sensor's steps are coarse.

    Parameters
    ----------
    time_s, temperature_degc : ndarray, shape (n,)
        From the curve's start.
    ambient_degc : ndarray, shape (n,), optional
        Measured temperature of the environment.
    """
    n, duration = time_s.size, float(time_s[-1])
    log_rate = np.linspace(math.log(_SLOWEST / duration), math.log(_FASTEST / duration), _GRID)
    lowest = math.log(1.01 * _SLOWEST / duration)
    for _ in range(3):
        solutions = [_solve(math.exp(x), time_s, temperature_degc, ambient_degc) for x in log_rate]
        squares = np.array([float(e @ e) for _, e in solutions])
        best = int(np.argmin(squares))
        tau = colour(solutions[best][1])
        dof = max(n / tau - 3.0, 1.0)
        variance = max(squares[best] / dof, 1e-12)
        weight = (1.0 + (squares - squares[best]) / (variance * dof)) ** (-0.5 * (dof + 1.0))
        kept = np.flatnonzero(weight > 1e-6)
        low, high = max(kept[0] - 1, 0), min(kept[-1] + 1, log_rate.size - 1)
        if high - low > _GRID // 3:
            break
        log_rate = np.linspace(log_rate[low], log_rate[high], _GRID)
    theta, rest = solutions[best]
    return CoolingDraws(
        math.exp(float(log_rate[best])),
        float(theta[0]),
        float(theta[1]),
        _draw(log_rate, weight, solutions, time_s, variance, dof),
        math.sqrt(squares[best] / n),
        math.sqrt(max(float(np.var(rest)) - 0.5 * float(np.mean(np.diff(rest) ** 2)), 0.0))
        if tau > 1.0
        else 0.0,
        not ((weight[0] > _EDGE_WEIGHT and log_rate[0] <= lowest) or best == 0),
    )


def _solve(
    rate: float, time_s: Floats, temperature: Floats, ambient: Floats | None
) -> tuple[Floats, Floats]:
    """Return (settled, initial) and the residuals for one r."""
    columns = relaxation_columns(rate, time_s)
    target = temperature - followed(rate, time_s, ambient)
    theta = np.linalg.lstsq(columns, target, rcond=None)[0]
    return np.asarray(theta, dtype=np.float64), np.asarray(target - columns @ theta)


def _draw(
    log_rate: Floats,
    weight: Floats,
    solutions: list[tuple[Floats, Floats]],
    time_s: Floats,
    variance: float,
    dof: float,
) -> Floats:
    """Return draws of (r, settled, initial); a fixed seed: same data, same answer."""
    generator = np.random.default_rng(0)
    picked = np.sort(generator.choice(weight.size, size=DRAWS, p=weight / weight.sum()))
    out = np.empty((DRAWS, 3))
    inflation = student_975(dof) / student_975(math.inf)
    for i in np.unique(picked):
        rows = np.flatnonzero(picked == i)
        rate = math.exp(float(log_rate[i]))
        columns = relaxation_columns(rate, time_s)
        covariance = np.linalg.pinv(columns.T @ columns, hermitian=True) * variance * inflation**2
        out[rows, 0] = rate
        out[rows, 1:] = generator.multivariate_normal(solutions[i][0], covariance, rows.size)
    # The grid is a staircase; a draw lies anywhere on its step.
    step = float(log_rate[1] - log_rate[0])
    out[:, 0] *= np.exp(step * (generator.random(DRAWS) - 0.5))
    return out
