"""A joint as a textbook simulates it: a prescribed motion, and the torque that it takes, exactly.

Stairs whose ramps have one acceleration, from standstill to standstill. Acceleration and torque
jump at the ramps' ends, and a sample there is from one side or the other, as rounding has it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.physics.twin import Twin

TWIN = Twin(
    robot="textbook",
    axis=1,
    gear_ratio=50.0,
    inertia_kg_m2=0.002,
    coulomb_nm=0.35,
    viscous_nm_s_per_rad=0.006,
    gravity_sin_nm=0.9,
    gravity_cos_nm=-0.2,
)
_REST_S, _HOLD_S, _STILL_RAD_S = 0.25, 1.5, 1e-9


@dataclass(frozen=True)
class Driven:
    """Time, s, motor angle, rad, and its derivatives; all shape (n,)."""

    time_s: Floats
    position_rad: Floats
    velocity_rad_s: Floats
    acceleration_rad_s2: Floats


Extra = Callable[[Driven], Floats]


def stair(
    speeds_rad_s: Sequence[float],
    *,
    ways: Sequence[float] = (1.0, -1.0),
    acceleration_rad_s2: float = 400.0,
    rate_hz: float = 500.0,
) -> Driven:
    """Return passes at each speed, there and back or one way alone."""
    parts: list[tuple[float, float]] = []  # how long, and at which acceleration
    for speed in speeds_rad_s:
        for way in ways:
            ramp = speed / acceleration_rad_s2, way * acceleration_rad_s2
            parts += [ramp, (_HOLD_S, 0.0), (ramp[0], -ramp[1]), (_REST_S, 0.0)]
    return _ramped(parts, rate_hz)


def steps(
    speeds_rad_s: Sequence[float], *, acceleration_rad_s2: float = 400.0, rate_hz: float = 500.0
) -> Driven:
    """Return passes from one speed to the next without a rest, standstill at either end."""
    parts, before = [(_REST_S, 0.0)], 0.0
    for speed in (*speeds_rad_s, 0.0):
        way = math.copysign(acceleration_rad_s2, speed - before)
        parts += [(abs(speed - before) / acceleration_rad_s2, way), (_HOLD_S, 0.0)]
        before = speed
    return _ramped(parts, rate_hz)


def _ramped(parts: Sequence[tuple[float, float]], rate_hz: float) -> Driven:
    """Return a motion of pieces: how long, and at which acceleration."""
    lasts, level = (np.array(each) for each in zip(*parts, strict=True))
    begins = np.cumsum(lasts) - lasts
    speed_at = np.cumsum(level * lasts) - level * lasts
    travelled = speed_at * lasts + 0.5 * level * lasts**2
    angle_at = np.cumsum(travelled) - travelled
    time = np.arange(round(float(lasts.sum()) * rate_hz)) / rate_hz
    own = np.searchsorted(begins, time, side="right") - 1
    since = time - begins[own]
    velocity = speed_at[own] + level[own] * since
    velocity[np.abs(velocity) < _STILL_RAD_S] = 0.0
    angle = angle_at[own] + speed_at[own] * since + 0.5 * level[own] * since**2
    return Driven(time, angle, velocity, level[own])


def waves(seed: int, duration_s: float = 30.0, rate_hz: float = 500.0) -> Driven:
    """Return a sum of seven sines from 0.1 Hz on: no speed is held."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration_s * rate_hz)) / rate_hz
    angle, velocity, acceleration = np.zeros((3, time.shape[0]))
    for order in range(1, 8):
        w, phase = 0.2 * math.pi * order, rng.uniform(0.0, 2.0 * math.pi)
        size = 30.0 / order**2 * rng.uniform(0.5, 1.0)
        angle += size * np.sin(w * time + phase)
        velocity += size * w * np.cos(w * time + phase)
        acceleration -= size * w**2 * np.sin(w * time + phase)
    return Driven(time, angle, velocity, acceleration)


def nothing(driven: Driven) -> Floats:
    """Return no torque beside the twin's."""
    return np.zeros_like(driven.time_s)


def yielding(driven: Driven, reach_rad: float = 0.5) -> Floats:
    """Return what Dahl's friction is beside Coulomb's; its springs are relaxed at first."""
    drawn, level = 0.0, np.empty_like(driven.time_s)
    for sample, moved in enumerate(np.diff(driven.position_rad, prepend=driven.position_rad[0])):
        slips = np.sign(moved)
        drawn = slips + (drawn - slips) * np.exp(-abs(moved) / reach_rad) if moved else drawn
        level[sample] = drawn
    return np.asarray(TWIN.coulomb_nm * (level - np.sign(driven.velocity_rad_s)))


def recorded(
    driven: Driven,
    extra: Extra,
    noise_nm: float,
    seed: int,
    twin: Twin = TWIN,
    started_s: float = math.nan,
) -> Run:
    """Return what a logger has of it, the torque with white noise."""
    angle = driven.position_rad / twin.gear_ratio
    torque = (
        twin.inertia_kg_m2 * driven.acceleration_rad_s2
        + twin.viscous_nm_s_per_rad * driven.velocity_rad_s
        + twin.coulomb_nm * np.sign(driven.velocity_rad_s)
        + twin.gravity_sin_nm * np.sin(angle)
        + twin.gravity_cos_nm * np.cos(angle)
        + extra(driven)
    )
    rng = np.random.default_rng(seed)
    return Run.from_columns(
        {
            "time_s": driven.time_s,
            "torque_nm": torque + noise_nm * rng.standard_normal(torque.shape[0]),
            "position_rad": driven.position_rad,
            "velocity_rad_s": driven.velocity_rad_s,
        },
        twin.gear_ratio,
        name=f"run-{seed}",
        started_s=started_s,
    )
