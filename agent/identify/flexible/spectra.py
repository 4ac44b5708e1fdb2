"""Start values from the frequency response: the motor's apparent inertia over frequency.

Friction, gravity and offset are taken out by the rigid body's regression; what is left, over the
acceleration, is the apparent inertia ``Jm + M(j w)``: the whole inertia at low frequency, a peak
at the antiresonance, a dip at the resonance, the motor's inertia alone above. It is averaged over
neighbouring frequencies and over stretches, weighted with the excitation, and a grid over the
chain's shape is searched exhaustively: no starting value is needed to find the start values.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from agent.identify.flexible.chain import Chain, apparent_inertia, chain_of, shape_of
from agent.identify.flexible.preparation import Complexes, Prepared
from agent.identify.result import Floats

_BANDS = 160
_GRID = 60
_GRID_TWO = 24
_APART = 8.0  # how far a second mode may lie from the first
_ZETAS = (0.005, 0.015, 0.04, 0.1, 0.25)
_LOWEST_PERIODS = 6.0  # of a frequency, in the longest stretch


def frequency_range_hz(stretches: Sequence[Prepared]) -> tuple[float, float]:
    """Return between which frequencies these data can show an antiresonance."""
    longest_s = max(p.torque_nm.shape[0] * p.period_s for p in stretches)
    highest = max(p.cutoff_hz for p in stretches)
    return min(_LOWEST_PERIODS / longest_s, highest / 4.0), highest


def frequency_response(
    stretches: Sequence[Prepared], rest_nm: Sequence[Floats]
) -> tuple[Floats, Complexes, Floats]:
    """Return the averaged apparent inertia of the motor.

    Parameters
    ----------
    stretches : sequence of Prepared
    rest_nm : sequence of ndarray, shape (n,)
        Their torque without friction, gravity and offset.

    Returns
    -------
    omega_rad_s : ndarray, shape (b,)
    inertia_kg_m2 : ndarray of complex, shape (b,)
        ``sum conj(A) T / sum |A|^2`` in bands that are narrow against any resonance.
    weight : ndarray, shape (b,)
        The excitation ``sum |A|^2``.
    """
    low, high = frequency_range_hz(stretches)
    edges = 2.0 * np.pi * np.geomspace(low, high, _BANDS + 1)
    cross = np.zeros(_BANDS, dtype=np.complex128)
    power, moment = np.zeros(_BANDS), np.zeros(_BANDS)
    for p, rest in zip(stretches, rest_nm, strict=True):
        index = np.searchsorted(edges, p.omega_rad_s, side="right") - 1
        inside = (index >= 0) & (index < _BANDS)
        a, t, w = p.spectrum[inside], np.fft.rfft(rest)[inside], p.omega_rad_s[inside]
        excitation = np.abs(a) ** 2
        np.add.at(cross, index[inside], np.conj(a) * t)
        np.add.at(power, index[inside], excitation)
        np.add.at(moment, index[inside], excitation * w)
    there = power > 0.0
    return moment[there] / power[there], cross[there] / power[there], power[there]


def start_shape(omega: Floats, response: Complexes, weight: Floats) -> Floats:
    """Return the shape of one mass that fits the frequency response best, on a grid."""
    candidates = [
        np.log([w, z]) for w, z in product(np.geomspace(omega[0], omega[-1], _GRID), _ZETAS)
    ]
    best, least = candidates[0], np.inf
    for shape in candidates:
        cost = _misfit(apparent_inertia(chain_of(shape), omega), response, weight)
        if cost < least:
            best, least = shape, cost
    return best


def second_modes(shape: Floats, low_hz: float, high_hz: float) -> list[Floats]:
    """Return shapes of two masses that swing as one mass does, and in a second way.

    Parameters
    ----------
    shape : ndarray, shape (2,)
        Of the one mass.
    low_hz, high_hz : float
        Where the second way may lie.
    """
    known = float(np.exp(shape[0]))
    out = []
    low = max(2.0 * np.pi * low_hz, known / _APART)
    high = max(min(2.0 * np.pi * high_hz, known * _APART), 1.2 * low)
    for omega in np.geomspace(low, high, _GRID_TWO):
        if abs(np.log(omega / known)) < 0.1:
            continue
        for share, zeta in product((0.05, 0.3, 0.7, 0.9, 0.97, 0.99), (0.02, 0.07)):
            first, second = sorted((known, float(omega)))
            out.append(_from_modes(first, second, share, zeta))
    return out


def _from_modes(first: float, second: float, share: float, zeta: float) -> Floats:
    """Return the shape whose modes against a held motor are the given ones.

    `share` of the inertia swings in the first mode. The moments ``mu_n = sum M_i w_i^(2n)`` of the
    effective masses give the chain link by link: ``k1 = mu_1``, ``J1 = mu_1^2/mu_2``, ``k2 = mu_3
    J1^2/mu_1^2 - k1``; by Cauchy's inequality nothing comes out negative.
    """
    masses = np.array([share, 1.0 - share])
    squares = np.array([first, second]) ** 2
    mu1, mu2, mu3 = (float(masses @ squares**n) for n in (1, 2, 3))
    nearest = mu1 * mu1 / mu2
    spring = mu3 * nearest**2 / mu1**2 - mu1
    inertias, springs = (nearest, 1.0 - nearest), (mu1, spring)
    dampers = tuple(2.0 * zeta * (j * k) ** 0.5 for j, k in zip(inertias, springs, strict=True))
    return shape_of(Chain(inertias, springs, dampers))


def _misfit(chain: Complexes, response: Complexes, weight: Floats) -> float:
    """Return the weighted squared misfit of ``Jm + J chain``, the best Jm, J >= 0 taken."""
    root = np.sqrt(weight)
    columns = np.stack((np.concatenate((root, 0.0 * root)), _real(chain * root)), axis=-1)
    target = _real(response * root)
    gram, moment = columns.T @ columns, columns.T @ target
    total = float(target @ target)
    determinant = gram[0, 0] * gram[1, 1] - gram[0, 1] ** 2
    if determinant > 1e-12 * gram[0, 0] * gram[1, 1]:
        solution = np.linalg.solve(gram, moment)
        if (solution >= 0.0).all():
            return total - float(solution @ moment)
    return total - max(
        float(max(moment[i], 0.0) ** 2 / gram[i, i]) if gram[i, i] > 0.0 else 0.0 for i in (0, 1)
    )


def _real(values: Complexes) -> Floats:
    return np.concatenate((values.real, values.imag))
