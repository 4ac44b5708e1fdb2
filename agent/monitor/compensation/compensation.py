"""What temperature, payload and load do to a feature, learned from the healthy cycles alone.

A feature (or the friction at one speed) is taken as

    y = level x (1 + b . phi(c)) + noise,

with the columns phi(c) of a cycle's conditions c:

- temperature: with x = T - Tr either x itself (thesis App. A: the integral falls about linearly)
  or what a film's viscosity loses, Tv (1 - exp(-x / Tv + 0.1 (x / Tv)^2)), and x^2 / 2 for what
  either lacks. The straight line and several Tv are weighed by how well each predicts healthy
  cycles that it has not seen; what the healthy cycles do not tell apart stays side by side, and
  widens the prediction where it differs;
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
from agent.physics.friction_oil import thinned_share

Mask = NDArray[np.bool_]
Index = NDArray[np.bool_] | NDArray[np.signedinteger[Any]]

_PAYLOAD_SHARE = 0.15  # what the whole payload may do to friction (one standard deviation)
_EDGE = 0.15  # of the healthy span: so far beyond is no extrapolation
_LEAST_EDGE_K = 1.0
_SLOPE_STEP_K = 1e-3


@dataclass(frozen=True)
class Prior:
    """What is held likely of temperature before a cycle was seen; shares of the level.

    Middle and standard deviation of the slope at the reference temperature; standard deviation,
    about zero, of the second derivative that neither line nor viscosity has.
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
            bent = x if math.isinf(decay_k) else decay_k * thinned_share(x / decay_k)
            out += [bent, 0.5 * x**2]
        if self.payload_scale_kg:
            out.append(_apart(conditions.payload_kg, self.reference[1]) / self.payload_scale_kg)
        if self.load_scale_nm:
            out.append(_apart(conditions.load_nm, self.reference[2]) / self.load_scale_nm)
        count = conditions.temperature_degc.size
        return np.stack(out, axis=-1) if out else np.zeros((count, 0))

    def reference_conditions(self, degrees: Floats) -> Conditions:
        """Return the reference's conditions, so many degrees beside it, shape (n,)."""
        _, payload, load = (np.full(degrees.shape, one) for one in self.reference)
        return Conditions(self.reference[0] + degrees, payload, load)

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
    """One shape of the conditions' effect: weight, coefficients (p,), covariance (p, p).

    `middle`, shape (p,), is the columns' mean over the healthy cycles: there the law is least
    uncertain. `zero`, shape (p,), are the basis's columns at the law's reference, where the effect
    is none: another basis than the law's own is that of the joint's siblings.
    """

    decay_k: float
    weight: float
    coefficients: Floats
    covariance: Floats
    middle: Floats
    basis: Basis
    zero: Floats

    def columns(self, conditions: Conditions) -> Floats:
        """Return the columns, shape (n, p), zero at the law's reference."""
        return self.basis.columns(conditions, self.decay_k) - self.zero


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
    def lent(self) -> float:
        """Return how far the law is what joints of the same kind show, 0 to 1 (a probability)."""
        return sum(b.weight for b in self.bends if b.basis is not self.basis)

    @property
    def name(self) -> str:
        """Return ``none``, ``linear`` or ``viscosity``: the shape of the greatest weight."""
        if not self.basis.temperature:
            return "none"
        likeliest = max(self.bends, key=lambda b: b.weight)
        return "linear" if math.isinf(likeliest.decay_k) else "viscosity"

    @property
    def slope_per_k(self) -> tuple[float, float]:
        """Return the slope at the reference and its deviation, shares of the level; else NaN."""
        if not self.basis.temperature:
            return math.nan, math.nan
        weight = np.array([b.weight for b in self.bends])
        steep = [self._steepness(b) for b in self.bends]
        slope = np.array([s @ b.coefficients for s, b in zip(steep, self.bends, strict=True)])
        variance = np.array([s @ b.covariance @ s for s, b in zip(steep, self.bends, strict=True)])
        mean = float(weight @ slope)
        share = self.size / self.level
        deviation = math.sqrt(float(weight @ (variance + (slope - mean) ** 2)))
        return mean * share, deviation * abs(share)

    def effect(self, conditions: Conditions) -> tuple[Floats, Floats]:
        """Return what the conditions add to the level, and its shared deviation, shapes (n,)."""
        effect = np.zeros(conditions.temperature_degc.shape)
        square, mean = np.zeros_like(effect), np.zeros_like(effect)
        for bend in self.bends:
            columns = bend.columns(conditions)
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

        The scatter from cycle to cycle is a share of the friction that there is: where a cold
        joint has more of it, its cycles scatter by more.

        Parameters
        ----------
        conditions : Conditions
        values, deviations : ndarray, shape (n,)
            As measured, with the deviation of the measurement.
        """
        effect, shared = self.effect(conditions)
        more = np.maximum(1.0, 1.0 + effect / self.level) if self.level > 0.0 else 1.0
        return Compensated(
            values - effect,
            np.hypot(deviations, self.scatter * more),
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

    def _steepness(self, bend: Bend) -> Floats:
        """Return the columns' slopes at the reference, shape (p,), a degree."""
        near = self.basis.reference_conditions(np.array([-_SLOPE_STEP_K, _SLOPE_STEP_K]))
        return np.asarray(np.diff(bend.columns(near), axis=0)[0] / (2.0 * _SLOPE_STEP_K))

    def _unlearned(self, conditions: Conditions) -> Floats:
        """Return the variance that a payload brings which nothing has been learned of."""
        payload = conditions.payload_kg
        blind = sum(b.weight for b in self.bends if not b.basis.payload_scale_kg)
        if not blind or math.isnan(self.basis.reference[1]):
            return np.zeros(payload.shape)
        apart = np.abs(payload - self.basis.reference[1])
        most = np.maximum(np.maximum(payload, self.basis.highest[1]), 1e-9)
        share = np.where(np.isfinite(payload), apart / most, 0.0)
        return np.asarray(blind * (_PAYLOAD_SHARE * share) ** 2)
