"""Start values from the frequency response: the motor's apparent inertia over frequency.

Friction, gravity and offset are taken out by the rigid body's regression; what is left, over the
acceleration, is the apparent inertia ``Jm + M(j w)``: the whole inertia at low frequency, a peak
at the antiresonance, a dip at the resonance, the motor's inertia alone above. It is averaged over
neighbouring frequencies and over stretches, weighted with the excitation, and a grid over the
chain's shape is searched exhaustively: no starting value is needed to find the start values.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agent.identify.flexible.chain import apparent_inertia, chain_of
from agent.identify.flexible.preparation import Complexes, Prepared
from agent.identify.result import Floats

_BANDS = 160
PLACES = 60
"""How many frequencies of a resonance are tried."""
_VALLEYS = 6
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


def start_shapes(omega: Floats, response: Complexes, weight: Floats) -> list[Floats]:
    """Return shapes of one mass that fit the frequency response, on a grid, the best first.

    The misfit's valleys over frequency, each with its best damping: what drives the joint at few
    frequencies only may carry several that are nearly as good, and the torque itself must choose.
    """
    grid = np.geomspace(omega[0], omega[-1], PLACES)
    found = []
    for w in grid:
        shapes = [np.log([w, z]) for z in _ZETAS]
        costs = [_misfit(apparent_inertia(chain_of(s), omega), response, weight) for s in shapes]
        best = int(np.argmin(costs))
        found.append((costs[best], shapes[best]))
    costs = [np.inf, *(cost for cost, _ in found), np.inf]
    valleys = [
        pair for i, pair in enumerate(found, 1) if costs[i] <= min(costs[i - 1], costs[i + 1])
    ]
    valleys.sort(key=lambda pair: pair[0])
    return [shape for _, shape in valleys[:_VALLEYS]]


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
