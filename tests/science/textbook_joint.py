"""A joint as a textbook simulates it: a prescribed motion, and the torque that it takes, exactly.

Stairs whose ramps have one acceleration, from standstill to standstill. Acceleration and torque
jump at the ramps' ends, and a sample there is from one side or the other, as rounding has it.
"""

from __future__ import annotations

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
_REST_S, _HOLD_S = 0.25, 1.5


@dataclass(frozen=True)
class Driven:
    """Time, s, motor angle, rad, and its derivatives; all shape (n,)."""

    time_s: Floats
    position_rad: Floats
    velocity_rad_s: Floats
    acceleration_rad_s2: Floats


Extra = Callable[[Driven], Floats]


def stair(
    speeds_rad_s: Sequence[float], acceleration_rad_s2: float = 400.0, rate_hz: float = 500.0
) -> Driven:
    """Return passes there and back at each speed."""
    begins, rises = [0.0], [0.0]
    for speed in speeds_rad_s:
        for way in (1.0, -1.0):
            ramp_s = speed / acceleration_rad_s2
            for lasts, level in (
                (ramp_s, way * acceleration_rad_s2),
                (_HOLD_S, 0.0),
                (ramp_s, -way * acceleration_rad_s2),
                (_REST_S, 0.0),
            ):
                begins.append(begins[-1] + lasts)
                rises.append(level)
    ends, level = np.array(begins), np.array([*rises[1:], 0.0])
    time = np.arange(round(begins[-1] * rate_hz)) / rate_hz
    speed = np.concatenate(([0.0], np.cumsum(level[:-1] * np.diff(ends))))
    angle = np.concatenate(
        ([0.0], np.cumsum(speed[:-1] * np.diff(ends) + 0.5 * level[:-1] * np.diff(ends) ** 2))
    )
    own = np.searchsorted(ends, time, side="right") - 1
    since = time - ends[own]
    velocity = speed[own] + level[own] * since
    velocity[np.abs(velocity) < 1e-9] = 0.0
    return Driven(
        time, angle[own] + speed[own] * since + 0.5 * level[own] * since**2, velocity, level[own]
    )


def nothing(driven: Driven) -> Floats:
    """Return no torque beside the twin's."""
    return np.zeros_like(driven.time_s)


def recorded(driven: Driven, extra: Extra, noise_nm: float, seed: int, twin: Twin = TWIN) -> Run:
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
    )
