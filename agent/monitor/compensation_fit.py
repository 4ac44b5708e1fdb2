"""Learning what temperature, payload and load do, from healthy cycles: a regression with priors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from agent.identify.result import Floats
from agent.monitor.compensation import Basis, Bend, Conditions, Law, Prior

_DECAYS_K = (math.inf, 50.0, 32.0, 24.0, 19.0, 15.0, 12.0)
_USUAL_SCATTER = 0.005  # of the level, from cycle to cycle, worth `_SCATTER_CYCLES` of them
_SCATTER_CYCLES = 2.0
_LOG_TOLERANCE = 5e-3  # of a scatter's variance
_ALIKE = 1.5  # so many neighbouring cycles tell as much as one that is independent: memory of 0.2
_VARIES = 1e-3
_OUTLIER = 5.0  # robust deviations
_FEWEST_INSIDE = 3
_UNSURE = 1e4  # variance of a cycle that is not one of the others, in squared levels


def learn(conditions: Conditions, values: Floats, deviations: Floats, prior: Prior) -> Law:
    """Learn one feature's law from healthy cycles.

    Parameters
    ----------
    conditions : Conditions
        Of the n healthy cycles. Temperature is known for all of them or for none.
    values, deviations : ndarray, shape (n,)
        The feature, and the standard deviation of its measurement.
    prior : Prior

    Raises
    ------
    ValueError
        There is no cycle, or some have a temperature and some do not.
    """
    if not values.size:
        raise ValueError("expected healthy cycles, got none")
    known = np.isfinite(conditions.temperature_degc)
    if known.any() and not known.all():
        raise ValueError("expected a temperature for all healthy cycles or for none")
    basis = basis_of(conditions)
    size = float(np.median(values))
    size = size if abs(size) > 0.0 else 1.0
    y, noise = values / size, deviations / abs(size)
    centre, width = basis.prior(prior)
    decays = _DECAYS_K if basis.temperature else _DECAYS_K[:1]
    columns = [basis.columns(conditions, decay_k) for decay_k in decays]
    best = 0
    for _ in range(2):  # a scatter about a shape that does not fit is too large: once more
        variance, scatter = _variance(columns[best], y, noise, centre, width)
        weight = 1.0 / (_caution(y.size, width.size) * variance)
        solved = [_solve(own, y, weight, centre, width) for own in columns]
        best = int(np.argmax([s.unseen for s in solved]))
    merit = np.array([s.unseen for s in solved])
    share = np.exp(merit - merit.max())
    bends = tuple(
        Bend(decay_k, float(w), s.coefficients, s.covariance, s.middle)
        for decay_k, w, s in zip(decays, share / share.sum(), solved, strict=True)
    )
    moved = sum(b.weight * float(b.middle @ b.coefficients) for b in bends)
    return Law(
        basis=basis,
        bends=bends,
        level=size * (solved[0].mean - moved),
        level_deviation=abs(size) * solved[0].mean_deviation,
        size=size,
        scatter=abs(size) * scatter,
        cycles=int(y.size),
    )


def _caution(cycles: int, coefficients: int) -> float:
    """Return by how much a few cycles' variances count larger than they seem.

    Neighbouring nights are alike, and their scatter is known from themselves alone: Student's
    variance for their degrees of freedom.
    """
    free = cycles - coefficients - 1 + _SCATTER_CYCLES
    return _ALIKE * free / max(free - 2.0, 1.0) if free > 0.0 else 3.0 * _ALIKE


def basis_of(conditions: Conditions) -> Basis:
    """Return the columns that these healthy cycles can be asked for."""
    given = (conditions.temperature_degc, conditions.payload_kg, conditions.load_nm)
    known = [values[np.isfinite(values)] for values in given]
    mean, low, high = (
        tuple(float(f(v)) if v.size else math.nan for v in known) for f in (np.mean, np.min, np.max)
    )
    payload = high[1] if known[1].size and np.ptp(known[1]) > _VARIES * max(high[1], 1e-9) else 0.0
    load = 0.0
    if known[2].size == conditions.load_nm.size and known[2].size:
        load = _spread_beyond_noise(conditions)
    return Basis(
        temperature=bool(known[0].size),
        reference=(mean[0], mean[1], mean[2]),
        lowest=(low[0], low[1], low[2]),
        highest=(high[0], high[1], high[2]),
        payload_scale_kg=payload,
        load_scale_nm=load,
    )


def _spread_beyond_noise(conditions: Conditions) -> float:
    """Return the load's span where it differs by more than a tenth, and payload does not say so."""
    load, payload = conditions.load_nm, conditions.payload_kg
    span = float(np.ptp(load))
    if span < 0.1 * float(np.mean(load)):
        return 0.0
    if np.all(np.isfinite(payload)) and np.ptp(payload) > 0.0:
        return 0.0
    return span


def _variance(
    columns: Floats, y: Floats, noise: Floats, centre: Floats, width: Floats
) -> tuple[Floats, float]:
    """Return each cycle's variance, and the scatter in it; a cycle far off its fellows is unsure.

    How far a cycle is off tells whether it is one of them: its distance from the rest in robust
    deviations. One that is not counts for next to nothing, and does not widen the others.
    """
    variance = _scatter(columns, y, noise, centre, width)
    left = y - _solve(columns, y, 1.0 / variance, centre, width).predicted
    robust = max(1.4826 * float(np.median(np.abs(left - np.median(left)))), 1e-3 * _USUAL_SCATTER)
    inside = np.abs(left) <= _OUTLIER * np.maximum(robust, noise)
    if np.all(inside) or np.count_nonzero(inside) < max(_FEWEST_INSIDE, 0.8 * y.size):
        return variance, math.sqrt(float(np.median(variance - noise**2)))
    kept = _scatter(columns[inside], y[inside], noise[inside], centre, width)
    between = float(np.median(kept - noise[inside] ** 2))
    return np.where(inside, noise**2 + between, _UNSURE), math.sqrt(between)


@dataclass(frozen=True)
class _Solved:
    """Weighted ridge regression about the weighted mean.

    `unseen` is the logarithm of the density of every cycle, predicted from the others, summed;
    `freedom` the number of parameters that the data use up.
    """

    mean: float
    mean_deviation: float
    coefficients: Floats
    covariance: Floats
    middle: Floats
    predicted: Floats
    unseen: float
    freedom: float


def _solve(columns: Floats, y: Floats, weight: Floats, centre: Floats, width: Floats) -> _Solved:
    """Solve for the mean (no prior) and the coefficients (normal prior) under given weights."""
    total = float(weight.sum())
    middle: Floats = np.asarray(weight @ columns / total, dtype=np.float64)
    mean = float(weight @ y) / total
    away, left = columns - middle, y - mean
    precision = (away.T * weight) @ away + np.diag(1.0 / width**2)
    covariance: Floats = np.asarray(np.linalg.inv(precision), dtype=np.float64)
    pull = np.asarray((away.T * weight) @ left + centre / width**2, dtype=np.float64)
    coefficients = covariance @ pull
    predicted: Floats = np.asarray(mean + away @ coefficients, dtype=np.float64)
    leverage = weight * (1.0 / total + np.einsum("ni,ij,nj->n", away, covariance, away))
    seen = np.maximum(1.0 - leverage, 1e-6)
    unseen = 0.5 * float(np.sum(np.log(seen * weight) - weight * (y - predicted) ** 2 / seen))
    return _Solved(
        mean,
        1.0 / math.sqrt(total),
        coefficients,
        covariance,
        middle,
        predicted,
        unseen,
        float(leverage.sum()),
    )


def _scatter(columns: Floats, y: Floats, noise: Floats, centre: Floats, width: Floats) -> Floats:
    """Return each cycle's variance: its noise, and a scatter that makes the residuals fit.

    The scatter is where the weighted squares equal their degrees of freedom (Paule and Mandel,
    J. Res. NBS 87 (1982) 377), together with a few imagined cycles of a usual scatter.
    """
    usual = _USUAL_SCATTER**2

    def excess(log_between: float) -> float:
        between = math.exp(log_between)
        variance = noise**2 + between
        solved = _solve(columns, y, 1.0 / variance, centre, width)
        squares = float(np.sum((y - solved.predicted) ** 2 / variance))
        squares += _SCATTER_CYCLES * usual / between
        return math.log(squares / (y.size - solved.freedom + _SCATTER_CYCLES))

    low, high = math.log(1e-4 * usual), math.log(10.0 * (float(np.var(y)) + usual))
    if excess(high) > 0.0:  # the priors themselves do not fit these cycles
        return np.asarray(noise**2 + math.exp(high))
    return np.asarray(noise**2 + math.exp(brentq(excess, low, high, xtol=_LOG_TOLERANCE)))
