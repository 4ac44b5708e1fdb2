"""Recordings of the fake joint under its velocity drive: closed loop, independent physics."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agent.identify.signals import Signals
from fakes.friction import FrictionParameters
from fakes.joint import JointParameters
from fakes.plant import Plant, ServoParameters
from trajectories import Trajectory, point_to_point, stair_between, triangle

PLAIN = JointParameters(
    friction=FrictionParameters(static_extra_nm=0.0, viscous_floor_share=1.0)
)
"""The fake joint with Coulomb and viscous friction alone, the same at every temperature."""

JERK_RAD_S3 = 20_000.0


def triangle_wave(periods: int = 8, peak_rad_s: float = 60.0) -> Trajectory:
    return triangle(
        0.0,
        peak_velocity_rad_s=peak_rad_s,
        acceleration_rad_s2=180.0,
        jerk_rad_s3=JERK_RAD_S3,
        periods=periods,
        rest_s=0.3,
    )


def stair() -> Trajectory:
    return stair_between(
        0.0, 350.0, duration_s=20.0, acceleration_rad_s2=150.0, jerk_rad_s3=8000.0, steps=8
    )


def there_and_back() -> tuple[Trajectory, Trajectory]:
    there = point_to_point(
        0.0, 150.0, velocity_rad_s=80.0, acceleration_rad_s2=150.0, jerk_rad_s3=8000.0, rest_s=0.3
    )
    return there, there.reversed()


def drive(
    *trajectories: Trajectory,
    joint: JointParameters = PLAIN,
    seed: int = 0,
    noise_nm: float = 0.02,
    steps_per_sample: int = 4,
    torque_limit_nm: float = 10.0,
    name: str = "driven",
    with_position: bool = True,
    noise_memory: float = 0.0,
) -> Signals:
    """Drive trajectories one after the other; sample torque, position and velocity."""
    plant = Plant(joint, ServoParameters(encoder_counts_per_rev=1 << 20))
    plant.power_on()
    plant.torque_limit_nm = torque_limit_nm
    plant.rise_rad_s2 = plant.fall_rad_s2 = 1e6
    step_s = plant.servo.step_s
    command = np.concatenate(
        [t.sample(np.arange(0.0, t.duration_s, step_s)).velocity_rad_s for t in trajectories]
    )
    rows = []
    for k, target in enumerate(command):
        plant.target_rad_s = float(target)
        if k % steps_per_sample == 0:
            rows.append((plant.torque_nm, plant.counts, plant.velocity_measured_rad_s, target))
        plant.advance(1)
    torque, counts, velocity, asked = np.array(rows, dtype=np.float64).T
    rng = np.random.default_rng(seed)
    columns: dict[str, NDArray[np.generic]] = {
        "time_s": np.arange(torque.size) * step_s * steps_per_sample,
        "torque_nm": torque + _noise(rng, torque.size, noise_nm, noise_memory),
        "velocity_rad_s": velocity,
        "velocity_command_rad_s": asked,
    }
    if with_position:
        columns["position_rad"] = counts * 2.0 * np.pi / (1 << 20)
    return Signals.from_columns(columns, joint.gear_ratio, name=name)


def _noise(
    rng: np.random.Generator, count: int, sigma: float, memory: float
) -> NDArray[np.float64]:
    """Return noise of standard deviation `sigma`, white or first-order coloured."""
    from scipy.signal import lfilter

    white = rng.standard_normal(count) * sigma * np.sqrt(1.0 - memory**2)
    return np.asarray(lfilter([1.0], [1.0, -memory], white), dtype=np.float64)
