"""A joint for the estimators' tests, written apart from every law of the product.

The motion is prescribed and smooth; the torque is what Newton asks for it, plus coloured noise.
With `spring_nm_per_rad`, the arm is a second mass behind a spring that follows the motor's motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.signals.arrays import Signals

Floats = NDArray[np.float64]

SPEEDS_RAD_S = (2.0, 4.0, 7.0, 12.0, 20.0, 32.0, 48.0, 70.0, 100.0, 140.0)


@dataclass(frozen=True)
class Joint:
    """Truth. Units as in the names, motor side."""

    inertia_kg_m2: float = 0.0184
    coulomb_nm: float = 0.6042
    viscous_nm_s_per_rad: float = 0.0107
    static_extra_nm: float = 0.0
    stribeck_velocity_rad_s: float = 9.0
    exponent: float = 1.0
    gravity_sin_nm: float = 0.0
    gravity_cos_nm: float = 0.0
    offset_nm: float = 0.0
    gear_ratio: float = 224.0
    spring_nm_per_rad: float = math.inf
    arm_share: float = 0.5

    def friction(self, velocity: Floats) -> Floats:
        """Friction torque of moving parts."""
        speed = np.abs(velocity)
        fall = self.static_extra_nm * np.exp(
            -np.power(speed / self.stribeck_velocity_rad_s, self.exponent)
        )
        return np.asarray(
            np.where(velocity >= 0, 1.0, -1.0) * (self.coulomb_nm + fall)
            + self.viscous_nm_s_per_rad * velocity
        )


@dataclass(frozen=True)
class Motion:
    """A prescribed motion on an even grid."""

    time_s: Floats
    position_rad: Floats
    velocity_rad_s: Floats
    acceleration_rad_s2: Floats

    @property
    def rate_hz(self) -> float:
        return 1.0 / float(self.time_s[1] - self.time_s[0])


def stair(
    speeds: Sequence[float] = SPEEDS_RAD_S,
    *,
    stroke_rad: float = 60.0,
    rate_hz: float = 250.0,
    ramp_s: float = 0.25,
    longest_s: float = 3.0,
    start_rad: float = 0.0,
    directions: Sequence[int] = (1, -1),
    dwell_s: float = 0.0,
) -> Motion:
    """Pass every speed in every direction, half-cosine ramps between, round one middle.

    The acceleration is that of the ramps, and no difference of their samples, which is smaller.
    """
    pieces: list[Floats] = []
    slopes: list[Floats] = []
    previous = 0.0
    ramp_n = max(int(ramp_s * rate_hz), 2)
    phase = np.pi * np.arange(ramp_n) / ramp_n
    shape, steep = 0.5 - 0.5 * np.cos(phase), 0.5 * np.pi * rate_hz / ramp_n * np.sin(phase)
    for speed in speeds:
        for direction in directions:
            level = direction * speed
            held = int(min(stroke_rad / speed, longest_s) * rate_hz)
            pieces += [previous + (level - previous) * shape, np.full(held, level)]
            slopes += [(level - previous) * steep, np.zeros(held)]
            previous = level
            if dwell_s:
                rest = np.zeros(int(dwell_s * rate_hz))
                pieces += [previous * (1.0 - shape), rest]
                slopes += [-previous * steep, rest]
                previous = 0.0
    pieces.append(previous * (1.0 - shape))
    slopes.append(-previous * steep)
    velocity = np.concatenate(pieces)
    time_s = np.arange(velocity.size) / rate_hz
    step = np.concatenate(([0.0], (velocity[1:] + velocity[:-1]) / (2.0 * rate_hz)))
    position = start_rad + np.cumsum(step)
    return Motion(time_s, position, velocity, np.concatenate(slopes))


def coloured(rng: np.random.Generator, n: int, sigma: float, memory: float = 0.95) -> Floats:
    """First-order autoregressive noise of standard deviation `sigma`."""
    from scipy.signal import lfilter

    white = rng.standard_normal(n) * sigma * math.sqrt(1.0 - memory**2)
    white[0] = rng.standard_normal() * sigma
    return np.asarray(lfilter([1.0], [1.0, -memory], white))


def torque_of(joint: Joint, motion: Motion) -> Floats:
    """Inverse dynamics, with the arm behind its spring where there is one."""
    arm = motion.position_rad / joint.gear_ratio
    gravity = joint.gravity_sin_nm * np.sin(arm) + joint.gravity_cos_nm * np.cos(arm)
    inertia = joint.inertia_kg_m2 * motion.acceleration_rad_s2
    if math.isfinite(joint.spring_nm_per_rad):
        inertia = _flexible_inertia(joint, motion)
    return np.asarray(inertia + joint.friction(motion.velocity_rad_s) + gravity + joint.offset_nm)


def _flexible_inertia(joint: Joint, motion: Motion) -> Floats:
    """Motor mass plus the force of a spring with an arm on it (trapezoidal rule)."""
    from scipy.signal import bilinear, lfilter

    arm = joint.arm_share * joint.inertia_kg_m2
    k = joint.spring_nm_per_rad
    damping = 0.06 * math.sqrt(k * arm)
    num, den = bilinear([arm * damping, arm * k], [arm, damping, k], fs=motion.rate_hz)
    through_spring = lfilter(num, den, motion.acceleration_rad_s2)
    rigid = (1.0 - joint.arm_share) * joint.inertia_kg_m2 * motion.acceleration_rad_s2
    return np.asarray(rigid + through_spring)


def record(
    joint: Joint,
    motion: Motion,
    *,
    seed: int = 0,
    noise_nm: float = 0.02,
    memory: float = 0.9,
    velocity_noise_rad_s: float = 0.01,
    with_position: bool = True,
    with_velocity: bool = True,
    encoder_counts: int | None = None,
    name: str = "simulated",
) -> Signals:
    """Return what a recorder would have kept."""
    rng = np.random.default_rng(seed)
    n = motion.time_s.size
    torque = torque_of(joint, motion) + coloured(rng, n, noise_nm, memory)
    velocity = motion.velocity_rad_s + velocity_noise_rad_s * rng.standard_normal(n)
    position = motion.position_rad.copy()
    if encoder_counts is not None:
        count = 2.0 * np.pi / encoder_counts
        position = np.round(position / count) * count
    columns: dict[str, NDArray[np.generic]] = {"time_s": motion.time_s, "torque_nm": torque}
    if with_position:
        columns["position_rad"] = position
    if with_velocity:
        columns["velocity_rad_s"] = velocity
    return Signals.from_columns(columns, joint.gear_ratio, name=name)
