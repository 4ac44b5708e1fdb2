"""Joints that turn round, integrated by a stiff solver: a truth apart from the product's laws.

The joint is driven in closed loop along `trajectories.reversals`; its torque is what the loop asks
for. Noise, the encoder's phase and the sampling's phase come with a seed, so that one integration
serves a campaign.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from agent.identify.signals.arrays import Signals
from trajectories import Trajectory, reversals

Floats = NDArray[np.float64]
Bristles = Callable[[float, Floats], tuple[float, Floats]]

GEAR = 100.0
COUNTS = 1 << 16
INERTIA, VISCOUS = 0.004, 0.02
STIFF, DAMPED = 900.0, 6.0  # of the position loop
FINE_S = 2.5e-4
GEAR_STEP_S = 2.5e-5
_WITHIN = 16  # steps of the integration in one of them: with a single one a stiff gear's compliance
# came out 0.2 of its least error too small
MOTOR_INERTIA, ARM_INERTIA = 0.003, 0.002
MOTOR_COULOMB, ARM_COULOMB = 0.3, 0.3
SAMPLE_S = 1e-3


@dataclass(frozen=True)
class Run:
    """One integration, every `FINE_S`; the arm's angle times the gear ratio. Shapes (n,)."""

    time_s: Floats
    position_rad: Floats
    velocity_rad_s: Floats
    torque_nm: Floats
    arm_rad: Floats = field(default_factory=lambda: np.zeros(0))


def swings(
    amplitude_rad: float = 1.0,
    *,
    halvings: int = 3,
    count: int = 2,
    velocity_rad_s: float = 1.0,
    acceleration_rad_s2: float = 6.0,
) -> Trajectory:
    return reversals(
        0.0,
        amplitude_rad,
        halvings=halvings,
        swings=count,
        velocity_rad_s=velocity_rad_s,
        acceleration_rad_s2=acceleration_rad_s2,
        jerk_rad_s3=200.0,
    )


def dahl(level_nm: float = 0.6, stiffness_nm_per_rad: float = 15.0) -> Bristles:
    """Return friction whose state is its own torque."""

    def rule(velocity: float, state: Floats) -> tuple[float, Floats]:
        slope = stiffness_nm_per_rad * (velocity - abs(velocity) * state[0] / level_nm)
        return float(state[0]), np.array([slope])

    return rule


def two_springs(
    fast_nm: float = 1.0, slow_nm: float = 0.4, length_rad: float = 0.1, share: float = 0.25
) -> Bristles:
    """Return Bliman and Sorine's pair in the form that they print: first order in travel."""

    def rule(velocity: float, state: Floats) -> tuple[float, Floats]:
        rest, speed = np.array([share * length_rad, length_rad]), abs(velocity)
        push = np.array([fast_nm, -slow_nm]) * velocity
        return float(state.sum()), (push - speed * state) / rest

    return rule


def lugre(
    level_nm: float = 0.6,
    extra_nm: float = 0.25,
    speed_rad_s: float = 0.15,
    stiffness_nm_per_rad: float = 15.0,
    damping_nm_s_per_rad: float = 0.1,
) -> Bristles:
    """Return bristles whose state is their bending, rad."""

    def rule(velocity: float, state: Floats) -> tuple[float, Floats]:
        top = level_nm + extra_nm * math.exp(-((velocity / speed_rad_s) ** 2))
        rate = velocity - stiffness_nm_per_rad * abs(velocity) * state[0] / top
        bent = stiffness_nm_per_rad * state[0] + damping_nm_s_per_rad * rate
        return float(bent), np.array([rate])

    return rule


@functools.lru_cache(maxsize=8)
def bristled(kind: str, motion: Trajectory | None = None) -> Run:
    """Integrate one of the three laws, by name."""
    rule, size = {"dahl": (dahl(), 1), "bliman-sorine": (two_springs(), 2), "lugre": (lugre(), 1)}[
        kind
    ]
    return integrate(rule, size, swings() if motion is None else motion)


def integrate(rule: Bristles, size: int, motion: Trajectory) -> Run:
    """Drive a mass with this friction along a trajectory; state: position, velocity, friction."""
    from scipy.integrate import solve_ivp

    def asked(t: float, q: float, v: float) -> float:
        point = motion.at(t)
        return (
            INERTIA * point.acceleration_rad_s2
            + STIFF * (point.position_rad - q)
            + DAMPED * (point.velocity_rad_s - v)
        )

    def slope(t: float, x: Floats) -> Floats:
        friction, rate = rule(float(x[1]), x[2:])
        push = asked(t, float(x[0]), float(x[1])) - friction - VISCOUS * x[1]
        return np.concatenate(([x[1], push / INERTIA], rate))

    time_s = np.arange(0.0, motion.duration_s, FINE_S)
    path = solve_ivp(
        slope,
        (0.0, motion.duration_s),
        np.zeros(2 + size),
        method="LSODA",
        t_eval=time_s,
        rtol=1e-7,
        atol=1e-9,
        max_step=0.01,
    )
    assert path.success
    position, velocity = path.y[0], path.y[1]
    torque = np.array(
        [
            asked(float(t), float(q), float(v))
            for t, q, v in zip(time_s, position, velocity, strict=True)
        ]
    )
    return Run(time_s, position, velocity, torque)


@functools.lru_cache(maxsize=8)
def geared(gap_rad: float, stiffness_nm_per_rad: float, motion: Trajectory | None = None) -> Run:
    """Drive a motor that carries an arm through a gap and a spring, both with dry friction.

    Fixed small steps; dry friction takes away as much momentum as it can in each.
    """
    fine, rows = _gear_rows(gap_rad, stiffness_nm_per_rad, swings() if motion is None else motion)
    every = round(FINE_S / GEAR_STEP_S)
    position, velocity, torque, arm = rows[::every].T
    return Run(fine[::every], position, velocity, torque, arm)


def gear_motion(
    gap_rad: float, stiffness_nm_per_rad: float, motion: Trajectory
) -> tuple[Floats, Floats]:
    """Return the motor's angle and velocity of `geared`, every `GEAR_STEP_S`."""
    _, rows = _gear_rows(gap_rad, stiffness_nm_per_rad, motion)
    return rows[:, 0].copy(), rows[:, 1].copy()


def own_swings(seed: int) -> Trajectory:
    """Return reversals at a speed of the seed's own, as fast as those of `swings` within 15 %.

    At one and the same steady speed an encoder's error is one and the same line in all seeds.
    """
    rng = np.random.default_rng(seed)
    speed, acceleration = rng.uniform(0.85, 1.15), 6.0 * rng.uniform(0.9, 1.1)
    return swings(
        float(rng.uniform(0.9, 1.1)), velocity_rad_s=speed, acceleration_rad_s2=acceleration
    )


def _gear_rows(gap: float, stiff: float, motion: Trajectory) -> tuple[Floats, Floats]:
    """Return times, and motor angle, velocity, torque and the arm's angle."""
    fine = np.arange(0.0, motion.duration_s, GEAR_STEP_S)
    points = motion.sample(fine)
    return fine, _gear_loop(
        points.position_rad, points.velocity_rad_s, points.acceleration_rad_s2, gap, stiff
    )


def _gear_loop(q_ref: Floats, v_ref: Floats, a_ref: Floats, gap: float, stiff: float) -> Floats:
    return np.asarray(_compiled()(q_ref, v_ref, a_ref, gap, stiff))


@functools.cache
def _compiled() -> Callable[..., Floats]:
    import numba

    loop: Any = numba.njit(cache=True)(_gear_steps)
    return cast("Callable[..., Floats]", loop)


def _gear_steps(q_ref: Floats, v_ref: Floats, a_ref: Floats, gap: float, stiff: float) -> Floats:
    """Return motor angle, velocity, torque and the arm's angle, shape (n, 4)."""
    dt, damp = GEAR_STEP_S / _WITHIN, 0.005 * math.sqrt(stiff)
    q = v = arm = rate = 0.0
    out = np.empty((q_ref.size, 4))
    for k in range(q_ref.size):
        then = min(k + 1, q_ref.size - 1)
        for j in range(_WITHIN):
            share = j / _WITHIN
            torque = (MOTOR_INERTIA + ARM_INERTIA) * (a_ref[k] + share * (a_ref[then] - a_ref[k]))
            torque += STIFF * (q_ref[k] + share * (q_ref[then] - q_ref[k]) - q)
            torque += DAMPED * (v_ref[k] + share * (v_ref[then] - v_ref[k]) - v)
            twist = q - arm
            tooth = 0.0
            if twist > gap / 2:
                tooth = max(stiff * (twist - gap / 2) + damp * (v - rate), 0.0)
            elif twist < -gap / 2:
                tooth = min(stiff * (twist + gap / 2) + damp * (v - rate), 0.0)
            if j == 0:
                out[k, 0], out[k, 1], out[k, 2], out[k, 3] = q, v, torque, arm
            v += dt * (torque - tooth - VISCOUS * v) / MOTOR_INERTIA
            v = math.copysign(max(abs(v) - dt * MOTOR_COULOMB / MOTOR_INERTIA, 0.0), v)
            rate += dt * tooth / ARM_INERTIA
            rate = math.copysign(max(abs(rate) - dt * ARM_COULOMB / ARM_INERTIA, 0.0), rate)
            q += dt * v
            arm += dt * rate
    return out


def sampled(
    run: Run,
    seed: int,
    *,
    noise_nm: float = 0.01,
    counts: int = COUNTS,
    sample_s: float = SAMPLE_S,
    arm_noise_rad: float = 0.0,
    arm_counts: int = 1 << 22,
    arm_late_s: float = 0.0,
    with_arm: bool = False,
) -> Signals:
    """Record a run: quantised encoders at a random phase, torque with white noise.

    `arm_late_s` is how much older the arm's angle is than its time stamp.
    """
    rng = np.random.default_rng(seed)
    stride = round(sample_s / FINE_S)
    index = np.arange(int(rng.integers(stride)), run.time_s.size, stride)
    step = 2.0 * np.pi / counts
    phase = rng.uniform(0.0, step)
    columns: dict[str, NDArray[np.generic]] = {
        "time_s": run.time_s[index] - run.time_s[index[0]],
        "position_rad": np.floor((run.position_rad[index] + phase) / step) * step,
        "torque_nm": run.torque_nm[index] + noise_nm * rng.standard_normal(index.size),
    }
    if with_arm:
        seen = np.interp(run.time_s[index] - arm_late_s, run.time_s, run.arm_rad) / GEAR
        seen = seen + arm_noise_rad * rng.standard_normal(index.size)
        fine = 2.0 * np.pi / arm_counts
        columns["position_arm_rad"] = np.floor((seen + rng.uniform(0.0, fine)) / fine) * fine
    return Signals.from_columns(columns, GEAR, name=f"seed {seed}")
