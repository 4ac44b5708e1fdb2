"""The minimum as it would be if the motion had been measured without noise.

Least squares give way to the noise that their columns carry; what it adds to the sum of squares, E,
is known (`agent.identify.flexible.attenuation`). Where numbers hang together, as those of a second
mode do that is hardly excited, the sum is a narrow valley that bends: one straight step that takes
the noise back leaves it, and frequencies err by many times what is known of them. So the sum less E
is made least itself, by Levenberg and Marquardt's steps of the searched parameters, the linear ones
solved for each time. That valley is flatter than the sum's: errors of least squares are larger by
``(J^T J - E''/2)^-1 J^T J``, and where noise tells as much as the motion there is no minimum.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.identify.flexible.attenuation import energy_of, moved_by_noise, noises_of, pull_of
from agent.identify.flexible.descent import Bounds
from agent.identify.flexible.projection import Point, Problem
from agent.identify.flexible.slopes import jacobian_of
from agent.identify.flexible.straight import bend_of, stepped
from agent.identify.result import Floats

_STEPS = 30
_FIRST, _MOST = 1e-6, 1e6  # damping
_FIRMER, _LOOSER = 10.0, 0.03
_LONGEST = 0.5  # of a logarithm, at once
_CONVERGED = 1e-7  # relative fall of the sum of squares
_STEP = 1e-3  # relative, or in logarithms: of E's second derivative


@dataclass(frozen=True)
class Unbiased:
    """A minimum freed of the motion's noise.

    Parameters
    ----------
    point : Point
        Its residuals are those of the minimum of the sum of squares.
    amplified : ndarray, shape (p, p)
        What errors of least squares are to be multiplied with, linear parameters first.
    """

    point: Point
    amplified: Floats


def without_motion_noise(problem: Problem, point: Point, bounds: Bounds) -> Unbiased | None:
    """Return the minimum freed of the motion's noise; None where the noise leaves none.

    Parameters
    ----------
    problem : Problem
        With a chain.
    point : Point
        The minimum of its sum of squares.
    bounds : Bounds
        Of the search.
    """
    size = point.linear.shape[0]
    if problem.cubes is not None or not (point.linear[:2] > 0.0).all():
        # Of a stiffening spring the columns are not all of the torque: one step, as it is straight.
        centre = _values(point) + moved_by_noise(problem, point)
        linear = problem.feasible(centre[:size])
        return Unbiased(replace(point, linear=linear, search=centre[size:]), np.eye(centre.size))
    free = np.concatenate((~problem.held(point.linear), _inside(point.search, bounds)))
    noises, damping = noises_of(problem), _FIRST
    at, left = point, point.cost - energy_of(problem, noises, _values(point), size)
    for _ in range(_STEPS):
        beside = _Beside.of(problem, at, free)
        lower, less = None, 0.0
        while lower is None and damping < _MOST:
            search = stepped(problem.kind, at.search, beside.step(damping, size))
            trial = _solved(problem, bounds.clip(search), free[:size])
            less = left - trial.cost + energy_of(problem, noises, _values(trial), size)
            lower = trial if less > 0.0 and (trial.linear[:2] > 0.0).all() else None
            damping *= _FIRMER if lower is None else _LOOSER
        if lower is not None:
            at, left = lower, left - less
        if less < _CONVERGED * point.cost:  # or no step leads further down
            amplified = _Beside.of(problem, at, free).amplified
            point = replace(at, residual=point.residual, cost=point.cost)
            return None if amplified is None else Unbiased(point, amplified)
    return None


@dataclass(frozen=True)
class _Beside:
    """The sum less E beside a point, by the straight coordinates of what is free there.

    Parameters
    ----------
    gram, bent : ndarray, shape (f, f)
        ``J^T J``, and what E leaves of it, both in units of the columns' sizes.
    slope : ndarray, shape (f,)
        Half of the fall along each.
    sizes : ndarray, shape (f,)
        Of the columns.
    free : ndarray of bool, shape (p,)
    bend : ndarray, shape (p, p)
        All parameters by the coordinates.
    """

    gram: Floats
    bent: Floats
    slope: Floats
    sizes: Floats
    free: NDArray[np.bool_]
    bend: Floats

    @classmethod
    def of(cls, problem: Problem, point: Point, free: NDArray[np.bool_]) -> _Beside:
        """Return it at a point, whose parameters that are not `free` stay."""
        size, centre = point.linear.shape[0], _values(point)
        bend = np.eye(centre.shape[0])
        bend[size:, size:] = bend_of(problem.kind, point.search)
        jacobian = jacobian_of(problem, point) @ bend
        sizes = np.linalg.norm(jacobian, axis=0)
        free = free & (sizes > 0.0)
        sizes, own = sizes[free], bend[:, free] / sizes[free]
        gram = (jacobian[:, free] / sizes).T @ (jacobian[:, free] / sizes)
        bent = gram - own.T @ _curvature(problem, centre, size) @ own
        pull = own.T @ pull_of(problem, centre, size)
        slope = (jacobian[:, free] / sizes).T @ point.residual + pull
        return cls(gram, bent, slope, sizes, free, bend)

    def step(self, damping: float, size: int) -> Floats:
        """Return the step of the searched parameters' coordinates; so many linear ones follow."""
        searched = np.flatnonzero(self.free) >= size
        bent = self.bent + np.diag(np.where(searched, damping, 0.0))
        out = np.zeros(self.free.shape[0])
        out[self.free] = np.linalg.lstsq(bent, self.slope, rcond=1e-13)[0] / self.sizes
        out[size:-1] = np.clip(out[size:-1], -_LONGEST, _LONGEST)
        return out[size:]

    @property
    def amplified(self) -> Floats | None:
        """Return by what errors of least squares are to be multiplied; None without a minimum."""
        if np.linalg.eigvalsh(self.bent)[0] <= 0.0:
            return None
        out, own = np.eye(self.free.shape[0]), np.ix_(self.free, self.free)
        out[own] = np.linalg.solve(self.bent, self.gram) / self.sizes[:, np.newaxis] * self.sizes
        return np.asarray(self.bend @ out @ np.linalg.inv(self.bend), dtype=np.float64)


def _values(point: Point) -> Floats:
    return np.concatenate((point.linear, point.search))


def _inside(search: Floats, bounds: Bounds) -> NDArray[np.bool_]:
    return np.asarray((search > bounds.lower) & (search < bounds.upper))


def _curvature(problem: Problem, centre: Floats, size: int) -> Floats:
    """Return ``E''/2``, shape (p, p)."""
    out = np.zeros((centre.shape[0], centre.shape[0]))
    for j in [0, 1, *range(size, size + problem.shape_size)]:
        step = np.zeros(centre.shape[0])
        step[j] = _STEP * (centre[j] if j < size else 1.0)
        ahead, behind = (pull_of(problem, centre + s, size) for s in (step, -step))
        out[j] = (ahead - behind) / (2.0 * step[j])
    return 0.5 * (out + out.T)


def _solved(problem: Problem, search: Floats, free: NDArray[np.bool_]) -> Point:
    """Return the point whose linear parameters make the sum less E least; others than free are 0.

    E is quadratic in the inertias.
    """
    columns, noises = problem.columns(search), noises_of(problem)
    size = columns.shape[1]
    pairs = np.zeros((3, size + search.shape[0]))
    pairs[:, :2], pairs[:, size:] = ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0)), search
    first, second, both = (energy_of(problem, noises, pair, size) for pair in pairs)
    gram = columns.T @ columns
    gram[:2, :2] -= [
        [first, 0.5 * (both - first - second)],
        [0.5 * (both - first - second), second],
    ]
    scale = np.sqrt(np.maximum(np.einsum("ij,ij->j", columns, columns), 1e-300))
    own = np.ix_(free, free)
    linear = np.zeros(size)
    linear[free] = np.linalg.lstsq(
        (gram / np.outer(scale, scale))[own],
        (columns.T @ problem.target / scale)[free],
        rcond=1e-13,
    )[0]
    linear = problem.feasible(linear / scale)
    left = problem.target - columns @ linear
    return Point(search, linear, left, columns, float(left @ left))
