"""A chain of masses under a velocity drive, integrated apart from everything of ours, compiled.

The fake joint takes its damper a step late, which is 0.01 % of its spring at a quarter of its step:
as much as an interval is wide. Statistics need a plant whose error is far below that, cubic springs
and a third mass; and 500 cycles must not take an hour. This one is of second order at 20 us.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from agent.identify.signals.arrays import Signals
from trajectories import Trajectory

Floats = NDArray[np.float64]

CONTROL_S = 0.00025
STEP_S = 0.00002083333333333333  # twelve in a period of the controller
SAMPLE_S = 0.001
DEFAULT_COUNTS = 1 << 16
NOISE_NM = 0.02
CURRENT_LAG_S = 0.001
DELAY_S = CONTROL_S**2 / (12.0 * CURRENT_LAG_S)
"""The torque is reported at its kinks, where the controller steps: there the lag of a held command
is behind its average by this much."""


TWO = {
    "motor_inertia_kg_m2": 0.0084,
    "arm_inertia_kg_m2": 0.0100,
    "spring_nm_per_rad": 25.3,
    "damper_nm_s_per_rad": 0.04,
    "coulomb_nm": 0.6042,
    "viscous_nm_s_per_rad": 0.0107,
}
STRIBECK = {"static_extra_nm": 0.15, "stribeck_velocity_rad_s": 6.0, "exponent": 1.3}
THREE = {
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


@dataclass(frozen=True)
class Robot:
    """The truth, by the names of the estimator; two masses, or three where there is a gear's."""

    values: dict[str, float] = field(default_factory=lambda: dict(TWO))
    gear_ratio: float = 224.0

    def with_(self, **values: float) -> Robot:
        """Return the robot with some values replaced or added."""
        return replace(self, values={**self.values, **values})

    @property
    def masses(self) -> Floats:
        """Return motor, gear (where it is there) and arm."""
        names = ("motor_inertia_kg_m2", "gear_inertia_kg_m2", "arm_inertia_kg_m2")
        return np.array([self.values[n] for n in names if n in self.values])

    def links(self, kind: str) -> Floats:
        """Return springs (`spring_nm_per_rad`) or dampers, from the motor outward."""
        prefixes = ("gear_", "arm_") if self.masses.size == 3 else ("",)
        return np.array([self.values[f"{p}{kind}"] for p in prefixes])

    @property
    def truth(self) -> dict[str, float]:
        """Return what an estimator may find, the undamped frequencies included."""
        springs, masses = self.links("spring_nm_per_rad"), self.masses
        stiffness = np.zeros((masses.size, masses.size))
        for i, k in enumerate(springs):
            stiffness[i : i + 2, i : i + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
        free = np.sort(np.linalg.eigvals(stiffness / masses[:, np.newaxis]).real)[1:]
        held = np.sort(np.linalg.eigvals(stiffness[1:, 1:] / masses[1:, np.newaxis]).real)
        out = {**self.values, "torque_offset_nm": 0.0, "torque_delay_s": DELAY_S}
        for i in range(springs.size):
            number = f"_{i + 1}" if springs.size > 1 else ""
            out[f"antiresonance{number}_hz"] = math.sqrt(held[i]) / (2.0 * math.pi)
            out[f"resonance{number}_hz"] = math.sqrt(free[i]) / (2.0 * math.pi)
        return out


@dataclass(frozen=True)
class Run:
    """What happened, without measuring noise: arrays of shape (n,), every `SAMPLE_S`."""

    time_s: Floats
    torque_nm: Floats
    position_rad: Floats
    command_rad_s: Floats
    twist_rad: Floats
    gear_ratio: float

    def measured(
        self,
        seed: int,
        noise_nm: float = NOISE_NM,
        counts: int = DEFAULT_COUNTS,
        noise: Floats | None = None,
    ) -> Signals:
        """Return a recording: torque with white noise (or `noise`), position in counts."""
        rng = np.random.default_rng(seed)
        added = noise_nm * rng.standard_normal(self.time_s.size) if noise is None else noise
        columns: dict[str, NDArray[np.generic]] = {
            "time_s": self.time_s,
            "torque_nm": self.torque_nm + added,
            "position_rad": np.floor(self.position_rad * counts / (2.0 * np.pi))
            * (2.0 * np.pi / counts),
            "velocity_command_rad_s": self.command_rad_s,
        }
        return Signals.from_columns(columns, self.gear_ratio, name=f"seed {seed}")


def run(
    *trajectories: Trajectory,
    robot: Robot | None = None,
    counts: int = DEFAULT_COUNTS,
    start_rad: float = 0.0,
) -> Run:
    """Drive trajectories one after the other; `counts` is what the drive's own loop sees."""
    robot = robot or Robot()
    times = [np.arange(0.0, t.duration_s, CONTROL_S) for t in trajectories]
    command = np.concatenate(
        [t.sample(s).velocity_rad_s for t, s in zip(trajectories, times, strict=True)]
    )
    masses, springs = robot.masses, robot.links("spring_nm_per_rad")
    dampers = np.zeros((masses.size, masses.size))
    for i, d in enumerate(robot.links("damper_nm_s_per_rad")):
        dampers[i : i + 2, i : i + 2] += d * np.array([[1.0, -1.0], [-1.0, 1.0]])
    dampers[0, 0] += robot.values.get("viscous_nm_s_per_rad", 0.0)
    dampers[-1, -1] += robot.values.get("arm_viscous_nm_s_per_rad", 0.0)
    # The implicit midpoint of damping: (M + hD/2) v1 = (M - hD/2) v0 + h force.
    left = np.linalg.inv(np.diag(masses) + 0.5 * STEP_S * dampers)
    keep = left @ (np.diag(masses) - 0.5 * STEP_S * dampers)
    value = robot.values.get
    friction = np.array(
        [
            value("coulomb_nm", 0.0),
            value("static_extra_nm", 0.0),
            value("stribeck_velocity_rad_s", 1.0),
            value("exponent", 1.0),
            value("arm_coulomb_nm", 0.0),
        ]
    )
    stride = round(SAMPLE_S / CONTROL_S)
    out = np.empty((3, command.size))
    _compiled()(
        command,
        np.ascontiguousarray(keep),
        np.ascontiguousarray(STEP_S * left),
        springs,
        value("cubic_spring_nm_per_rad3", 0.0),
        friction,
        np.array([value("gravity_sin_nm", 0.0), robot.gear_ratio]),
        counts / (2.0 * math.pi),
        start_rad,
        out,
    )
    torque, position, twist = out[:, ::stride]
    time_s = np.arange(torque.size) * SAMPLE_S
    return Run(time_s, torque, position, command[::stride], twist, robot.gear_ratio)


def _integrate(
    command: Floats,
    keep: Floats,
    push: Floats,
    springs: Floats,
    cubic: float,
    friction: Floats,
    gravity: Floats,
    counts_per_rad: float,
    start_rad: float,
    out: Floats,
) -> None:
    """Half a drift, a kick with dry friction as a soft threshold, half a drift."""
    gain, integral_time_s, current_lag_s, filter_s = 0.6, 0.08, 0.001, 0.002
    control_s = 0.00025
    steps = 12
    step_s = control_s / steps
    n = keep.shape[0]
    x, v = np.full(n, start_rad), np.zeros(n)
    force, fresh = np.zeros(n), np.zeros(n)
    measured = integral = torque = 0.0
    counts = math.floor(start_rad * counts_per_rad)
    share = 1.0 - math.exp(-step_s / current_lag_s)
    smooth = 1.0 - math.exp(-control_s / filter_s)
    for k in range(command.shape[0]):
        before = counts
        counts = math.floor(x[0] * counts_per_rad)
        measured += smooth * ((counts - before) / (counts_per_rad * control_s) - measured)
        error = command[k] - measured
        integral += gain * control_s / integral_time_s * error
        asked = gain * error + integral
        out[0, k], out[1, k], out[2, k] = torque, x[0], x[0] - x[1]
        for _ in range(steps):
            ahead = torque + share * (asked - torque)
            for i in range(n):
                x[i] += 0.5 * step_s * v[i]
                force[i] = 0.0
            bend = cubic * (x[0] - x[1]) ** 3
            force[0] = 0.5 * (torque + ahead) - bend
            force[1] += bend
            torque = ahead
            for i in range(n - 1):
                twist = x[i] - x[i + 1]
                pull = springs[i] * twist
                force[i] -= pull
                force[i + 1] += pull
            if gravity[0] != 0.0:
                force[n - 1] -= gravity[0] * math.sin(x[n - 1] / gravity[1])
            for i in range(n):
                fresh[i] = 0.0
                for j in range(n):
                    fresh[i] += keep[i, j] * v[j] + push[i, j] * force[j]
            level = friction[0]
            if friction[1] > 0.0:
                speed = 0.5 * abs(v[0] + fresh[0])
                level += friction[1] * math.exp(-((speed / friction[2]) ** friction[3]))
            v[:] = fresh
            for j, limit in ((0, level), (n - 1, friction[4])):
                hold = min(max(v[j] / push[j, j], -limit), limit)
                for i in range(n):
                    v[i] -= push[i, j] * hold
            for i in range(n):
                x[i] += 0.5 * step_s * v[i]


@cache
def _compiled() -> Callable[..., None]:
    numba = importlib.import_module("numba")
    compiled = numba.njit(cache=True)(_integrate)

    def integrate(*arguments: object) -> None:
        compiled(*arguments)

    return integrate
