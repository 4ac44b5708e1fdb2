"""The grey box as a separable least-squares problem.

Given the chain's shape (and the Stribeck velocity and exponent) the torque is linear in all else:
``torque(t) = [Jm a + J M(shape) a + friction + gravity](t - delay) + offset + free motion``. The
linear part is solved for at every step (variable projection, Golub & Pereyra 1973, with Kaufman's
Jacobian), with the inertias and friction held at zero or above; only the shape, friction's own
non-linear parameters and the delay of the torque against the motion are searched. The delay acts
on the motion, which is clean: shifting the torque instead would let its noise, differentiated,
pass for information about the delay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from agent.identify.flexible.chain import (
    SHAPE_SIZE,
    Chain,
    Structure,
    apparent_inertia,
    chain_of,
    chains_of,
    free_motion,
    stiffening,
)
from agent.identify.flexible.preparation import Prepared
from agent.identify.result import Floats
from agent.physics.friction import FrictionLaw
from agent.physics.rigid_body import GRAVITY


@dataclass(frozen=True)
class Problem:
    """Stretches, and the model that shall explain their torque.

    Parameters
    ----------
    stretches : tuple of Prepared
    kind : {"two-mass", "three-mass", "two-arms"} or None
        What hangs on the motor; None is the rigid body.
    law : FrictionLaw
        Of the motor's friction.
    has_gravity : bool
        Whether gravity is part of the model.
    cubes : tuple of ndarray or None
        Third power of every stretch's twist, rad^3, where the single spring may stiffen: see
        `agent.identify.flexible.twist`.
    """

    stretches: tuple[Prepared, ...]
    kind: Structure | None
    law: FrictionLaw
    has_gravity: bool
    cubes: tuple[Floats, ...] | None = None

    @property
    def shape_size(self) -> int:
        """Return the number of the chain's shape parameters."""
        return 0 if self.kind is None else SHAPE_SIZE[self.kind]

    @property
    def arms(self) -> int:
        """Return how many chains hang on the motor side by side."""
        return len(_INERTIAS.get(self.kind, _FLEXIBLE)) - 1

    @property
    def search_size(self) -> int:
        """Return the number of searched parameters: shape, friction's non-linear ones, delay."""
        return self.shape_size + len(self.law.nonlinear) + 1

    @property
    def linear_names(self) -> tuple[str, ...]:
        """Return the names of the linear parameters, free motions apart."""
        inertias = _INERTIAS.get(self.kind, _FLEXIBLE)
        cubic = () if self.cubes is None else (CUBIC,)
        gravity = GRAVITY if self.has_gravity else ()
        return (*inertias, *cubic, *self.law.linear, *gravity, "torque_offset_nm")

    @cached_property
    def fastest_rad_s(self) -> float:
        """Return the highest speed of the motor."""
        return max(float(np.max(np.abs(p.track.velocity_rad_s))) for p in self.stretches)

    @cached_property
    def positive(self) -> NDArray[np.bool_]:
        """Return which linear parameters cannot be negative."""
        count = len(self.linear_names) - 1 - 2 * self.has_gravity
        return np.arange(len(self.linear_names)) < count

    def held(self, linear: Floats) -> NDArray[np.bool_]:
        """Return which of the linear parameters, free motions included, are held at zero."""
        out = np.zeros(linear.shape[0], dtype=np.bool_)
        out[: self.positive.shape[0]] = self.positive & (linear[: self.positive.shape[0]] <= 0.0)
        return out

    def feasible(self, linear: Floats) -> Floats:
        """Return linear parameters with those at zero that cannot be negative and are."""
        out = linear.copy()
        count = self.positive.shape[0]
        out[:count] = np.where(self.positive, np.maximum(linear[:count], 0.0), linear[:count])
        return out

    @cached_property
    def keep(self) -> NDArray[np.bool_]:
        """Return which rows count, over all stretches."""
        return np.concatenate([p.usable for p in self.stretches])

    @cached_property
    def target(self) -> Floats:
        """Return the torque to explain, shape (n,)."""
        return self.counted(np.concatenate([p.torque_nm for p in self.stretches]))

    @cached_property
    def _fixed_friction(self) -> tuple[Floats, ...] | None:
        if self.law.nonlinear:
            return None
        return tuple(friction_columns(p, self.law, ()) for p in self.stretches)

    def friction(self, index: int, nonlinear: Floats) -> Floats:
        """Return friction's columns of one stretch, filtered, shape (c, full n)."""
        if self._fixed_friction is not None:
            return self._fixed_friction[index]
        return friction_columns(self.stretches[index], self.law, tuple(nonlinear))

    def columns(self, search: Floats) -> Floats:
        """Return the columns at the rows that count, freed of blows."""
        return self.counted(self.all_columns(search))

    def counted(self, rows: Floats) -> Floats:
        """Return of rows, shape (full n, ...), those that count, less what blows explain of them.

        Blows of free size beside the columns are thereby solved for (Frisch & Waugh 1933).
        """
        ends = np.cumsum([p.torque_nm.shape[0] for p in self.stretches])
        out = []
        for p, basis, part in zip(
            self.stretches, self.blow_bases, np.split(rows, ends[:-1]), strict=True
        ):
            kept = part[p.usable]
            out.append(kept - basis @ (basis.T @ kept) if basis.size else kept)
        return np.concatenate(out)

    @cached_property
    def blow_bases(self) -> tuple[Floats, ...]:
        """Return an orthonormal basis of each stretch's blows at its rows that count."""
        return tuple(np.linalg.qr(p.blows[:, p.usable].T)[0] for p in self.stretches)

    def all_columns(self, search: Floats) -> Floats:
        """Return the linear problem's columns: named ones, then the chain's free motions."""
        shape = search[: self.shape_size]
        chains = [] if self.kind is None else chains_of(self.kind, shape)
        nonlinear = np.exp(search[self.shape_size : -1])
        delay_s = float(search[-1])
        named, free = [], []
        for i, p in enumerate(self.stretches):
            friction = self.friction(i, nonlinear)
            rows = [p.through(np.ones_like(p.spectrum), delay_s)[np.newaxis]]
            rows += [
                p.through(apparent_inertia(c, p.omega_rad_s), delay_s)[np.newaxis] for c in chains
            ]
            if chains:
                free.append(free_motions(p, chains))
            if self.cubes is not None:
                rows.append(cubic_column(p, self.cubes[i], shape)[np.newaxis])
            rows.append(p.thinned(friction, delay_s))
            if self.has_gravity:
                rows.append(p.thinned(p.angles, delay_s))
            rows.append(np.ones((1, p.torque_nm.shape[0])))
            named.append(np.concatenate(rows).T)
        out = np.concatenate(named)
        if free:
            out = np.concatenate((out, _diagonal(free)), axis=1)
        return out


CUBIC = "cubic_spring_nm_per_rad3"
_FLEXIBLE: tuple[str, ...] = ("motor_inertia_kg_m2", "arm_inertia_kg_m2")
_INERTIAS: dict[Structure | None, tuple[str, ...]] = {
    None: ("inertia_kg_m2",),
    "two-arms": ("motor_inertia_kg_m2", "first_inertia_kg_m2", "second_inertia_kg_m2"),
}


def friction_columns(p: Prepared, law: FrictionLaw, nonlinear: Sequence[float]) -> Floats:
    """Return a friction law's columns of one stretch, filtered, shape (c, full n)."""
    share = np.abs(p.direction)[:, np.newaxis]
    speed = np.copysign(np.maximum(np.abs(p.track.velocity_rad_s), 1e-12), p.direction)
    return p.filtered((share * law.columns(speed, *nonlinear)).T)


def cubic_column(p: Prepared, cube_rad3: Floats, shape: Floats) -> Floats:
    """Return what a cubic spring of 1 N m/rad^3 adds to the torque of one stretch, shape (n,).

    The cube of the twist is late by the torque's delay already.
    """
    return p.passed(cube_rad3, stiffening(chain_of(shape), p.omega_rad_s))


def free_motions(p: Prepared, chains: Sequence[Chain]) -> Floats:
    """Return how the chains of one stretch swing by themselves, shape (n, f)."""
    count = p.torque_nm.shape[0]
    return np.concatenate([free_motion(c, count, p.period_s) for c in chains], axis=1)


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

    `linear` holds the named parameters and then the free motions; `cost` is the sum of squares;
    `slopes` the residual's derivative by the searched parameters, where it is known already.
    """

    search: Floats
    linear: Floats
    residual: Floats
    columns: Floats
    cost: float
    slopes: Floats | None = None


def evaluate(problem: Problem, search: Floats) -> Point:
    """Solve the linear part at given searched parameters."""
    columns = problem.columns(search)
    linear = solve_positive(columns, problem.target, problem.positive)
    residual = problem.target - columns @ linear
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
