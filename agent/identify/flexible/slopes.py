"""The derivative of the torque that a flexible joint needs by the parameters that are searched.

Each of them moves a part of the torque alone: the shape what hangs on the motor, friction's own
parameters friction, the delay all that moves. Only that part is computed anew, its columns summed
first, and by central differences; the delay of the motion is differentiated exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.flexible.chain import apparent_inertia, chains_of
from agent.identify.flexible.preparation import Complexes, Prepared
from agent.identify.flexible.projection import (
    Point,
    Problem,
    cubic_column,
    free_motions,
)
from agent.identify.result import Floats

_STEP = 1e-5  # of a logarithm
_DELAY_STEP_S = 1e-5


def jacobian_of(problem: Problem, point: Point) -> Floats:
    """Return the torque's derivative by linear and then by searched parameters, shape (n, p)."""
    searched = slopes(problem, point) if point.slopes is None else point.slopes
    return np.concatenate((point.columns, -searched), axis=1)


def slopes(problem: Problem, point: Point, free: NDArray[np.bool_] | None = None) -> Floats:
    """Return the derivative of the residual by the searched parameters, linear part held.

    Those that are not `free` are left at zero.
    """
    free = np.ones(problem.search_size, dtype=np.bool_) if free is None else free
    rows = []
    for part in _parts(problem, point):
        columns = [part.moved(j) for j in np.flatnonzero(free).tolist()]
        rows.append(np.stack(columns, axis=-1))
    out = np.zeros((point.residual.shape[0], problem.search_size))
    out[:, free] = -problem.counted(np.concatenate(rows))
    return out


@dataclass(frozen=True)
class _Part:
    """One stretch's torque at a point.

    `motor` and `masses`, shape (m,), are inertias; `cube` the third power of the twist times the
    cubic spring, shape (n,), or none; `friction`, shape (f,), the law's linear parameters;
    `gravity`, shape (2,) or (0,), and `loose`, shape (2 m,), gravity's and the free motions'.
    """

    problem: Problem
    search: Floats
    index: int
    motor: float
    masses: Floats
    cube: Floats | None
    friction: Floats
    gravity: Floats
    loose: Floats

    def moved(self, j: int) -> Floats:
        """Return the torque's derivative by one searched parameter, shape (n,)."""
        if j == self.search.shape[0] - 1:
            return self._delayed()
        ahead, behind = self.search.copy(), self.search.copy()
        ahead[j] += _STEP
        behind[j] -= _STEP
        if j < self.problem.shape_size:
            change = self._carried(ahead) - self._carried(behind)
            return np.asarray(change / (2.0 * _STEP), dtype=np.float64)
        change = self._rubbed(ahead) - self._rubbed(behind)
        return np.asarray(self._thinned(change, self.delay_s) / (2.0 * _STEP), dtype=np.float64)

    def _carried(self, search: Floats) -> Floats:
        """Return the torque of what hangs on the motor."""
        p, shape = self.stretch, search[: self.problem.shape_size]
        assert self.problem.kind is not None
        out = p.through(self._apparent(shape), self.delay_s)
        out += free_motions(p, chains_of(self.problem.kind, shape)) @ self.loose
        if self.cube is not None:
            out += cubic_column(p, self.cube, shape)
        return out

    def _apparent(self, shape: Floats) -> Complexes:
        """Return the apparent inertia of what hangs on the motor; zero where nothing does."""
        omega = self.stretch.omega_rad_s
        chains = [] if self.problem.kind is None else chains_of(self.problem.kind, shape)
        out = np.zeros(omega.shape, dtype=np.complex128)
        for mass, chain in zip(self.masses, chains, strict=True):
            out += mass * apparent_inertia(chain, omega)
        return out

    def _rubbed(self, search: Floats) -> Floats:
        """Return friction's torque, not thinned, shape (full n,)."""
        nonlinear = np.exp(search[self.problem.shape_size : -1])
        return np.asarray(self.friction @ self.problem.friction(self.index, nonlinear))

    def _thinned(self, values: Floats, delay_s: float) -> Floats:
        """Return filtered values, shape (full n,), as they were a delay earlier, shape (n,)."""
        return np.asarray(self.stretch.thinned(values[np.newaxis], delay_s)[0])

    def _delayed(self) -> Floats:
        """Return the derivative by the torque's delay."""
        p, step = self.stretch, _DELAY_STEP_S
        inertia = self.motor + self._apparent(self.search[: self.problem.shape_size])
        static = self._rubbed(self.search)
        if self.gravity.size:
            static = static + self.gravity @ p.angles
        later, sooner = (self._thinned(static, self.delay_s + s) for s in (step, -step))
        moved = p.through(-1j * p.omega_rad_s * inertia, self.delay_s)
        return np.asarray(moved + (later - sooner) / (2.0 * step), dtype=np.float64)

    @property
    def stretch(self) -> Prepared:
        """Return what was measured."""
        return self.problem.stretches[self.index]

    @property
    def delay_s(self) -> float:
        """Return how late the torque is."""
        return float(self.search[-1])


def _parts(problem: Problem, point: Point) -> list[_Part]:
    """Return every stretch's torque at a point."""
    stiffens, has_gravity = problem.cubes is not None, problem.has_gravity
    sizes = (1, problem.arms, stiffens, len(problem.law.linear), 2 * has_gravity, 1)
    motor, masses, cubic, friction, gravity, _, loose = np.split(point.linear, np.cumsum(sizes))
    own = loose.reshape(len(problem.stretches), -1)
    return [
        _Part(
            problem,
            point.search,
            i,
            float(motor[0]),
            masses,
            None if problem.cubes is None else float(cubic[0]) * problem.cubes[i],
            friction,
            gravity,
            own[i],
        )
        for i in range(len(problem.stretches))
    ]
