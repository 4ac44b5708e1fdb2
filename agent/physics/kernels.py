"""Loops that must run sample by sample, compiled. Import this late: numba is slow to load."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True)
def relax(steady: Floats, keep: Floats, start: float) -> Floats:
    """Return a state after each pair of pieces, shape (n,).

    ``x <- steady + (x - steady) keep`` for each of the 2 n pieces.
    """
    samples = steady.shape[0] // 2
    state = start
    out = np.empty(samples)
    for k in range(samples):
        for j in (2 * k, 2 * k + 1):
            state = steady[j] + (state - steady[j]) * keep[j]
        out[k] = state
    return out


@njit(cache=True)
def gap_angle(twist_rad: Floats, step_s: Floats, half_gap_rad: float, rate_per_s: float) -> Floats:
    """Return the clearance's angle, shape (n,), of a spring and damper in series with a gap.

    Freely the spring relaxes at `rate_per_s`; the walls at plus and minus `half_gap_rad` stop it.
    """
    out = np.empty(twist_rad.shape[0])
    gap = min(max(twist_rad[0], -half_gap_rad), half_gap_rad)
    out[0] = gap
    for k in range(1, twist_rad.shape[0]):
        spring = (twist_rad[k - 1] - gap) * math.exp(-rate_per_s * step_s[k])
        gap = min(max(twist_rad[k] - spring, -half_gap_rad), half_gap_rad)
        out[k] = gap
    return out


@njit(cache=True)
def carried_arm(
    time_s: Floats,
    position_rad: Floats,
    velocity_rad_s: Floats,
    inertia: float,
    stiffness: float,
    cubic: float,
    damping: float,
    half_gap: float,
    gravity_sin: float,
    gravity_cos: float,
    gear_ratio: float,
    substeps: int,
) -> Floats:
    """Return the torque, shape (n,), with which the motor carries an arm behind a spring.

    The arm hangs at rest on the spring at first. Between samples the motor's angle is the cubic
    with the measured angles and velocities; the arm moves by semi-implicit Euler steps.
    """
    samples = time_s.shape[0]
    out = np.empty(samples)
    angle = position_rad[0] / gear_ratio
    hang = gravity_sin * math.sin(angle) + gravity_cos * math.cos(angle)
    twist = hang / stiffness
    for _ in range(20):
        twist -= (stiffness * twist + cubic * twist**3 - hang) / (stiffness + 3 * cubic * twist**2)
    arm = position_rad[0] - twist
    if hang > 0.0:
        arm -= half_gap
    elif hang < 0.0:
        arm += half_gap
    speed = velocity_rad_s[0]
    out[0] = hang
    for k in range(1, samples):
        dt = time_s[k] - time_s[k - 1]
        q0, q1 = position_rad[k - 1], position_rad[k]
        v0, v1 = velocity_rad_s[k - 1] * dt, velocity_rad_s[k] * dt
        h = dt / substeps
        torque = 0.0
        for i in range(1, substeps + 1):
            u = i / substeps
            w = u - 1.0
            motor = q0 * (1 + 2 * u) * w * w + v0 * u * w * w
            motor += q1 * u * u * (3 - 2 * u) + v1 * u * u * w
            rate = 6 * u * w * (q0 - q1) + v0 * (1 - 4 * u + 3 * u * u) + v1 * (3 * u * u - 2 * u)
            d = motor - arm
            x = d - half_gap if d > half_gap else (d + half_gap if d < -half_gap else 0.0)
            torque = stiffness * x + cubic * x**3
            if x != 0.0:
                pull = torque + damping * (rate / dt - speed)
                # A gap can push, but not pull: without one the spring holds both ways.
                torque = pull if half_gap == 0.0 or pull * x > 0.0 else 0.0
            angle = arm / gear_ratio
            weight = gravity_sin * math.sin(angle) + gravity_cos * math.cos(angle)
            speed += h * (torque - weight) / inertia
            arm += h * speed
        out[k] = torque
    return out
