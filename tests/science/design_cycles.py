"""Simulated cycles for experiment design: a rigid joint driven through any trajectory.

Written apart from the product's laws: the motion is the trajectory's own, the torque is what
Newton asks for it, plus white noise and noise that a first-order filter has coloured.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.identify.estimate import estimate
from agent.identify.signals.arrays import Signals
from agent.physics.friction import STRIBECK
from agent.physics.sensitivity import sensitivity
from trajectories import (
    AxisLimits,
    Belief,
    DesignedStair,
    DesignRequest,
    TorqueNoise,
    Trajectory,
    design_stair,
    spaced_speeds,
    stair_between,
    stair_paired,
)

Floats = NDArray[np.float64]

GEAR = 224.0
RATE_HZ = 250.0
WHITE_NM, COLOURED_NM, CORRELATION_S = 0.02, 0.02, 0.02
STROKE_RAD = math.radians(50.0) * GEAR
ACCELERATION_RAD_S2, JERK_RAD_S3 = 300.0, 10_000.0
LIMITS = AxisLimits(
    math.radians(-80.0) * GEAR, math.radians(80.0) * GEAR, 200.0, 600.0, 30_000.0, 9.8, 500.0, 0.17
)
BODY = ("inertia_kg_m2", "gravity_sin_nm", "gravity_cos_nm", "torque_offset_nm")
LAW = ("coulomb_nm", "viscous_nm_s_per_rad", "static_extra_nm", "stribeck_velocity_rad_s")


@dataclass(frozen=True)
class Truth:
    """The simulated joint, motor side; names as everywhere."""

    inertia_kg_m2: float = 0.0184
    gravity_sin_nm: float = 0.30
    gravity_cos_nm: float = 0.20
    torque_offset_nm: float = 0.02
    coulomb_nm: float = 0.6042
    viscous_nm_s_per_rad: float = 0.0107
    static_extra_nm: float = 0.15
    stribeck_velocity_rad_s: float = 6.0
    exponent: float = 1.3

    def friction_nm(self, velocity_rad_s: Floats) -> Floats:
        speed = np.abs(velocity_rad_s)
        shape = np.exp(-np.power(speed / self.stribeck_velocity_rad_s, self.exponent))
        level = self.coulomb_nm + self.static_extra_nm * shape
        return np.asarray(
            np.sign(velocity_rad_s) * level + self.viscous_nm_s_per_rad * velocity_rad_s
        )


def cycle(trajectory: Trajectory, truth: Truth, seed: int) -> Signals:
    """One recording of one run."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, trajectory.duration_s, 1.0 / RATE_HZ)
    motion = trajectory.sample(time_s)
    arm = motion.position_rad / GEAR
    torque = truth.inertia_kg_m2 * motion.acceleration_rad_s2
    torque += truth.friction_nm(motion.velocity_rad_s) + truth.torque_offset_nm
    torque += truth.gravity_sin_nm * np.sin(arm) + truth.gravity_cos_nm * np.cos(arm)
    memory = math.exp(-1.0 / (RATE_HZ * CORRELATION_S))
    drive = rng.standard_normal(time_s.size)
    drive[1:] *= math.sqrt(1.0 - memory**2)
    torque += COLOURED_NM * np.asarray(lfilter([1.0], [1.0, -memory], drive))
    torque += WHITE_NM * rng.standard_normal(time_s.size)
    columns: Mapping[str, NDArray[np.generic]] = {
        "time_s": time_s,
        "torque_nm": torque,
        "position_rad": motion.position_rad,
        "velocity_rad_s": motion.velocity_rad_s + 0.01 * rng.standard_normal(time_s.size),
    }
    return Signals.from_columns(columns, GEAR, name=f"cycle {seed}")


def found(trajectory: Trajectory, truth: Truth, seed: int) -> dict[str, float]:
    """What `estimate` finds in one cycle; NaN where it does not identify a parameter."""
    result = estimate([cycle(trajectory, truth, seed)])
    out = dict.fromkeys((*LAW, "exponent", *BODY, "level_nm"), math.nan)
    law = next((m for m in result.friction_models if m.model == "stribeck"), None)
    if law is not None:
        out |= {k: p.value for k, p in law.parameters.items() if p.identified}
    if result.rigid_body is not None:
        body = result.rigid_body.parameters
        out |= {k: body[k].value for k in BODY if body[k].identified}
    if result.friction_curve is not None:
        out["level_nm"] = float(np.mean(result.friction_curve.friction_nm))
    return out


def belief(truth: Truth | None = None) -> Belief:
    """The truth as the nominal joint, and a prior over a factor of two about it."""
    truth = truth or Truth()
    law: dict[str, float] = {name: getattr(truth, name) for name in STRIBECK.parameters}
    prior: list[dict[str, Any]] = [law]
    prior += [
        {**law, "stribeck_velocity_rad_s": factor * truth.stribeck_velocity_rad_s, "exponent": d}
        for factor in (0.5, 1.0, 2.0)
        for d in (1.0, 1.8)
    ]
    return Belief(
        STRIBECK.parameters,
        tuple(law[name] for name in STRIBECK.parameters),
        tuple(sensitivity(STRIBECK, member) for member in prior),
        truth.inertia_kg_m2,
        truth.coulomb_nm,
        GEAR,
    )


def noise() -> TorqueNoise:
    return TorqueNoise(WHITE_NM, COLOURED_NM, CORRELATION_S, RATE_HZ)


def request(seconds: float, **changes: Any) -> DesignRequest:
    """The very stroke, speeds and ramps that the thesis's stairs have."""
    asked: dict[str, Any] = {
        "from_rad": -STROKE_RAD,
        "to_rad": STROKE_RAD,
        "duration_s": seconds,
        "speed_min_rad_s": 2.0,
        "speed_max_rad_s": 160.0,
        "acceleration_rad_s2": ACCELERATION_RAD_S2,
        "jerk_rad_s3": JERK_RAD_S3,
        "limits": LIMITS,
        "belief": belief(),
        "noise": noise(),
    }
    return DesignRequest(**(asked | changes))


@functools.cache
def designed(seconds: float) -> DesignedStair:
    return design_stair(request(seconds))


def thesis_stair() -> Trajectory:
    """Section 4.1.1: 40 s from -50 to 50 degrees and back, 20 steady velocities."""
    return stair_between(
        -STROKE_RAD,
        STROKE_RAD,
        duration_s=40.0,
        acceleration_rad_s2=ACCELERATION_RAD_S2,
        jerk_rad_s3=JERK_RAD_S3,
    )


def thesis_paired() -> Trajectory:
    """Section 4.4.1: 22 velocities, to and fro over one window; spaced as the example cell does."""
    return stair_paired(
        -STROKE_RAD,
        STROKE_RAD,
        speeds_rad_s=spaced_speeds(2.0, 160.0, 11),
        duration_s=40.0,
        acceleration_rad_s2=ACCELERATION_RAD_S2,
        jerk_rad_s3=JERK_RAD_S3,
    )
