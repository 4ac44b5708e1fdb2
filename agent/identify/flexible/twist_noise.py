"""What the torque's noise does to a stiffening spring: it is in the cube of the twist, too.

The twist is read from the measured torque, so that the cubic spring's column carries noise that the
torque to be explained carries as well. On the average this draws the cubic spring up by a third of
its standard error, and the damper and the antiresonance with it. The estimate is asked what it
would become of its own torque under noise that is drawn, once as drawn and once with the other
sign: what the two do alike is that bias, and is taken away (bootstrap with antithetic draws; Efron
& Tibshirani 1993, chapter 10).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.identify.flexible.preparation import torque_noise_nm
from agent.identify.flexible.projection import Point, Problem, slopes
from agent.identify.flexible.twist import cubes_of
from agent.identify.result import Floats

_PAIRS = 4  # two draws differ by a tenth of the bias


def without_twist_noise(problem: Problem, point: Point, seen: Problem, seed: int = 0) -> Point:
    """Return the minimum as it would be if the twist had been read without noise.

    Parameters
    ----------
    problem : Problem
        With a cubic spring; any other's minimum stays.
    point : Point
        Its minimum, inside of all bounds; elsewhere it stays.
    seen : Problem
        The problem from whose residual the twist was read: of fewer rows, where reversals came in
        afterwards.
    seed : int
        Of the draws.
    """
    if problem.cubes is None or not (point.linear[:3] > 0.0).all():
        return point
    rng = np.random.default_rng(seed)
    quiet = replace(problem, cubes=cubes_of(seen, _left(point, np.zeros(int(seen.keep.sum())))))
    torque = quiet.columns(point.search) @ point.linear
    shift = np.zeros(point.linear.shape[0] + problem.search_size)
    for _ in range(_PAIRS):
        noise = _drawn(problem, rng)
        for sign in (1.0, -1.0):
            cubes = cubes_of(seen, _left(point, sign * noise[seen.keep]))
            noisy = replace(problem, cubes=cubes)
            target = torque + sign * problem.counted(noise)
            shift += _step(noisy, point, target) / (2.0 * _PAIRS)
    size = point.linear.shape[0]
    linear = problem.feasible(point.linear - shift[:size])
    return replace(point, linear=linear, search=point.search - shift[size:])


def _left(point: Point, residual: Floats) -> Point:
    return replace(point, residual=residual)


def _drawn(problem: Problem, rng: np.random.Generator) -> Floats:
    """Return torque noise as large as every track's, filtered and thinned, shape (full n,)."""
    rows = []
    for p in problem.stretches:
        white = torque_noise_nm(p.track) * rng.standard_normal((1, p.direction.shape[0]))
        rows.append(p.thinned(p.filtered(white))[0])
    return np.concatenate(rows)


def _step(problem: Problem, point: Point, target: Floats) -> Floats:
    """Return one Gauss-Newton step of linear and searched parameters towards a target."""
    columns = problem.columns(point.search)
    at = replace(point, columns=columns, residual=target - columns @ point.linear)
    jacobian = np.concatenate((columns, -slopes(problem, at)), axis=1)
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0.0] = 1.0
    gram = (jacobian / scale).T @ (jacobian / scale)
    moment = (jacobian / scale).T @ at.residual
    return np.asarray(np.linalg.lstsq(gram, moment, rcond=1e-13)[0] / scale, dtype=np.float64)
