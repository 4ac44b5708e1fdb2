"""Robots to conceal something in: drawn from the ranges that industrial joints lie in."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fakes.conceal.truth import Truth

VELOCITY_KINDS = ("measured", "filtered", "difference")


@dataclass(frozen=True)
class Sensing:
    """How the drive and the host see the joint.

    Parameters
    ----------
    sample_rate_hz : float
        Of the recording; a divisor of 8000.
    encoder_counts_per_rev : int
        Position is only reported in these steps.
    velocity : {"measured", "filtered", "difference"}
        From an observer in the drive; through a filter that the torque goes through as well; or
        the difference of two reported positions, with torque averaged over the same sample.
    velocity_noise_rad_s : float
        Standard deviation, from sample to sample.
    white_nm, coloured_nm, coloured_time_s : float
        Torque noise: its white part, and one with a memory of `coloured_time_s`.
    torque_step_nm : float
        Torque is only reported in these steps.
    jitter_s : float
        Standard deviation of the stamps.
    lost_share : float
        Share of samples that never arrive, most of them in short bursts.
    temperature_step_k : float
        Temperatures are only reported in these steps.
    """

    sample_rate_hz: float
    encoder_counts_per_rev: int
    velocity: str
    velocity_noise_rad_s: float
    white_nm: float
    coloured_nm: float
    coloured_time_s: float
    torque_step_nm: float
    jitter_s: float
    lost_share: float
    temperature_step_k: float


@dataclass(frozen=True)
class Robot:
    """A joint without anything concealed, its sensing, and the room it may be driven in.

    Parameters
    ----------
    name : str
        Of the robot.
    truth : Truth
        Joint and drive.
    sensing : Sensing
        What the recording is made through.
    top_rad_s, acceleration_rad_s2, jerk_rad_s3 : float
        Bounds of every motion.
    centre_arm_rad, reach_arm_rad : float
        The stroke: arm angles within ``centre +- reach``.
    floor_nm : float
        About the torque noise; the exact value is measured from the samples.
    """

    name: str
    truth: Truth
    sensing: Sensing
    top_rad_s: float
    acceleration_rad_s2: float
    jerk_rad_s3: float
    centre_arm_rad: float
    reach_arm_rad: float
    floor_nm: float


def draw_robot(rng: np.random.Generator, *, gravity: bool, sample_rate_hz: float) -> Robot:
    """Return a joint drawn from typical ranges.

    Coulomb friction sets the scale. Accelerating takes one to two and a half times as much torque,
    gravity up to twice, viscous friction at top speed about as much; noise is 2.5 to 7 percent of
    it. The arm's locked frequency is 35 to 65 Hz, so that a rigid body suffices for what is
    driven; contacts yield 3 to 8 mrad at the motor before they slip.
    """
    draw = rng.uniform
    coulomb, top = draw(0.2, 0.8), draw(60.0, 140.0)
    acceleration = top / draw(0.4, 0.7)
    inertia = draw(1.0, 2.5) * coulomb / acceleration
    weight, angle = (draw(0.7, 2.0) * coulomb if gravity else 0.0), draw(-0.5, 0.5)
    floor = coulomb * draw(0.025, 0.07)
    truth = _base_truth(
        rng,
        inertia=inertia,
        coulomb=coulomb,
        viscous=draw(0.6, 1.4) * coulomb / top,
        gravity=(weight * math.cos(angle), weight * math.sin(angle)),
    )
    jerk = acceleration / draw(0.12, 0.2)
    room = half_pass_rad(top, acceleration, jerk)
    sensing = _draw_sensing(rng, floor, sample_rate_hz)
    if sensing.velocity == "filtered":
        truth = truth._replace(report_lag_s=draw(0.0005, 0.002))
    return Robot(
        name=f"robot-{int(rng.integers(10_000)):04d}",
        truth=truth,
        sensing=sensing,
        top_rad_s=top,
        acceleration_rad_s2=acceleration,
        jerk_rad_s3=jerk,
        centre_arm_rad=draw(-0.4, 0.4),
        # Gravity tells from an offset on a long stroke only.
        reach_arm_rad=max(draw(1.1, 1.7) if gravity else draw(0.5, 0.9), room / truth.gear_ratio),
        floor_nm=floor,
    )


def half_pass_rad(speed_rad_s: float, acceleration_rad_s2: float, jerk_rad_s3: float) -> float:
    """Return half of what it takes to reach a speed, hold it for a moment, and stop."""
    ramp_s = speed_rad_s / acceleration_rad_s2 + acceleration_rad_s2 / jerk_rad_s3
    return 0.5 * speed_rad_s * (ramp_s + 0.1)


def _base_truth(
    rng: np.random.Generator,
    *,
    inertia: float,
    coulomb: float,
    viscous: float,
    gravity: tuple[float, float],
) -> Truth:
    draw = rng.uniform
    motor = inertia * draw(0.4, 0.6)
    tool = inertia * draw(0.05, 0.15)
    arm = inertia - motor - tool
    locked = 2.0 * math.pi * draw(35.0, 65.0)
    stiffness = (arm + tool) * locked**2
    tool_rate = 2.0 * math.pi * draw(80.0, 110.0)
    bandwidth = 2.0 * math.pi * draw(7.0, 13.0)
    friction_w = coulomb * 40.0
    return Truth(
        gear_ratio=round(draw(80.0, 240.0), 1),
        motor_inertia_kg_m2=motor,
        arm_inertia_kg_m2=arm,
        tool_inertia_kg_m2=tool,
        stiffness_nm_per_rad=stiffness,
        damping_nm_s_per_rad=2.0 * draw(0.06, 0.12) * math.sqrt(stiffness * (arm + tool)),
        tool_stiffness_nm_per_rad=tool * tool_rate**2,
        tool_damping_nm_s_per_rad=2.0 * draw(0.04, 0.1) * tool * tool_rate,
        gravity_sin_nm=gravity[0],
        gravity_cos_nm=gravity[1],
        coulomb_nm=0.7 * coulomb,
        arm_coulomb_nm=0.3 * coulomb,
        viscous_nm_s_per_rad=viscous,
        presliding_rad=draw(0.003, 0.008),
        position_gain_per_s=bandwidth / draw(4.0, 7.0),
        velocity_gain_nm_s_per_rad=inertia * bandwidth,
        integral_per_s=bandwidth / draw(3.0, 6.0),
        feedforward_kg_m2=inertia * draw(0.7, 1.0),
        current_lag_s=draw(0.0005, 0.0015),
        report_lag_s=0.0,
        torque_limit_nm=60.0 * coulomb,
        # Friction of 40 rad/s warms the oil by 0.3 to 2 K in 30 s.
        oil_capacity_j_per_k=friction_w * 30.0 / draw(0.3, 2.0),
        oil_cooling_per_s=draw(0.5e-4, 1.5e-4),
        winding_k_per_nm2_s=draw(0.02, 0.1) / coulomb**2 / 4.0,
        winding_cooling_per_s=1.0 / draw(300.0, 900.0),
        sensor_lag_s=draw(20.0, 120.0),
    )


def _draw_sensing(rng: np.random.Generator, floor_nm: float, sample_rate_hz: float) -> Sensing:
    coloured = rng.uniform(0.15, 0.5)
    velocity = str(rng.choice(VELOCITY_KINDS, p=(0.5, 0.35, 0.15)))
    # Nobody differentiates a coarse encoder at the recording's rate.
    fewest_bits = 16 if velocity == "difference" else 14
    return Sensing(
        sample_rate_hz=sample_rate_hz,
        encoder_counts_per_rev=2 ** int(rng.integers(fewest_bits, 20)),
        velocity=velocity,
        velocity_noise_rad_s=float(10.0 ** rng.uniform(-2.3, -1.5)),
        white_nm=floor_nm * math.sqrt(1.0 - coloured**2),
        coloured_nm=floor_nm * coloured,
        coloured_time_s=rng.uniform(0.005, 0.05),
        torque_step_nm=floor_nm * rng.uniform(0.1, 0.6),
        jitter_s=float(10.0 ** rng.uniform(-6.0, -4.3)),
        lost_share=float(rng.choice((0.0, 10.0 ** rng.uniform(-4.0, -2.5)), p=(0.4, 0.6))),
        temperature_step_k=float(rng.choice((0.1, 0.5, 1.0), p=(0.2, 0.4, 0.4))),
    )
