"""Recordings of the fake joint under its velocity drive: closed loop, independent physics."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agent.identify.signals.arrays import Signals
from fakes.friction import FrictionParameters
from fakes.joint import JointParameters
from fakes.plant import Plant, ServoParameters
from trajectories import Trajectory, point_to_point, stair_between, triangle

PLAIN = JointParameters(friction=FrictionParameters(static_extra_nm=0.0, viscous_floor_share=1.0))
"""The fake joint with Coulomb and viscous friction alone, the same at every temperature."""

JERK_RAD_S3 = 20_000.0
COUNTS = 1 << 22


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
        0.0, 160.0, duration_s=12.0, acceleration_rad_s2=150.0, jerk_rad_s3=8000.0, steps=5
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
    fine: bool = False,
) -> Signals:
    """Drive trajectories one after the other; sample torque, position and velocity.

    The plant takes its damper a step late, which stiffens the spring by `d w^2 dt / 2`, 0.1 % at
    its usual step; `fine` quarters the step where intervals are narrower than that.
    """
    step_s = 0.0000625 if fine else 0.00025
    steps_per_sample = steps_per_sample * 4 if fine else steps_per_sample
    plant = Plant(joint, ServoParameters(encoder_counts_per_rev=COUNTS, step_s=step_s))
    plant.power_on()
    plant.torque_limit_nm = torque_limit_nm
    sample_s = step_s * steps_per_sample
    command = np.concatenate(
        [t.sample(np.arange(0.0, t.duration_s, sample_s)).velocity_rad_s for t in trajectories]
    )
    rows = []
    for target in command:
        # The profile is followed within a sample, too: steps would be aliased into the torque.
        plant.rise_rad_s2 = abs(float(target) - plant.target_rad_s) / sample_s + 1e-6
        plant.fall_rad_s2 = plant.rise_rad_s2
        plant.target_rad_s = float(target)
        rows.append((plant.torque_nm, plant.counts, plant.velocity_measured_rad_s, target))
        plant.advance(steps_per_sample)
    torque, counts, velocity, asked = np.array(rows, dtype=np.float64).T
    rng = np.random.default_rng(seed)
    columns: dict[str, NDArray[np.generic]] = {
        "time_s": np.arange(torque.size) * sample_s,
        "torque_nm": torque + _noise(rng, torque.size, noise_nm, noise_memory),
        "velocity_rad_s": velocity,
        "velocity_command_rad_s": asked,
    }
    if with_position:
        columns["position_rad"] = counts * 2.0 * np.pi / (COUNTS)
    return Signals.from_columns(columns, joint.gear_ratio, name=name)


def _noise(
    rng: np.random.Generator, count: int, sigma: float, memory: float
) -> NDArray[np.float64]:
    """Return noise of standard deviation `sigma`, white or first-order coloured."""
    from scipy.signal import lfilter

    white = rng.standard_normal(count) * sigma * np.sqrt(1.0 - memory**2)
    return np.asarray(lfilter([1.0], [1.0, -memory], white), dtype=np.float64)


def three_mass_recording(seed: int = 0, noise_nm: float = 0.01) -> tuple[dict[str, float], Signals]:
    """Return truth and recording of motor, gear and arm; the motion is prescribed.

    The springs' torque is integrated by scipy as a linear system of its own.
    """
    from scipy.signal import lsim

    truth = {
        "motor_inertia_kg_m2": 0.0084,
        "gear_inertia_kg_m2": 0.003,
        "gear_spring_nm_per_rad": 60.0,
        "gear_damper_nm_s_per_rad": 0.05,
        "arm_inertia_kg_m2": 0.008,
        "arm_spring_nm_per_rad": 30.0,
        "arm_damper_nm_s_per_rad": 0.03,
        "coulomb_nm": 0.6,
        "viscous_nm_s_per_rad": 0.0107,
    }
    wave = triangle(
        0.0,
        peak_velocity_rad_s=50.0,
        acceleration_rad_s2=200.0,
        jerk_rad_s3=40_000.0,
        periods=10,
    )
    points = wave.sample(np.arange(0.0, wave.duration_s, 0.0005))
    jg, kg, dg = (truth[f"gear_{x}"] for x in _LINK)
    ja, ka, da = (truth[f"arm_{x}"] for x in _LINK)
    # Twists e1 = motor - gear, e2 = gear - arm, and their rates; input: motor acceleration.
    a = np.array(
        [
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [-kg / jg, ka / jg, -dg / jg, da / jg],
            [kg / jg, -ka / jg - ka / ja, dg / jg, -da / jg - da / ja],
        ]
    )
    b = np.array([[0.0], [0.0], [1.0], [0.0]])
    c = np.array([[kg, 0.0, dg, 0.0]])
    _, spring_nm, _ = lsim((a, b, c, [[0.0]]), points.acceleration_rad_s2, points.time_s)
    friction = truth["coulomb_nm"] * np.sign(points.velocity_rad_s)
    friction += truth["viscous_nm_s_per_rad"] * points.velocity_rad_s
    torque = truth["motor_inertia_kg_m2"] * points.acceleration_rad_s2 + spring_nm + friction
    rng = np.random.default_rng(seed)
    columns: dict[str, NDArray[np.generic]] = {
        "time_s": points.time_s,
        "torque_nm": torque + noise_nm * rng.standard_normal(torque.size),
        "position_rad": points.position_rad,
    }
    return truth, Signals.from_columns(columns, 224.0, name="three masses")


_LINK = ("inertia_kg_m2", "spring_nm_per_rad", "damper_nm_s_per_rad")
