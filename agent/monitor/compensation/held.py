"""What is held of temperature, payload and load before a joint's cycles are seen.

Which columns its cycles can be asked for, the shapes side by side with the broad priors of
`compensation`, and beside them those that grown joints of the same kind show (`kind`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.compensation.compensation import Basis, Conditions, Prior
from agent.monitor.compensation.kind import UNLIKE, Kind

DECAYS_K = (math.inf, 50.0, 32.0, 24.0, 19.0, 15.0, 12.0)
"""Decays of a film's viscosity that are tried, infinity being the straight line."""

_VARIES = 1e-3


@dataclass(frozen=True)
class Held:
    """One shape of the conditions' effect as it is held before the cycles were seen.

    Parameters
    ----------
    basis : Basis
    decay_k : float
    zero : ndarray, shape (p,)
        The basis's columns where this joint's are zero.
    middle : ndarray, shape (p,)
        Of the coefficients, in shares of `size` as `learn` takes it.
    covariance : ndarray, shape (p, p)
    log_share : float
        Logarithm of the probability beforehand.
    lent : bool
        Whether joints of the same kind show it.
    """

    basis: Basis
    decay_k: float
    zero: Floats
    middle: Floats
    covariance: Floats
    log_share: float
    lent: bool = False

    def columns(self, conditions: Conditions) -> Floats:
        """Return the columns, shape (n, p), zero at the joint's reference."""
        return self.basis.columns(conditions, self.decay_k) - self.zero


def held_of(
    conditions: Conditions,
    values: Floats,
    prior: Prior,
    kind: Kind | None,
    decays_k: Sequence[float] = DECAYS_K,
) -> tuple[Held, ...]:
    """Return what is held of the conditions' effect on n values: at large, and of joints alike."""
    basis = basis_of(conditions)
    middle, width = basis.prior(prior)
    decays = decays_k if basis.temperature else decays_k[:1]
    lent = kind is not None and kind.basis.temperature == basis.temperature
    share = math.log((UNLIKE if lent else 1.0) / len(decays))
    zero, spread = np.zeros(width.size), np.diag(width**2)
    out = [Held(basis, decay_k, zero, middle, spread, share) for decay_k in decays]
    if kind is None or not lent:
        return tuple(out)
    size, reference = size_of(values), basis.reference_conditions(np.zeros(1))
    for shape in kind.shapes:
        scale = kind.level_of(shape, conditions, values) / size
        out.append(
            Held(
                kind.basis,
                shape.decay_k,
                kind.basis.columns(reference, shape.decay_k)[0],
                scale * shape.middle,
                scale**2 * shape.covariance,
                math.log((1.0 - UNLIKE) * shape.share),
                lent=True,
            )
        )
    return tuple(out)


def size_of(values: Floats) -> float:
    """Return what coefficients are shares of."""
    size = float(np.median(values))
    return size if abs(size) > 0.0 else 1.0


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
