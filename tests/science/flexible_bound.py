"""The least standard errors that a recording of a flexible joint allows (Cramer and Rao).

An error of the position is one of the torque that the motion needs: the noise is coloured,
``S(w) = s_torque^2 + |F(w)|^2 s_position^2`` with ``F = s^2 (Jm + M(s)) + fv s`` and the steps of
the encoder as white noise of variance ``step^2/12``. Every moving sample counts, reversals too;
offset and delay are unknown. The chain behind the motor's prescribed motion is integrated, and its
torque differenced by every parameter.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from tests.science.flexible_chain import NOISE_NM, SAMPLE_S, Floats, Robot, Run

_MOVING_RAD_S = 0.5
_STEP = 1e-4  # relative
_FINER = 4  # steps of the integration a sample


def bound(recorded: Run, robot: Robot, counts: int) -> dict[str, float]:
    """Return the bound of every parameter's standard error, the undamped frequencies' included.

    Parameters
    ----------
    recorded : Run
        The robot's motion.
    robot : Robot
        Two masses, with or without a cubic spring, or three.
    counts : int
        Of the encoder that is recorded, a turn.
    """
    truth, position = robot.truth, recorded.position_rad - recorded.position_rad[0]
    names = [*robot.values, "torque_offset_nm", "torque_delay_s"]
    speed = np.gradient(position, SAMPLE_S)
    moving = np.abs(speed) > _MOVING_RAD_S

    def torque(name: str, step: float) -> Floats:
        values = truth | {name: truth[name] + step}
        acceleration = np.gradient(speed, SAMPLE_S)
        moved = values["motor_inertia_kg_m2"] * acceleration + _shaft(values, robot, acceleration)
        moved += values["coulomb_nm"] * np.sign(speed) + values["viscous_nm_s_per_rad"] * speed
        late = values["torque_delay_s"] * np.gradient(moved, SAMPLE_S)
        return np.asarray(moved - late + values["torque_offset_nm"], dtype=np.float64)

    columns = []
    for name in names:
        step = _STEP * (abs(truth[name]) or 1.0)
        change = torque(name, step) - torque(name, -step)
        columns.append(np.where(moving, change, 0.0) / (2.0 * step))
    lines = np.fft.fft(np.stack(columns, axis=-1), axis=0, norm="ortho")
    jacobian = lines / np.sqrt(_noise_power(robot, position.size, counts))[:, np.newaxis]
    size = np.linalg.norm(jacobian, axis=0)
    inverse = np.linalg.inv(((jacobian / size).conj().T @ (jacobian / size)).real)
    covariance = inverse / np.outer(size, size)
    errors = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    return errors | _of_frequencies(robot, covariance)


def _of_frequencies(robot: Robot, covariance: Floats) -> dict[str, float]:
    """Return the bounds of the undamped frequencies, which follow from the parameters."""
    out = {}
    for name in (n for n in robot.truth if n.endswith("_hz")):
        gradient = np.zeros(covariance.shape[0])
        for j, (parameter, value) in enumerate(robot.values.items()):
            ahead, behind = (
                robot.with_(**{parameter: value * (1.0 + s)}).truth[name] for s in (_STEP, -_STEP)
            )
            gradient[j] = (ahead - behind) / (2.0 * _STEP * value)
        out[name] = math.sqrt(float(gradient @ covariance @ gradient))
    return out


def _shaft(values: dict[str, float], robot: Robot, acceleration_rad_s2: Floats) -> Floats:
    """Return the torque with which the motor carries the chain, shape (n,)."""
    now = Robot({name: values[name] for name in robot.values})
    return _carried()(
        acceleration_rad_s2,
        now.masses[1:],
        now.links("spring_nm_per_rad"),
        now.links("damper_nm_s_per_rad"),
        values.get("cubic_spring_nm_per_rad3", 0.0),
    )


def _noise_power(robot: Robot, samples: int, counts: int) -> Floats:
    """Return the power of the noise in the torque balance at every line, (N m)^2."""
    s = 2j * np.pi * np.abs(np.fft.fftfreq(samples, SAMPLE_S))
    carried: NDArray[np.complex128] = np.zeros_like(s)
    chain = zip(
        robot.masses[1:],
        robot.links("spring_nm_per_rad"),
        robot.links("damper_nm_s_per_rad"),
        strict=True,
    )
    for j, k, d in reversed(list(chain)):
        carried = (j + carried) * (d * s + k) / ((j + carried) * s * s + d * s + k)
    stiffness = s * s * (robot.masses[0] + carried) + robot.values["viscous_nm_s_per_rad"] * s
    step = 2.0 * math.pi / counts / math.sqrt(12.0)
    return np.asarray(NOISE_NM**2 + np.abs(stiffness * step) ** 2, dtype=np.float64)


def _integrate(
    acceleration: Floats, masses: Floats, springs: Floats, dampers: Floats, cubic: float
) -> Floats:
    """Runge and Kutta's method on twists and their rates; acceleration straight between samples."""
    n, h = masses.shape[0], SAMPLE_S / _FINER
    state, slope = np.zeros(2 * n), np.zeros((5, 2 * n))
    pull, out = np.zeros(n + 1), np.zeros(acceleration.shape[0])
    for t in range(acceleration.shape[0]):
        out[t] = springs[0] * state[0] + cubic * state[0] ** 3 + dampers[0] * state[n]
        rise = acceleration[min(t + 1, acceleration.shape[0] - 1)] - acceleration[t]
        for part in range(_FINER):
            for r in range(4):
                share = (0.0, 0.5, 0.5, 1.0)[r]
                at = state + share * h * slope[r]
                for i in range(n):
                    pull[i] = springs[i] * at[i] + dampers[i] * at[n + i]
                pull[0] += cubic * at[0] ** 3
                carrier = acceleration[t] + rise * (part + share) / _FINER
                for i in range(n):
                    own = (pull[i] - pull[i + 1]) / masses[i]
                    slope[r + 1, i], slope[r + 1, n + i] = at[n + i], carrier - own
                    carrier = own
            state = state + h / 6.0 * (slope[1] + 2.0 * slope[2] + 2.0 * slope[3] + slope[4])
    return out


@cache
def _carried() -> Callable[..., Floats]:
    numba = importlib.import_module("numba")
    compiled = numba.njit(cache=True)(_integrate)

    def carried(*arguments: object) -> Floats:
        return np.asarray(compiled(*arguments), dtype=np.float64)

    return carried
