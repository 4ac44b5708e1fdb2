"""The grey box as a separable least-squares problem, and its descent from one start.

Given the chain's shape (and the Stribeck velocity and exponent) the torque is linear in all else:
``torque(t + delay) = Jm a + J M(shape) a + friction + gravity + offset + free motion``. The linear
part is solved for at every step (variable projection, Golub & Pereyra 1973, with Kaufman's
Jacobian), with the inertias and friction held at zero or above; only the shape and the delay of
the torque against the motion are searched, by Levenberg and Marquardt's method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from agent.identify.flexible.chain import (
    SHAPE_SIZE,
    Kind,
    apparent_inertia,
    chain_of,
    free_motion,
)
from agent.identify.flexible.preparation import Prepared
from agent.identify.result import Floats
from agent.physics.friction import FrictionLaw

_STEP = 1e-5  # of central differences, in logarithms
_ITERATIONS = 60
_CONVERGED = 1e-9  # relative fall of the cost
_LONGEST_DELAY = 0.005  # s


@dataclass(frozen=True)
class Problem:
    """Stretches, and the model that shall explain their torque.

    Parameters
    ----------
    stretches : tuple of Prepared
    kind : {"two-mass", "three-mass"} or None
        None is the rigid body.
    law : FrictionLaw
        Of the motor's friction.
    has_gravity : bool
        Whether gravity is part of the model.
    """

    stretches: tuple[Prepared, ...]
    kind: Kind | None
    law: FrictionLaw
    has_gravity: bool

    @property
    def shape_size(self) -> int:
        """Return the number of the chain's shape parameters."""
        return 0 if self.kind is None else SHAPE_SIZE[self.kind]

    @property
    def search_size(self) -> int:
        """Return the number of searched parameters: shape, friction's non-linear ones, delay."""
        return self.shape_size + len(self.law.nonlinear) + 1

    @property
    def linear_names(self) -> tuple[str, ...]:
        """Return the names of the linear parameters, free motions apart."""
        inertias = ("inertia_kg_m2",) if self.kind is None else _FLEXIBLE
        gravity = ("gravity_sin_nm", "gravity_cos_nm") if self.has_gravity else ()
        return (*inertias, *self.law.linear, *gravity, "torque_offset_nm")

    @cached_property
    def positive(self) -> NDArray[np.bool_]:
        """Return which linear parameters cannot be negative."""
        count = len(self.linear_names) - 1 - 2 * self.has_gravity
        return np.arange(len(self.linear_names)) < count

    @cached_property
    def keep(self) -> NDArray[np.bool_]:
        """Return which rows count, over all stretches."""
        return np.concatenate([p.usable for p in self.stretches])

    @cached_property
    def target(self) -> Floats:
        """Return the torque to explain, without delay, shape (n,)."""
        return np.concatenate([p.torque_nm for p in self.stretches])[self.keep]

    @cached_property
    def target_rates(self) -> Floats:
        """Return its first three derivatives in time, shape (3, n)."""
        return np.concatenate([p.torque_rates for p in self.stretches], axis=1)[:, self.keep]

    def advanced(self, delay_s: float) -> Floats:
        """Return the torque of `delay_s` later, by Taylor's series, shape (n,)."""
        first, second, third = self.target_rates
        d = delay_s
        later = self.target + d * (first + d * (0.5 * second + d * third / 6.0))
        return np.asarray(later, dtype=np.float64)

    def advanced_rate(self, delay_s: float) -> Floats:
        """Return the derivative of `advanced` by the delay, shape (n,)."""
        first, second, third = self.target_rates
        return np.asarray(first + delay_s * (second + 0.5 * delay_s * third), dtype=np.float64)

    @cached_property
    def _fixed_friction(self) -> tuple[Floats, ...] | None:
        return None if self.law.nonlinear else tuple(self._friction(p, ()) for p in self.stretches)

    def _friction(self, p: Prepared, nonlinear: Sequence[float]) -> Floats:
        """Return the friction law's columns of one stretch, filtered, shape (n, c)."""
        share = np.abs(p.direction)[:, np.newaxis]
        speed = np.copysign(np.maximum(np.abs(p.track.velocity_rad_s), 1e-12), p.direction)
        return p.filtered((share * self.law.columns(speed, *nonlinear)).T).T

    def columns(self, search: Floats) -> Floats:
        """Return the columns at the rows that count."""
        return self.all_columns(search)[self.keep]

    def all_columns(self, search: Floats) -> Floats:
        """Return the linear problem's columns: named ones, then the chain's free motions."""
        shape = search[: self.shape_size]
        chain = None if self.kind is None else chain_of(shape)
        nonlinear = np.exp(search[self.shape_size : -1])
        named, free = [], []
        for i, p in enumerate(self.stretches):
            friction = (
                self._friction(p, tuple(nonlinear))
                if self._fixed_friction is None
                else self._fixed_friction[i]
            )
            parts = [p.linear[:, :1]]
            if chain is not None:
                parts.append(p.through(apparent_inertia(chain, p.omega_rad_s))[:, np.newaxis])
                free.append(free_motion(chain, p.time_s))
            parts += [friction, p.linear[:, 1:] if self.has_gravity else p.linear[:, 3:]]
            named.append(np.concatenate(parts, axis=1))
        out = np.concatenate(named)
        if free:
            out = np.concatenate((out, _diagonal(free)), axis=1)
        return out


_FLEXIBLE = ("motor_inertia_kg_m2", "arm_inertia_kg_m2")


def _diagonal(blocks: Sequence[Floats]) -> Floats:
    """Return the blocks along the diagonal of a matrix of zeros."""
    out = np.zeros((sum(b.shape[0] for b in blocks), sum(b.shape[1] for b in blocks)))
    row = column = 0
    for b in blocks:
        out[row : row + b.shape[0], column : column + b.shape[1]] = b
        row, column = row + b.shape[0], column + b.shape[1]
    return out


@dataclass(frozen=True)
class Point:
    """The problem at one vector of searched parameters.

    `linear` holds the named parameters and then the free motions; `cost` is the sum of squares.
    """

    search: Floats
    linear: Floats
    residual: Floats
    columns: Floats
    cost: float


def evaluate(problem: Problem, search: Floats) -> Point:
    """Solve the linear part at given searched parameters."""
    columns = problem.columns(search)
    target = problem.advanced(float(search[-1]))
    linear = solve_positive(columns, target, problem.positive)
    residual = target - columns @ linear
    return Point(search, linear, residual, columns, float(residual @ residual))


def solve_positive(columns: Floats, target: Floats, positive: NDArray[np.bool_]) -> Floats:
    """Return least squares whose first parameters, where `positive`, are zero or more."""
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    scale[scale == 0.0] = 1.0
    gram = (columns.T @ columns) / np.outer(scale, scale)
    moment = (columns.T @ target) / scale
    active = np.ones(columns.shape[1], dtype=np.bool_)
    bounded = np.zeros_like(active)
    bounded[: positive.shape[0]] = positive
    while True:
        solution = np.zeros_like(moment)
        index = np.flatnonzero(active)
        solution[index] = np.linalg.lstsq(gram[np.ix_(index, index)], moment[index], rcond=1e-13)[0]
        wrong = bounded & (solution < 0.0)
        if not wrong.any():
            return np.asarray(solution / scale, dtype=np.float64)
        active[int(np.argmin(np.where(wrong, solution, 0.0)))] = False


def slopes(problem: Problem, point: Point) -> Floats:
    """Return the derivative of the residual by the searched parameters, linear part held."""
    out = np.empty((point.residual.shape[0], problem.search_size))
    for j in range(problem.search_size - 1):
        ahead, behind = point.search.copy(), point.search.copy()
        ahead[j] += _STEP
        behind[j] -= _STEP
        change = problem.columns(ahead) - problem.columns(behind)
        out[:, j] = -(change @ point.linear) / (2.0 * _STEP)
    out[:, -1] = problem.advanced_rate(float(point.search[-1]))
    return out


@dataclass(frozen=True)
class Bounds:
    """Where the search may go: lower and upper ends, shape (s,)."""

    lower: Floats
    upper: Floats

    def clip(self, search: Floats) -> Floats:
        """Return the nearest point inside."""
        return np.clip(search, self.lower, self.upper)


def bounds_of(problem: Problem, low_hz: float, high_hz: float, fastest_rad_s: float) -> Bounds:
    """Return the box that the searched parameters must stay in.

    Frequencies may leave the range that the data can show by a factor of four, so that a start
    outside finds its way in; the delay is at most 5 ms, far within what the series
    in `Problem.advanced` carries.
    """
    lower: list[float] = []
    upper: list[float] = []
    for _ in range(problem.shape_size // 2):
        lower += [np.log(2.0 * np.pi * low_hz / 4.0), np.log(1e-4)]
        upper += [np.log(2.0 * np.pi * high_hz * 4.0), np.log(5.0)]
    if problem.shape_size % 2:
        lower.append(-6.0)
        upper.append(6.0)
    for r in problem.law.ranges:
        ends = r.bounds(fastest_rad_s / 300.0, fastest_rad_s)
        lower.append(float(np.log(ends[0])))
        upper.append(float(np.log(ends[1])))
    return Bounds(np.array([*lower, -_LONGEST_DELAY]), np.array([*upper, _LONGEST_DELAY]))


def descend(problem: Problem, start: Floats, bounds: Bounds) -> tuple[Point, bool]:
    """Return the minimum that a start leads to, and whether the descent converged."""
    point, damping = evaluate(problem, bounds.clip(start)), 1e-3
    for _ in range(_ITERATIONS):
        slope = slopes(problem, point)
        # Kaufman: what the linear part can take over does not count.
        taken = np.linalg.lstsq(
            point.columns.T @ point.columns, point.columns.T @ slope, rcond=1e-13
        )[0]
        slope = slope - point.columns @ taken
        gram, gradient = slope.T @ slope, slope.T @ point.residual
        scale = np.maximum(np.diag(gram), 1e-12 * float(np.max(np.diag(gram))) + 1e-300)
        better: Point | None = None
        while better is None and damping < 1e8:
            step = -np.linalg.solve(gram + damping * np.diag(scale), gradient)
            step[:-1] = np.clip(step[:-1], -0.7, 0.7)
            trial = evaluate(problem, bounds.clip(point.search + step))
            if trial.cost < point.cost:
                better = trial
                damping = max(damping / 8.0, 1e-9)
            else:
                damping *= 6.0
        if better is None:
            return point, True
        fall = (point.cost - better.cost) / max(point.cost, 1e-300)
        point = better
        if fall < _CONVERGED:
            return point, True
    return point, False
