"""One run of a motion on the simulated joint, as the columns that a recorder would keep."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fakes.checks import require_finite, require_not_negative, require_positive
from fakes.friction import FrictionTruth
from fakes.joint import JointParameters
from trajectories import Trajectory

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Measuring:
    """What the drive's account of the motion is off by.

    Parameters
    ----------
    rate_hz : float
        Samples a second.
    torque_noise_nm, torque_memory_s : float
        Standard deviation and memory of the coloured noise of the reported torque.
    velocity_noise_rad_s : float
        White noise of the reported velocity.
    ripple_nm, ripple_order : float
        Torque periodic in the motor's position.
    """

    rate_hz: float = 200.0
    torque_noise_nm: float = 0.03
    torque_memory_s: float = 0.02
    velocity_noise_rad_s: float = 0.05
    ripple_nm: float = 0.01
    ripple_order: float = 2.0

    def __post_init__(self) -> None:
        require_finite(self)
        require_positive(self, "rate_hz", "torque_memory_s")
        require_not_negative(self, "torque_noise_nm", "velocity_noise_rad_s", "ripple_nm")


@dataclass(frozen=True)
class Condition:
    """The joint on the night of one run.

    Parameters
    ----------
    friction : FrictionTruth
        The law at the gearbox's temperature, oil and individual included.
    load_friction : float
        Friction a newton metre of gravity torque that the gear carries.
    payload_kg, payload_arm_m : float
        At the flange, and how far it is from the axis.
    rise_nm : ndarray, shape (m, 2)
        (speed, rise of friction) of the wear, rising in speed; interpolated.
    """

    friction: FrictionTruth
    load_friction: float
    payload_kg: float
    payload_arm_m: float
    rise_nm: Floats


@dataclass(frozen=True)
class CycleRun:
    """One run: the contract's columns and metadata, and the truth for whoever checks.

    `label` holds gearbox_degc, low_speed_rise_nm (at rest) and the day.
    """

    name: str
    columns: Mapping[str, Floats]
    metadata: Mapping[str, Any]
    label: Mapping[str, float]


def run_columns(
    joint: JointParameters,
    condition: Condition,
    motion: Trajectory,
    measuring: Measuring,
    rng: np.random.Generator,
) -> dict[str, Floats]:
    """Drive a motion and return what is recorded, all of shape (n,).

    The joint is rigid and follows its set-points; torque is what Newton asks for it. The payload
    adds to gravity and inertia.
    """
    n = int(motion.duration_s * measuring.rate_hz) + 1
    time_s = np.arange(n) / measuring.rate_hz
    path = motion.sample(time_s)
    position, velocity = np.asarray(path.position_rad), np.asarray(path.velocity_rad_s)
    arm = position / joint.gear_ratio
    held = condition.payload_kg * condition.payload_arm_m / joint.gear_ratio
    gravity = (joint.gravity_sin_nm + 9.81 * held) * np.sin(arm)
    gravity += joint.gravity_cos_nm * np.cos(arm)
    inertia = joint.inertia_kg_m2 + held * condition.payload_arm_m / joint.gear_ratio
    torque = inertia * np.asarray(path.acceleration_rad_s2) + gravity
    torque += np.sign(velocity) * friction_nm(condition, np.abs(velocity), np.abs(gravity))
    torque += measuring.ripple_nm * np.sin(measuring.ripple_order * position)
    torque += coloured(rng, n, measuring.torque_noise_nm, measuring)
    seen = velocity + measuring.velocity_noise_rad_s * rng.standard_normal(n)
    return {
        "time_s": time_s,
        "position_rad": position,
        "velocity_rad_s": seen,
        "torque_nm": np.asarray(torque, dtype=np.float64),
    }


def friction_nm(condition: Condition, speed_rad_s: Floats, load_nm: Floats) -> Floats:
    """Return the friction at each speed (0 or more) and load, shape (n,)."""
    law = condition.friction
    boundary = law.static_extra_nm * np.exp(
        -((speed_rad_s / law.stribeck_velocity_rad_s) ** law.exponent)
    )
    worn = np.interp(speed_rad_s, condition.rise_nm[:, 0], condition.rise_nm[:, 1])
    level = law.coulomb_nm + boundary + law.viscous_nm_s_per_rad * speed_rad_s
    return np.asarray(level + worn + condition.load_friction * load_nm, dtype=np.float64)


def coloured(rng: np.random.Generator, n: int, sigma: float, measuring: Measuring) -> Floats:
    """Return first-order noise of standard deviation `sigma`, shape (n,), begun in its rest.

    Its impulse response is cut off where it has fallen to 1e-6.
    """
    decay = 1.0 / (measuring.rate_hz * measuring.torque_memory_s)
    response = np.exp(-decay * np.arange(math.ceil(14.0 / decay)))
    white = rng.standard_normal(n + response.size - 1)
    scale = sigma / float(np.linalg.norm(response))
    return np.asarray(scale * np.convolve(white, response, mode="valid"), dtype=np.float64)
