"""What temperature, payload and load do to a feature, learned from the healthy cycles alone.

A feature (or the friction at one speed) is taken as

    y = level x (1 + b . phi(c)) + noise,

with the columns phi(c) of a cycle's conditions c:

- temperature: with x = T - Tr either x itself (thesis App. A: the integral falls about linearly)
  or Tv (1 - exp(-x / Tv)), the viscosity's fall of the extended law
  (`agent.physics.friction_extended`), and x^2 / 2 for what either lacks. The straight line and
  several Tv are weighed by how well each predicts healthy cycles that it has not seen; what the
  healthy cycles do not tell apart stays side by side, and widens the prediction where it differs;
- payload and load (mean of |gravity|), where the healthy cycles differ in them.

The coefficients b have broad priors, in shares of the level (`Prior`). Where the healthy cycles
span enough temperature, the data overrule them; where not, a prediction far from the learned
temperatures is as uncertain as the priors are broad, and grows so with distance, instead of making
a false alarm. The priors' middles and widths are from Bittencourt & Gunnarsson's joint (JDSMC 134
(2012) 051013, 30 to 70 degC, loads 0 to 16 N m) and the viscosities of the thesis's three oils.

Noise is what the curve's own points have plus a scatter from cycle to cycle, which is estimated.
Two kinds of uncertainty are kept apart: what is each cycle's own, and what all cycles away from
the healthy conditions share because the law may be off.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats

Mask = NDArray[np.bool_]
Index = NDArray[np.bool_] | NDArray[np.signedinteger[Any]]

_DECAYS_K = (math.inf, 60.0, 35.0, 20.0, 12.0)
_USUAL_SCATTER = 0.005  # of the level, from cycle to cycle, worth `_SCATTER_CYCLES` of them
_SCATTER_CYCLES = 2.0
_BISECTIONS = 16
_PAYLOAD_SHARE = 0.15  # what the whole payload may do to friction (one standard deviation)
_VARIES = 1e-3
_OUTLIER = 5.0  # robust deviations
_FEWEST_INSIDE = 3
_UNSURE = 1e4  # variance of a cycle that is not one of the others, in squared levels
_EDGE = 0.15  # of the healthy span: so far beyond is no extrapolation
_LEAST_EDGE_K = 1.0


@dataclass(frozen=True)
class Prior:
    """What is held likely of temperature before a cycle was seen; shares of the level.

    Middle and standard deviation of the slope at the reference temperature; standard deviation,
    about zero, of the second derivative that neither line nor exponential has.
    """

    slope_per_k: float
    slope_deviation_per_k: float
    curvature_per_k2: float


PRIORS: Mapping[str, Prior] = {
    "coulomb_nm": Prior(0.0, 0.02, 3e-4),
    "viscous_nm_s_per_rad": Prior(-0.04, 0.03, 5e-4),
    "integral_w": Prior(-0.015, 0.02, 3e-4),
    "low_integral_w": Prior(-0.005, 0.02, 3e-4),
}
ONE_SPEED = Prior(-0.01, 0.025, 3e-4)


@dataclass(frozen=True)
class Conditions:
    """What cycles were run under, each of shape (n,); NaN where it is not known."""

    temperature_degc: Floats
    payload_kg: Floats
    load_nm: Floats

    def take(self, which: slice | Index) -> Conditions:
        """Return some of the cycles."""
        return Conditions(self.temperature_degc[which], self.payload_kg[which], self.load_nm[which])


@dataclass(frozen=True)
class Compensated:
    """Features at the reference conditions, all of shape (n,).

    Parameters
    ----------
    value : ndarray
        What the feature would be at the reference.
    own_deviation : ndarray
        Of each cycle by itself: its measurement, and the scatter from cycle to cycle.
    shared_deviation : ndarray
        Of the law away from the reference; cycles under the same conditions share this error.
    extrapolated : ndarray of bool
        Where the conditions are outside of the healthy ones.
    """

    value: Floats
    own_deviation: Floats
    shared_deviation: Floats
    extrapolated: Mask

    @property
    def deviation(self) -> Floats:
        """Return one standard deviation of each value."""
        return np.hypot(self.own_deviation, self.shared_deviation)


@dataclass(frozen=True)
class Basis:
    """Which columns, about which reference: the healthy cycles' mean conditions.

    `reference`, `lowest` and `highest` are (degC, kg, N m). `payload_scale_kg` and `load_scale_nm`
    are zero where the healthy cycles do not differ, and the column is absent.
    """

    temperature: bool
    reference: tuple[float, float, float]
    lowest: tuple[float, float, float]
    highest: tuple[float, float, float]
    payload_scale_kg: float
    load_scale_nm: float

    def columns(self, conditions: Conditions, decay_k: float) -> Floats:
        """Return the columns, shape (n, p), zero at the reference; infinite `decay_k`: straight."""
        out = []
        if self.temperature:
            x = conditions.temperature_degc - self.reference[0]
            bent = x if math.isinf(decay_k) else -decay_k * np.expm1(-x / decay_k)
            out += [bent, 0.5 * x**2]
        if self.payload_scale_kg:
            out.append(_apart(conditions.payload_kg, self.reference[1]) / self.payload_scale_kg)
        if self.load_scale_nm:
            out.append(_apart(conditions.load_nm, self.reference[2]) / self.load_scale_nm)
        count = conditions.temperature_degc.size
        return np.stack(out, axis=-1) if out else np.zeros((count, 0))

    def prior(self, prior: Prior) -> tuple[Floats, Floats]:
        """Return middle and standard deviation of the coefficients, each of shape (p,)."""
        loads = bool(self.payload_scale_kg) + bool(self.load_scale_nm)
        middle = [prior.slope_per_k, 0.0] if self.temperature else []
        width = [prior.slope_deviation_per_k, prior.curvature_per_k2] if self.temperature else []
        return np.array(middle + [0.0] * loads), np.array(width + [_PAYLOAD_SHARE] * loads)


def _apart(values: Floats, reference: float) -> Floats:
    """Return values less their reference; 0 where a value is not known."""
    return np.where(np.isfinite(values), values - reference, 0.0)


@dataclass(frozen=True)
class Bend:
    """One shape of the temperature's effect: weight, coefficients (p,), covariance (p, p).

    `middle`, shape (p,), is the columns' mean over the healthy cycles: there the law is least
    uncertain.
    """

    decay_k: float
    weight: float
    coefficients: Floats
    covariance: Floats
    middle: Floats


@dataclass(frozen=True)
class Law:
    """How one feature depends on the conditions.

    Parameters
    ----------
    basis : Basis
    bends : tuple of Bend
        Shapes side by side; their weights sum to 1.
    level, level_deviation : float
        The feature at the reference, and one standard deviation of the healthy cycles' mean.
    size : float
        What coefficients are shares of.
    scatter : float
        From cycle to cycle, beyond the curve's own noise; unit of the feature.
    cycles : int
        How many healthy cycles it was learned from.
    """

    basis: Basis
    bends: tuple[Bend, ...]
    level: float
    level_deviation: float
    size: float
    scatter: float
    cycles: int

    @property
    def name(self) -> str:
        """Return ``none``, ``linear`` or ``exponential``: the shape of the greatest weight."""
        if not self.basis.temperature:
            return "none"
        likeliest = max(self.bends, key=lambda b: b.weight)
        return "linear" if math.isinf(likeliest.decay_k) else "exponential"

    @property
    def slope_per_k(self) -> tuple[float, float]:
        """Return the slope at the reference and its deviation, shares of the level; else NaN."""
        if not self.basis.temperature:
            return math.nan, math.nan
        weight = np.array([b.weight for b in self.bends])
        slope = np.array([b.coefficients[0] for b in self.bends])
        variance = np.array([b.covariance[0, 0] for b in self.bends])
        mean = float(weight @ slope)
        share = self.size / self.level
        deviation = math.sqrt(float(weight @ (variance + (slope - mean) ** 2)))
        return mean * share, deviation * abs(share)

    def effect(self, conditions: Conditions) -> tuple[Floats, Floats]:
        """Return what the conditions add to the level, and its shared deviation, shapes (n,)."""
        effect = np.zeros(conditions.temperature_degc.shape)
        square, mean = np.zeros_like(effect), np.zeros_like(effect)
        for bend in self.bends:
            columns = self.basis.columns(conditions, bend.decay_k)
            away = columns - bend.middle
            moved = away @ bend.coefficients
            effect += bend.weight * (columns @ bend.coefficients)
            mean += bend.weight * moved
            own = np.einsum("ni,ij,nj->n", away, bend.covariance, away)
            square += bend.weight * (own + moved**2)
        variance = np.maximum(square - mean**2, 0.0) + self._unlearned(conditions)
        return self.size * effect, abs(self.size) * np.sqrt(variance)

    def compensate(self, conditions: Conditions, values: Floats, deviations: Floats) -> Compensated:
        """Bring values to the reference conditions.

        Parameters
        ----------
        conditions : Conditions
        values, deviations : ndarray, shape (n,)
            As measured, with the deviation of the measurement.
        """
        effect, shared = self.effect(conditions)
        return Compensated(
            values - effect,
            np.hypot(deviations, self.scatter),
            shared,
            self.extrapolates(conditions),
        )

    def extrapolates(self, conditions: Conditions) -> Mask:
        """Return where the conditions are outside of the healthy ones, shape (n,)."""
        basis = self.basis
        given = (conditions.temperature_degc, conditions.payload_kg)
        least = (_LEAST_EDGE_K, 0.02 * max(basis.highest[1], 1.0))
        out = np.zeros(conditions.temperature_degc.shape, dtype=np.bool_)
        for k, values in enumerate(given):
            edge = max(_EDGE * (basis.highest[k] - basis.lowest[k]), least[k])
            outside = (values < basis.lowest[k] - edge) | (values > basis.highest[k] + edge)
            out |= np.where(np.isfinite(values), outside, False)
        return out

    def _unlearned(self, conditions: Conditions) -> Floats:
        """Return the variance that a payload brings which the healthy cycles did not have."""
        payload = conditions.payload_kg
        if self.basis.payload_scale_kg or math.isnan(self.basis.reference[1]):
            return np.zeros(payload.shape)
        apart = np.abs(payload - self.basis.reference[1])
        most = np.maximum(np.maximum(payload, self.basis.highest[1]), 1e-9)
        share = np.where(np.isfinite(payload), apart / most, 0.0)
        return np.asarray((_PAYLOAD_SHARE * share) ** 2)


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
    basis = _basis(conditions)
    size = float(np.median(values))
    size = size if abs(size) > 0.0 else 1.0
    y, noise = values / size, deviations / abs(size)
    centre, width = basis.prior(prior)
    decays = _DECAYS_K if basis.temperature else _DECAYS_K[:1]
    columns = [basis.columns(conditions, decay_k) for decay_k in decays]
    best = 0
    for _ in range(2):  # a scatter about a shape that does not fit is too large: once more
        variance, scatter = _variance(columns[best], y, noise, centre, width)
        solved = [_solve(own, y, 1.0 / variance, centre, width) for own in columns]
        best = int(np.argmax([s.unseen for s in solved]))
    merit = np.array([s.unseen for s in solved])
    weight = np.exp(merit - merit.max())
    bends = tuple(
        Bend(decay_k, float(w), s.coefficients, s.covariance, s.middle)
        for decay_k, w, s in zip(decays, weight / weight.sum(), solved, strict=True)
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


def _basis(conditions: Conditions) -> Basis:
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
    low, high = 0.0, 10.0 * (float(np.var(y)) + usual)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        variance = noise**2 + middle
        solved = _solve(columns, y, 1.0 / variance, centre, width)
        squares = float(np.sum((y - solved.predicted) ** 2 / variance))
        squares += _SCATTER_CYCLES * usual / max(middle, 1e-18)
        freedom = y.size - solved.freedom + _SCATTER_CYCLES
        low, high = (middle, high) if squares > freedom else (low, middle)
    return np.asarray(noise**2 + 0.5 * (low + high))
