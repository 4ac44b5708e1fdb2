"""Learning what temperature, payload and load do, from healthy cycles: a regression with priors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from agent.identify.result import Floats
from agent.monitor.compensation.compensation import Bend, Conditions, Law, Prior
from agent.monitor.compensation.held import Held, held_of, size_of
from agent.monitor.compensation.kind import Kind

_USUAL_SCATTER = 0.005  # of the level, from cycle to cycle, worth `_SCATTER_CYCLES` of them
_SCATTER_CYCLES = 2.0
_LOG_TOLERANCE = 5e-3  # of a scatter's variance
_ALIKE = 1.5  # so many neighbouring cycles tell as much as one that is independent: memory of 0.2
_OUTLIER = 5.0  # robust deviations
_FEWEST_INSIDE = 3
_OF_SCATTER = 0.1
_UNSURE = 1e4  # variance of a cycle that is not one of the others, in squared levels


def learn(
    conditions: Conditions,
    values: Floats,
    deviations: Floats,
    prior: Prior,
    kind: Kind | None = None,
) -> Law:
    """Learn one feature's law from healthy cycles.

    Parameters
    ----------
    conditions : Conditions
        Of the n healthy cycles. Temperature is known for all of them or for none.
    values, deviations : ndarray, shape (n,)
        The feature, and the standard deviation of its measurement.
    prior : Prior
    kind : Kind, optional
        What grown joints of the same kind show.

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
    size, held = size_of(values), held_of(conditions, values, prior, kind)
    y, noise = values / size, deviations / abs(size)
    columns = [one.columns(conditions) for one in held]
    best, usual = 0, _USUAL
    for _ in range(2):  # a scatter about a shape that does not fit is too large: once more
        variance, scatter = _variance(columns[best], y, noise, held[best], usual)
        weight = 1.0 / (_caution(y.size, held[best].middle.size, usual) * variance)
        solved = [_solve(own, y, weight, one) for own, one in zip(columns, held, strict=True)]
        share = _shares(held, solved)
        best = int(np.argmax(share))
        if kind is not None:
            usual = _usual(kind, variance, noise, y.size - solved[best].freedom)
    bends = tuple(
        Bend(h.decay_k, float(w), s.coefficients, s.covariance, s.middle, h.basis, h.zero)
        for h, w, s in zip(held, share, solved, strict=True)
    )
    moved = sum(b.weight * float(b.middle @ b.coefficients) for b in bends)
    return Law(
        basis=held[0].basis,
        bends=bends,
        level=size * (solved[0].mean - moved),
        level_deviation=abs(size) * solved[0].mean_deviation,
        size=size,
        scatter=abs(size) * scatter,
        cycles=int(y.size),
    )


def _shares(held: Sequence[Held], solved: Sequence[_Solved]) -> Floats:
    """Return each shape's share: by unseen cycles, and beside the kind's by all of them.

    What is held at large and what the kind shows are weighed by the density of all cycles, which
    rewards the one that had said them beforehand; within each, shapes by the cycles unseen.
    """
    lent = np.array([one.lent for one in held])
    log = np.array([h.log_share + s.evidence for h, s in zip(held, solved, strict=True)])
    merit = np.array([h.log_share + s.unseen for h, s in zip(held, solved, strict=True)])
    out = np.zeros(lent.size)
    for group in (lent, ~lent):
        if group.any():
            inner = np.exp(merit[group] - merit[group].max())
            size = math.exp(np.logaddexp.reduce(log[group]) - np.logaddexp.reduce(log))
            out[group] = size * inner / inner.sum()
    return out


class _Usual(NamedTuple):
    """A scatter between cycles that is usual, as a share, and as many cycles as it is worth."""

    scatter: float
    cycles: float
    alike: float


_USUAL = _Usual(_USUAL_SCATTER, _SCATTER_CYCLES, _ALIKE)


def _usual(kind: Kind, variance: Floats, noise: Floats, free: float) -> _Usual:
    """Return what the kind shows of the scatter, as far as the joint's own cycles agree."""
    own = math.sqrt(float(np.median(variance)))
    between = max(kind.scatter**2 - float(np.median(noise**2)), (_OF_SCATTER * kind.scatter) ** 2)
    cycles = max(kind.borrowed(own, free), _SCATTER_CYCLES)
    return _Usual(math.sqrt(between), cycles, _ALIKE)


def _caution(cycles: int, coefficients: int, usual: _Usual) -> float:
    """Return by how much a few cycles' variances count larger than they seem.

    Neighbouring nights are alike, and their scatter is known from themselves alone: Student's
    variance for their degrees of freedom.
    """
    free = cycles - coefficients - 1 + usual.cycles
    return usual.alike * free / max(free - 2.0, 1.0) if free > 0.0 else 3.0 * usual.alike


def _variance(
    columns: Floats, y: Floats, noise: Floats, held: Held, usual: _Usual
) -> tuple[Floats, float]:
    """Return each cycle's variance, and the scatter in it; a cycle far off its fellows is unsure.

    How far a cycle is off tells whether it is one of them: its distance from the rest in robust
    deviations. One that is not counts for next to nothing, and does not widen the others.
    """
    variance = _scatter(columns, y, noise, held, usual)
    left = y - _solve(columns, y, 1.0 / variance, held).predicted
    robust = max(1.4826 * float(np.median(np.abs(left - np.median(left)))), 1e-3 * _USUAL_SCATTER)
    inside = np.abs(left) <= _OUTLIER * np.maximum(robust, noise)
    if np.all(inside) or np.count_nonzero(inside) < max(_FEWEST_INSIDE, 0.8 * y.size):
        return variance, math.sqrt(float(np.median(variance - noise**2)))
    kept = _scatter(columns[inside], y[inside], noise[inside], held, usual)
    between = float(np.median(kept - noise[inside] ** 2))
    return np.where(inside, noise**2 + between, _UNSURE), math.sqrt(between)


@dataclass(frozen=True)
class _Solved:
    """Weighted ridge regression about the weighted mean.

    `unseen` is the logarithm of the density of every cycle, predicted from the others, summed;
    `evidence`, up to a constant, that of all of them, predicted from what was held before;
    `freedom` the number of parameters that the data use up.
    """

    mean: float
    mean_deviation: float
    coefficients: Floats
    covariance: Floats
    middle: Floats
    predicted: Floats
    unseen: float
    evidence: float
    freedom: float


def _solve(columns: Floats, y: Floats, weight: Floats, held: Held) -> _Solved:
    """Solve for the mean (no prior) and the coefficients (normal prior) under given weights."""
    total = float(weight.sum())
    middle: Floats = np.asarray(weight @ columns / total, dtype=np.float64)
    mean = float(weight @ y) / total
    away, left = columns - middle, y - mean
    centre, stiff = held.middle, np.linalg.inv(held.covariance)
    precision = (away.T * weight) @ away + stiff
    covariance: Floats = np.asarray(np.linalg.inv(precision), dtype=np.float64)
    pull = np.asarray((away.T * weight) @ left + stiff @ centre, dtype=np.float64)
    coefficients = covariance @ pull
    predicted: Floats = np.asarray(mean + away @ coefficients, dtype=np.float64)
    leverage = weight * (1.0 / total + np.einsum("ni,ij,nj->n", away, covariance, away))
    seen = np.maximum(1.0 - leverage, 1e-6)
    unseen = 0.5 * float(np.sum(np.log(seen * weight) - weight * (y - predicted) ** 2 / seen))
    apart = coefficients - centre
    squares = float(weight @ (y - predicted) ** 2 + apart @ stiff @ apart)
    known = float(np.linalg.slogdet(stiff)[1] - np.linalg.slogdet(precision)[1])
    return _Solved(
        mean,
        1.0 / math.sqrt(total),
        coefficients,
        covariance,
        middle,
        predicted,
        unseen,
        0.5 * (known - squares),
        float(leverage.sum()),
    )


def _scatter(columns: Floats, y: Floats, noise: Floats, held: Held, usual: _Usual) -> Floats:
    """Return each cycle's variance: its noise, and a scatter that makes the residuals fit.

    The scatter is where the weighted squares equal their degrees of freedom (Paule and Mandel,
    J. Res. NBS 87 (1982) 377), together with a few imagined cycles of a usual scatter.
    """
    small = _USUAL_SCATTER**2

    def excess(log_between: float) -> float:
        between = math.exp(log_between)
        variance = noise**2 + between
        solved = _solve(columns, y, 1.0 / variance, held)
        squares = float(np.sum((y - solved.predicted) ** 2 / variance))
        squares += usual.cycles * usual.scatter**2 / between
        return math.log(squares / (y.size - solved.freedom + usual.cycles))

    low, high = math.log(1e-4 * small), math.log(10.0 * (float(np.var(y)) + small))
    if excess(high) > 0.0:  # the priors themselves do not fit these cycles
        return np.asarray(noise**2 + math.exp(high))
    return np.asarray(noise**2 + math.exp(brentq(excess, low, high, xtol=_LOG_TOLERANCE)))
