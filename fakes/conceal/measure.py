"""From what the drive sees to what a recording says: delays, noise, steps, stamps, loss."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fakes.conceal.design import Run
from fakes.conceal.kernel import COLUMNS, STEP_S, STEPS_PER_COMMAND, relaxed, simulate
from fakes.conceal.refit import Motion
from fakes.conceal.robot import Robot, Sensing
from fakes.conceal.truth import Truth

Floats = NDArray[np.float64]
_COMMAND_RATE_HZ = 1.0 / (STEPS_PER_COMMAND * STEP_S)
_ARM_STEP_RAD = 2.0 * math.pi / 2**20  # of an encoder that is put on the arm for an experiment


@dataclass(frozen=True)
class Seen:
    """One run as the drive sees it, before noise, rounding and loss; arrays of shape (n,).

    `torque_nm` has everything in it that the drive makes of torque, but not the noise. `arm_rad` is
    where the arm is, before its gear: on the motor side.
    """

    time_s: Floats
    position_rad: Floats
    velocity_rad_s: Floats
    torque_nm: Floats
    winding_degc: Floats
    oil_degc: Floats
    sensor_degc: Floats
    arm_rad: Floats

    @property
    def motion(self) -> Motion:
        """Return what the structure is fitted to; acceleration is the velocity's difference."""
        return Motion(
            self.position_rad,
            self.velocity_rad_s,
            np.gradient(self.velocity_rad_s, self.time_s),
            self.torque_nm,
        )


def steps_per_sample(sample_rate_hz: float) -> int:
    """Return how many integration steps a sample takes, or refuse a rate that has no whole one."""
    steps = round(1.0 / (sample_rate_hz * STEP_S))
    if not 100.0 <= sample_rate_hz <= 1000.0 or abs(steps * sample_rate_hz * STEP_S - 1.0) > 1e-9:
        raise ValueError(
            f"sample_rate_hz: expected a divisor of {1.0 / STEP_S:g} Hz from 100 to 1000, "
            f"got {sample_rate_hz}"
        )
    return steps


def sample_count(run: Run, sample_rate_hz: float) -> int:
    """Return how many samples a run has."""
    steps = steps_per_sample(sample_rate_hz)
    return _command_count(run) * STEPS_PER_COMMAND // steps


def _command_count(run: Run) -> int:
    return int(run.trajectory.duration_s * _COMMAND_RATE_HZ) + 1


def commands(run: Run) -> Floats:
    """Return position, velocity and acceleration set-points, one a millisecond, shape (m, 3)."""
    points = run.trajectory.sample(np.arange(_command_count(run)) / _COMMAND_RATE_HZ)
    return np.column_stack([points.position_rad, points.velocity_rad_s, points.acceleration_rad_s2])


def see(truth: Truth, robot: Robot, run: Run, command: Floats) -> Seen:
    """Return one run as the drive sees it."""
    sensing = robot.sensing
    rate = sensing.sample_rate_hz
    count = sample_count(run, rate)
    raw = simulate(truth, run.state, command, count, steps_per_sample(rate))
    column = dict(zip(COLUMNS, raw.T, strict=True))
    time = np.arange(count) / rate
    position, velocity, torque = column["position"], column["velocity"], column["torque"]
    if sensing.velocity == "difference":
        velocity = np.diff(position, prepend=position[0]) * rate
        torque = 0.5 * (torque + np.r_[torque[0], torque[:-1]])
    if truth.motion_delay_s != 0.0:
        position = np.interp(time - truth.motion_delay_s, time, position)
        velocity = np.interp(time - truth.motion_delay_s, time, velocity)
    if truth.torque_delay_s != 0.0:
        torque = np.interp(time - truth.torque_delay_s, time, torque)
    warmer = column["winding"] - truth.torque_factor_degc
    torque = torque / (truth.torque_factor * (1.0 + truth.torque_factor_per_k * warmer))
    torque = torque + truth.torque_offset_nm
    if truth.mains_nm != 0.0:
        wave = 2.0 * math.pi * truth.mains_hz * time + truth.mains_phase_rad
        torque = torque + truth.mains_nm * np.sin(wave)
    return Seen(
        time,
        position,
        velocity,
        torque,
        *(column[name] for name in ("winding", "oil", "sensor", "arm")),
    )


@dataclass(frozen=True)
class Noise:
    """The chances of one run, drawn once, so that two truths can be seen through the same ones."""

    torque_nm: Floats
    velocity_rad_s: Floats
    stamp_s: Floats
    kept: NDArray[np.bool_]


def draw_noise(rng: np.random.Generator, sensing: Sensing, count: int) -> Noise:
    """Return noise for `count` samples; torque noise is the sum of a white and a coloured one."""
    white = sensing.white_nm * rng.standard_normal(count)
    keep = math.exp(-1.0 / (sensing.sample_rate_hz * sensing.coloured_time_s))
    drive = math.sqrt(1.0 - keep * keep) * rng.standard_normal(count)
    coloured = relaxed(drive, keep, float(rng.standard_normal()))
    period = 1.0 / sensing.sample_rate_hz
    stamp = np.clip(sensing.jitter_s * rng.standard_normal(count), -0.3 * period, 0.3 * period)
    kept = np.ones(count, dtype=np.bool_)
    for _ in range(rng.poisson(sensing.lost_share * count / 4.0)):
        first = int(rng.integers(1, max(count - 12, 2)))
        kept[first : first + int(rng.integers(1, 8))] = False
    return Noise(
        white + sensing.coloured_nm * coloured,
        sensing.velocity_noise_rad_s * rng.standard_normal(count),
        stamp,
        kept,
    )


def recorded_torque(seen: Seen, sensing: Sensing, noise: Noise) -> Floats:
    """Return torque as reported: noisy, and in the drive's steps, shape (n,)."""
    step = sensing.torque_step_nm
    return np.asarray(np.round((seen.torque_nm + noise.torque_nm) / step) * step)


def columns(
    seen: Seen, robot: Robot, run: Run, noise: Noise
) -> tuple[Mapping[str, NDArray[np.float64] | NDArray[np.str_]], int]:
    """Return a recording's columns (contract section 2), and how many samples were lost."""
    sensing = robot.sensing
    count = 2.0 * math.pi / sensing.encoder_counts_per_rev
    position = np.floor(seen.position_rad / count) * count
    if sensing.velocity == "difference":
        velocity = np.diff(position, prepend=position[0]) * sensing.sample_rate_hz
    else:
        velocity = seen.velocity_rad_s + noise.velocity_rad_s
    points = run.trajectory.sample(seen.time_s)
    degc = sensing.temperature_step_k
    every = {
        "time_s": seen.time_s + noise.stamp_s - noise.stamp_s[0],
        "position_rad": position,
        "velocity_rad_s": velocity,
        "torque_nm": recorded_torque(seen, sensing, noise),
        "gearbox_temperature_degc": np.round(seen.sensor_degc / degc) * degc,
        "motor_temperature_degc": np.round(seen.winding_degc),
        "velocity_command_rad_s": points.velocity_rad_s,
        "position_command_rad": points.position_rad,
        "phase": points.phase,
    }
    if run.arm_encoder:
        arm = seen.arm_rad / robot.truth.gear_ratio
        every["position_arm_rad"] = np.floor(arm / _ARM_STEP_RAD) * _ARM_STEP_RAD
    return {name: values[noise.kept] for name, values in every.items()}, int(np.sum(~noise.kept))
