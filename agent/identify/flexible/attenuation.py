"""What measuring noise does: it scatters the parameters, and in the motion it pulls them.

Noise in the measured motion pulls inertias low; by how much is known, and is undone.

The regressors are the measured acceleration and what the chain makes of it. Noise of variance s^2
in the measured channel adds, on the average, ``E(p) = n int |(Jm + M(w)) w^m H(w)|^2 s^2`` to the
sum of squares of n residuals (m = 2 for a position, 1 for a velocity, H the filter), and least
squares makes that small as well. At the minimum the wanted gradient is therefore ``grad E / 2``
(bias-compensated least squares: Sagara & Wada 1977): one Newton step takes it back to first order,
and `agent.identify.flexible.unbiased` whole.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from agent.identify.flexible.chain import Complexes, apparent_inertia, chain_of
from agent.identify.flexible.noise import motion_noise, motion_order, torque_noise_nm
from agent.identify.flexible.preparation import Prepared
from agent.identify.flexible.projection import Point, Problem
from agent.identify.flexible.slopes import jacobian_of
from agent.identify.result import Floats
from agent.identify.signals.lowpass import ORDER

Response = Callable[[Floats, Complexes], Complexes]

_LINES = 1024  # frequencies between zero and half the sampling rate
_STEP = 1e-4  # relative, or in logarithms


def moved_by_noise(problem: Problem, point: Point) -> Floats:
    """Return by how much the motion's noise is to be taken back from a minimum, shape (p,).

    To first order; linear parameters, then the searched ones; nothing where an inertia is on its
    bound.
    """
    size = point.columns.shape[1]
    centre = np.concatenate((point.linear, point.search))
    out = np.zeros(centre.shape[0])
    if not (point.linear[:2] > 0.0).all():
        return out
    pull = pull_of(problem, centre, size)
    jacobian = jacobian_of(problem, point)
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0.0] = 1.0
    # What is held at zero stays there.
    free = np.ones(centre.shape[0], dtype=np.bool_)
    free[:size] = ~problem.held(point.linear)
    gram = (jacobian / scale)[:, free].T @ (jacobian / scale)[:, free]
    out[free] = np.linalg.lstsq(gram, (pull / scale)[free], rcond=1e-13)[0] / scale[free]
    return out


def pull_of(problem: Problem, centre: Floats, size: int) -> Floats:
    """Return ``grad E/2``: how the motion's noise pulls at every parameter, shape (p,).

    Parameters
    ----------
    problem : Problem
        With a chain.
    centre : ndarray, shape (p,)
        Linear parameters, so many, then the searched ones.
    size : int
    """
    out, noises = np.zeros(centre.shape[0]), noises_of(problem)
    for j in [0, 1, *range(size, size + problem.shape_size)]:
        step = _STEP * (centre[j] if j < size else 1.0)
        ahead, behind = centre.copy(), centre.copy()
        ahead[j] += step
        behind[j] -= step
        change = energy_of(problem, noises, ahead, size) - energy_of(problem, noises, behind, size)
        out[j] = change / (4.0 * step)
    return out


def noises_of(problem: Problem) -> list[float]:
    """Return every stretch's `motion_noise`."""
    return [motion_noise(p.track) for p in problem.stretches]


def noise_in_common(problem: Problem, point: Point, response: Response) -> Floats:
    """Return what columns and residual have in common by the motion's noise, shape (c,), (N m)^2.

    A column that is made of the measured motion carries its noise, as the residual does, with the
    other sign: ``-n int Re(conj(G) (Jm + M)) |w^m H|^2 s^2``.

    Parameters
    ----------
    problem : Problem
        With a chain.
    point : Point
    response : callable
        From angular frequencies, shape (w,), and the model's apparent inertia there to the columns'
        own, G, shape (c, w), kg m^2.
    """
    chain, out = chain_of(point.search[: problem.shape_size]), 0.0
    for p in problem.stretches:
        omega = (np.arange(_LINES, dtype=np.float64) + 0.5) * (np.pi / _LINES / p.track.period_s)
        inertia = point.linear[0] + point.linear[1] * apparent_inertia(chain, omega)
        power = (omega ** motion_order(p.track) * filter_of(p, omega) * motion_noise(p.track)) ** 2
        shared = np.real(np.conj(response(omega, inertia)) * inertia) @ power / _LINES
        out = out - int(p.usable.sum()) * shared
    return np.asarray(out, dtype=np.float64)


def energy_of(problem: Problem, noises: list[float], values: Floats, size: int) -> float:
    """Return what noise of the motion adds to the sum of squares, (N m)^2."""
    chain = chain_of(values[size : size + problem.shape_size])
    total = 0.0
    for p, noise in zip(problem.stretches, noises, strict=True):
        omega = (np.arange(_LINES, dtype=np.float64) + 0.5) * (np.pi / _LINES / p.track.period_s)
        inertia = values[0] + values[1] * apparent_inertia(chain, omega)
        power = np.abs(inertia * omega ** motion_order(p.track) * filter_of(p, omega)) ** 2
        total += int(p.usable.sum()) * noise**2 * float(power.mean())
    return total


def rigid_noise(problem: Problem, inertia_kg_m2: float) -> float:
    """Return what the measuring noise alone leaves of a rigid joint's torque, squared, (N m)^2.

    Summed over the rows that count, as a point's cost is.
    """
    total = 0.0
    for p in problem.stretches:
        omega = (np.arange(_LINES, dtype=np.float64) + 0.5) * (np.pi / _LINES / p.track.period_s)
        motion = inertia_kg_m2 * omega ** motion_order(p.track) * motion_noise(p.track)
        power = (torque_noise_nm(p.track) ** 2 + motion**2) * filter_of(p, omega) ** 2
        total += int(p.usable.sum()) * float(power.mean())
    return total


def covariance_of(problem: Problem, point: Point, rows: Floats) -> Floats:
    """Return the covariance that the measuring noise gives to linear functions of the torque.

    ``sum_w S(w) conj(I(w)) I(w)^T`` with the functions' transforms I and the noise's spectrum in
    the torque balance, ``S = |H|^2 (s_torque^2 + |(Jm + M) w^m|^2 s_motion^2)``.

    Parameters
    ----------
    problem : Problem
        With a chain.
    point : Point
        Its minimum.
    rows : ndarray, shape (p, n)
        What every row that counts does to each function.

    Returns
    -------
    ndarray, shape (p, p)
    """
    out, begin = np.zeros((rows.shape[0], rows.shape[0])), 0
    for p in problem.stretches:
        count, end = p.usable.shape[0], begin + int(p.usable.sum())
        spread = np.zeros((rows.shape[0], count))
        spread[:, p.usable] = rows[:, begin:end]
        lines = np.fft.rfft(spread, n=2 * count, axis=1)
        power = _noise_power(problem, point, p)
        power[1:-1] *= 2.0  # the negative frequencies, too
        out += ((lines * power) @ lines.conj().T).real / (2.0 * count)
        begin = end
    return out


def _noise_power(problem: Problem, point: Point, p: Prepared) -> Floats:
    """Return the spectrum of the measuring noise in one stretch's torque balance, shape (n + 1,).

    At the frequencies of twice the n thinned samples, (N m)^2.
    """
    omega = 2.0 * np.pi * np.fft.rfftfreq(2 * p.usable.shape[0], p.period_s).astype(np.float64)
    chain = chain_of(point.search[: problem.shape_size])
    inertia = point.linear[0] + point.linear[1] * apparent_inertia(chain, omega)
    motion = np.abs(inertia * omega ** motion_order(p.track)) * motion_noise(p.track)
    power = (torque_noise_nm(p.track) ** 2 + motion**2) * filter_of(p, omega) ** 2
    return np.asarray(power / p.stride, dtype=np.float64)


def filter_of(p: Prepared, omega_rad_s: Floats) -> Floats:
    """Return the response of `agent.identify.signals.lowpass.lowpass`."""
    half = 0.5 * p.track.period_s
    ratio = np.tan(omega_rad_s * half) / np.tan(2.0 * np.pi * p.cutoff_hz * half)
    return np.asarray(1.0 / (1.0 + ratio ** (2 * ORDER)), dtype=np.float64)
