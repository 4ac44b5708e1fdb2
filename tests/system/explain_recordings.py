"""Recordings of a joint for tests of `stribeck explain`: a stair with ramps, written with NumPy."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from agent.record.recording import Metadata, Recording
from agent.record.writing import write

Floats = NDArray[np.float64]

RATE_HZ = 250.0
GEAR = 100.0
INERTIA, COULOMB, VISCOUS, GRAVITY_SIN = 0.008, 0.5, 0.006, 0.3
NOISE_NM = 0.01
SPEEDS = (0.7, 1.5, 3.0, 6.0, 12.0, 24.0, 45.0)
PLAIN = f"""schema = "stribeck.twin/1"
robot = "cell7"
axis = 1
gear_ratio = {GEAR}

[rigid_body]
inertia_kg_m2 = {INERTIA}
gravity_sin_nm = {GRAVITY_SIN}
gravity_cos_nm = 0.0

[friction]
coulomb_nm = {COULOMB}
viscous_nm_s_per_rad = {VISCOUS}
"""


@dataclass(frozen=True)
class Joint:
    """What the joint has beyond the plain twin, and how it was recorded."""

    stribeck_nm: float = 0.0
    inertia_factor: float = 1.0
    gear: float = GEAR
    robot: str = "cell7"
    axis: int = 1
    rate_hz: float = RATE_HZ
    moves: bool = True
    hold_s: float = 1.0
    extra: dict[str, Floats] = field(default_factory=dict)


def motion(
    seed: int, rate_hz: float, *, hold_s: float = 1.0, moves: bool = True
) -> tuple[Floats, Floats, Floats]:
    """Return time, velocity and acceleration of a stair there and back, shape (n,)."""
    rng = np.random.default_rng(seed)
    ramp_s = 0.25
    knots_t, knots_v = [0.0], [0.0]
    # Forward in one order and back in another: no speed keeps to one place.
    for level in (*rng.permutation(SPEEDS), *-rng.permutation(SPEEDS)):
        knots_t += [knots_t[-1] + ramp_s, knots_t[-1] + ramp_s + hold_s]
        knots_v += [level, level]
    time_s = np.arange(0.0, knots_t[-1], 1.0 / rate_hz)
    velocity = np.interp(time_s, knots_t, knots_v) * moves
    width = max(3, int(0.06 * rate_hz))
    smooth = np.hanning(width + 2)
    velocity = np.convolve(velocity, smooth / smooth.sum(), mode="same")
    return time_s, velocity, np.gradient(velocity, time_s)


def columns(joint: Joint, seed: int) -> dict[str, Floats]:
    """Return a recording's columns."""
    rng = np.random.default_rng(1000 + seed)
    time_s, velocity, acceleration = motion(
        seed, joint.rate_hz, hold_s=joint.hold_s, moves=joint.moves
    )
    position = 0.4 * joint.gear + np.cumsum(velocity) / joint.rate_hz
    friction = COULOMB + joint.stribeck_nm * np.exp(-((velocity / 5.0) ** 2))
    torque = (
        joint.inertia_factor * INERTIA * acceleration
        + VISCOUS * velocity
        + friction * np.tanh(velocity / 0.05)
        + GRAVITY_SIN * np.sin(position / joint.gear)
    )
    return {
        "time_s": time_s,
        "position_rad": position,
        "velocity_rad_s": velocity + 1e-3 * rng.standard_normal(time_s.shape[0]),
        "torque_nm": torque + NOISE_NM * rng.standard_normal(time_s.shape[0]),
        **joint.extra,
    }


def save(path: Path, joint: Joint, seed: int) -> Path:
    """Write one recording, begun `seed` hours after midnight."""
    about = Metadata(
        joint.robot, joint.axis, joint.gear, started_at=f"2026-03-02T{seed % 24:02d}:00:00Z"
    )
    write(Recording(columns(joint, seed), about, str(path)), path)
    return path


def twin(path: Path, text: str = PLAIN) -> Path:
    """Write a twin."""
    path.write_text(text)
    return path
