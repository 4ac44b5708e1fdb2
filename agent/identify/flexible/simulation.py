"""Simulation of a flexible joint from its motor torque, with stick and slip (thesis 4.17)."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from agent.identify.flexible.chain import Chain
from agent.identify.flexible.loops import simulate_steps
from agent.identify.result import Floats
from agent.physics.flexibility import ThreeMass, TwoMass
from agent.physics.rigid_body import gravity_columns

_LONGEST_STEP = 2.0  # radians of the fastest swing: beyond, a motor that sticks shakes loose
_MOST_STEPS = 100  # between two samples: a spring that swings faster hardly twists


@dataclass(frozen=True)
class FlexibleJoint:
    """A motor with friction that carries a chain of masses, or none; motor side.

    Parameters
    ----------
    motor_inertia_kg_m2 : float
        Above zero. Of a rigid joint, the whole inertia.
    chain : Chain or None
        What the motor carries through springs; None makes the joint rigid.
    coulomb_nm, viscous_nm_s_per_rad, static_extra_nm : float
        Friction on the motor, none negative; the law is `agent.physics.friction.STRIBECK`.
    stribeck_velocity_rad_s, exponent : float
        Of its Stribeck line; above zero, without meaning while `static_extra_nm` is zero.
    gravity_sin_nm, gravity_cos_nm, torque_offset_nm : float
        As in `agent.physics.rigid_body`; gravity pulls at the last mass.
    gear_ratio : float
        Motor turns per arm turn.
    cubic_spring_nm_per_rad3 : float
        Of a chain of a single mass, beside its spring; zero or more.
    """

    motor_inertia_kg_m2: float
    chain: Chain | None = None
    coulomb_nm: float = 0.0
    viscous_nm_s_per_rad: float = 0.0
    static_extra_nm: float = 0.0
    stribeck_velocity_rad_s: float = 1.0
    exponent: float = 1.0
    gravity_sin_nm: float = 0.0
    gravity_cos_nm: float = 0.0
    torque_offset_nm: float = 0.0
    gear_ratio: float = 1.0
    cubic_spring_nm_per_rad3: float = 0.0

    def __post_init__(self) -> None:
        for name in (
            "motor_inertia_kg_m2",
            "stribeck_velocity_rad_s",
            "exponent",
            "gear_ratio",
        ):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"{name}: expected a number above zero, got {getattr(self, name)}")
        if self.cubic_spring_nm_per_rad3 and (
            self.chain is None or len(self.chain.inertia_kg_m2) != 1
        ):
            raise ValueError("cubic_spring_nm_per_rad3: expected zero but for a single mass")
        for name in (
            "coulomb_nm",
            "viscous_nm_s_per_rad",
            "static_extra_nm",
            "cubic_spring_nm_per_rad3",
        ):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name}: expected zero or more, got {getattr(self, name)}")
        for name in ("gravity_sin_nm", "gravity_cos_nm", "torque_offset_nm"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"{name}: expected a number, got {getattr(self, name)}")


class StateSpace(NamedTuple):
    """``x' = A x + B torque - E load``, with ``x = (motor velocity, [twist, velocity] ...)``."""

    a: Floats
    b: Floats
    e: Floats


class Motion(NamedTuple):
    """Simulated motor position and velocity, shape (n,)."""

    position_rad: Floats
    velocity_rad_s: Floats


def state_space(joint: FlexibleJoint) -> StateSpace:
    """Return the linear part of the joint: the laws of `agent.physics.flexibility`, reordered."""
    jm, viscous, chain = joint.motor_inertia_kg_m2, joint.viscous_nm_s_per_rad, joint.chain
    if chain is None:
        return StateSpace(np.array([[-viscous / jm]]), np.array([1.0 / jm]), np.array([1.0 / jm]))
    law: TwoMass | ThreeMass
    if len(chain.inertia_kg_m2) == 1:
        law = TwoMass(
            jm, chain.inertia_kg_m2[0], chain.spring_nm_per_rad[0], chain.damper_nm_s_per_rad[0]
        )
        order = [1, 0, 2]
    else:
        law = ThreeMass(
            jm, *chain.inertia_kg_m2, *chain.spring_nm_per_rad, *chain.damper_nm_s_per_rad
        )
        order = [2, 0, 3, 1, 4]
    space = law.state_space(viscous)
    return StateSpace(space.A[np.ix_(order, order)], space.B[order], space.E[order])


def simulate(
    joint: FlexibleJoint,
    torque_nm: Floats,
    period_s: float,
    *,
    position_rad: float = 0.0,
    velocity_rad_s: float = 0.0,
) -> Motion:
    """Return the motion that a motor torque causes.

    Parameters
    ----------
    joint : FlexibleJoint
    torque_nm : ndarray, shape (n,)
        At even times; straight between them.
    period_s : float
        Time between samples, above zero. Dry friction is constant within a step: where a spring
        swings too fast for that, steps are made shorter.
    position_rad, velocity_rad_s : float
        Initial motor position and velocity; the chain moves along with it, its springs carrying
        gravity.
    """
    if not (math.isfinite(period_s) and period_s > 0.0):
        raise ValueError(f"period_s: expected a number above zero, got {period_s}")
    torque = np.ascontiguousarray(torque_nm, dtype=np.float64) - joint.torque_offset_nm
    if torque.ndim != 1 or torque.size < 1 or not np.isfinite(torque).all():
        raise ValueError("torque_nm: expected a finite vector of at least one sample")
    start = _initial_state(joint, position_rad, velocity_rad_s)
    steps = _steps_between(joint, period_s) if torque.size > 1 else 1
    if steps == 1:
        return _simulated(joint, torque, period_s, position_rad, start)
    count = steps * (torque.size - 1) + 1
    between = np.interp(np.arange(count) / steps, np.arange(torque.size), torque)
    fine = _simulated(joint, between, period_s / steps, position_rad, start)
    return Motion(*(np.ascontiguousarray(values[::steps]) for values in fine))


def _steps_between(joint: FlexibleJoint, period_s: float) -> int:
    """Return how many steps between two samples its swing bears."""
    fastest = float(np.abs(np.linalg.eigvals(state_space(joint).a)).max())
    return min(max(math.ceil(period_s * fastest / _LONGEST_STEP), 1), _MOST_STEPS)


def _simulated(
    joint: FlexibleJoint, torque_nm: Floats, period_s: float, position_rad: float, start: Floats
) -> Motion:
    """Return the motion in steps of one period, shape (n,), from a state, shape (s,)."""
    transition, now, change, load = _one_step(state_space(joint), period_s)
    position, velocity = np.empty(torque_nm.size), np.empty(torque_nm.size)
    position[0], velocity[0] = position_rad, start[0]
    rubbing = (
        joint.coulomb_nm,
        joint.static_extra_nm,
        joint.stribeck_velocity_rad_s,
        joint.exponent,
    )
    compiled(simulate_steps)(
        transition,
        now - change,
        change,
        now,
        load,
        np.array(rubbing),
        np.array([joint.gravity_sin_nm, joint.gravity_cos_nm, joint.gear_ratio]),
        joint.cubic_spring_nm_per_rad3,
        period_s,
        torque_nm,
        start,
        position,
        velocity,
    )
    return Motion(position, velocity)


def _one_step(space: StateSpace, period_s: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return what one step does: to the state, and a constant torque, a ramp and a load in it.

    One exponential holds them all (Van Loan 1978).
    """
    from scipy.linalg import expm

    size = space.b.shape[0]
    big = np.zeros((size + 3, size + 3))
    big[:size, :size], big[:size, size], big[:size, size + 2] = space
    big[size, size + 1] = 1.0 / period_s
    exact = expm(big * period_s)
    return (
        np.ascontiguousarray(exact[:size, :size]),
        np.ascontiguousarray(exact[:size, size]),
        np.ascontiguousarray(exact[:size, size + 1]),
        np.ascontiguousarray(exact[:size, size + 2]),
    )


def _initial_state(joint: FlexibleJoint, position_rad: float, velocity_rad_s: float) -> Floats:
    """Return the state in which everything moves alike and every spring carries gravity."""
    masses = 0 if joint.chain is None else len(joint.chain.inertia_kg_m2)
    state = np.zeros(1 + 2 * masses)
    state[0], state[2::2] = velocity_rad_s, velocity_rad_s
    levels = np.array([joint.gravity_sin_nm, joint.gravity_cos_nm])
    load = gravity_columns(np.array(position_rad), joint.gear_ratio) @ levels
    if joint.chain is not None:
        state[1::2] = load / np.array(joint.chain.spring_nm_per_rad)
    return state


@cache
def compiled(loop: Callable[..., None]) -> Callable[..., None]:
    """Return an inner loop, compiled; the machine code is kept on disk where that is allowed."""
    numba = importlib.import_module("numba")
    try:
        fast = numba.njit(cache=True, nogil=True)(loop)
    except RuntimeError:  # no place to keep it: neither beside the source nor in the user's cache
        fast = numba.njit(nogil=True)(loop)

    def steps(*arguments: object) -> None:
        fast(*arguments)

    return steps
