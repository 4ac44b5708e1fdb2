"""The least error of a gear's gap, lost motion, compliance and encoder skew (Cramer and Rao).

The motor's motion is given; the arm is dragged through gap and spring by it, and predicts both what
the motor carries and what the arm's encoder reads. Slopes are integrated along with that path: an
impact comes earlier or later with the gap, and neither path nor torque jumps with it. (Differences
of two such paths jump where an impact moves by a step of the integration: bounds of single motions
came out at 0.25 to 1 times what they are.) Gear,
friction, both inertias, torque offset, skew and the encoders' places are unknown; so is the arm's
viscous friction, of which it has none: it winds up the gear much as a late encoder seems to, and
makes the skew's bound 1.4 to 9 times as large, those of the others 1 to 6 %. Noise is the
torque's own and that of the encoders' steps, each white, with what the motor's steps become as
torque; an arm that stands reads one step over and over, and its angle then counts for nothing. A
motor that stands is held by whatever friction it takes, and its torque tells nothing.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import solveh_banded

from tests.science.reversal_plant import (
    ARM_COULOMB,
    ARM_INERTIA,
    COUNTS,
    GEAR,
    GEAR_STEP_S,
    MOTOR_INERTIA,
    SAMPLE_S,
    VISCOUS,
    Floats,
    gear_motion,
    swings,
)
from trajectories import Trajectory

_REACH = 2  # samples to either side that a difference takes
_ANY_NM = 1e3  # the error of a torque that holds a motor at rest
_MOVES = 0.5  # counts a sample, from which on steps are taken for white noise


def clearance_bound(
    gap_rad: float,
    stiffness: float,
    noise_nm: float,
    arm_counts: int = 1 << 22,
    counts: int = COUNTS,
    motion: Trajectory | None = None,
) -> dict[str, float]:
    """Return the smallest standard deviations by name; that there is no gap is known."""
    motor, velocity = gear_motion(gap_rad, stiffness, swings() if motion is None else motion)
    damping = 0.005 * math.sqrt(stiffness)
    truth = np.array([gap_rad, stiffness, damping, ARM_INERTIA, ARM_COULOMB, 0.0])
    own = np.arange(0 if gap_rad > 0.0 else 1, truth.size)
    every = slice(None, None, round(SAMPLE_S / GEAR_STEP_S))
    path, slopes = arm_slopes(motor, velocity, truth)
    slopes, rate = slopes[every][:, :, own], path[every, 2]
    speed, none = velocity[every], np.zeros((rate.size, 4))
    sliding = np.column_stack(
        (
            np.gradient(velocity, GEAR_STEP_S)[every],
            np.sign(speed),
            speed,
            np.ones_like(speed),
        )
    )
    places = np.column_stack((-rate, np.ones_like(rate)))
    torque = np.column_stack((slopes[:, 1], sliding, none[:, :2]))
    arm = np.column_stack((slopes[:, 0], none, places))
    motor_step, arm_step = 2.0 * np.pi / counts, 2.0 * np.pi * GEAR / arm_counts
    moves = arm[np.abs(rate) * SAMPLE_S > _MOVES * arm_step]
    information = 12.0 * moves.T @ moves / (motor_step**2 + arm_step**2)
    information += _of_torque(torque, speed != 0.0, noise_nm, motor_step / math.sqrt(12.0))
    scale = np.sqrt(np.diag(information))
    covariance = np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale)
    return _deviations(covariance, own.tolist(), stiffness)


def _deviations(covariance: Floats, own: list[int], stiffness: float) -> dict[str, float]:
    """Return the deviations of what is reported, from those of the gear's own numbers."""
    unit = np.eye(covariance.shape[0])
    compliance = -unit[own.index(1)] / stiffness**2
    lost = 2.0 * ARM_COULOMB * compliance + 2.0 / stiffness * unit[own.index(4)]
    gradients = {"compliance_rad_per_nm": compliance, "encoder_skew_s": unit[-2]}
    if 0 in own:
        lost = lost + unit[own.index(0)]
        gradients["backlash_rad"] = unit[own.index(0)]
    gradients["lost_motion_rad"] = lost
    return {name: float(np.sqrt(g @ covariance @ g)) for name, g in gradients.items()}


def _of_torque(
    slopes: Floats, slides: NDArray[np.bool_], noise_nm: float, place_rad: float
) -> Floats:
    """Return what the torque tells, shape (p, p): what the motor's steps add to it is coloured.

    Differences of fourth order: the usual ones, taken twice, feel nothing near half of the rate.
    """
    size = slopes.shape[0]
    once = _differences(size, (1 / 12, -2 / 3, 0.0, 2 / 3, -1 / 12)) / SAMPLE_S
    twice = _differences(size, (-1 / 12, 4 / 3, -5 / 2, 4 / 3, -1 / 12)) / SAMPLE_S**2
    shaken = MOTOR_INERTIA * twice + VISCOUS * once
    coloured = place_rad**2 * (shaken @ shaken.T)
    upper = np.zeros((2 * _REACH + 1, size))
    for k in range(2 * _REACH + 1):
        upper[2 * _REACH - k, k:] = coloured.diagonal(k)
    upper[-1] += np.where(slides, noise_nm, _ANY_NM) ** 2
    return np.asarray(slopes.T @ solveh_banded(upper, slopes), dtype=np.float64)


def _differences(size: int, weights: Sequence[float]) -> Any:
    offsets = range(-_REACH, _REACH + 1)
    ends = [np.full(size - abs(k), w) for k, w in zip(offsets, weights, strict=True)]
    return sparse.diags(ends, list(offsets), format="csr")


def arm_slopes(motor: Floats, velocity: Floats, gear: Floats) -> tuple[Floats, Floats]:
    """Return the path of a dragged arm and its slopes by the gear's six numbers: see `_drag`.

    Parameters
    ----------
    motor, velocity : ndarray, shape (n,)
        The motor's angle and velocity, every `GEAR_STEP_S`.
    gear : ndarray, shape (6,)
        Gap, stiffness, damping, the arm's inertia, Coulomb and viscous friction.
    """
    path, slopes = _compiled()(motor, velocity, *gear.tolist())
    return np.asarray(path), np.asarray(slopes)


@functools.cache
def _compiled() -> Callable[..., tuple[Floats, Floats]]:
    import numba

    loop: Any = numba.njit(cache=True)(_drag)
    return cast("Callable[..., tuple[Floats, Floats]]", loop)


def _drag(
    motor: Floats,
    velocity: Floats,
    gap: float,
    stiff: float,
    damp: float,
    inertia: float,
    coulomb: float,
    viscous: float,
) -> tuple[Floats, Floats]:
    """Return the arm's angle, the teeth's torque and the arm's velocity, shape (n, 3).

    And the slopes of angle and torque by the six numbers of the gear, shape (n, 2, 6). Where teeth
    meet, their damping jumps: a meeting that comes earlier gives the arm as much more of it.
    """
    dt = GEAR_STEP_S
    arm = rate = 0.0
    arms, rates, own, pushes = np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(6)
    apart = gap > 0.0
    out, slopes = np.empty((motor.size, 3)), np.empty((motor.size, 2, 6))
    for k in range(motor.size):
        twist, tooth, side = motor[k] - arm, 0.0, 0.0
        if abs(twist) > gap / 2:
            side = math.copysign(1.0, twist)
        wound, slip = twist - side * gap / 2, velocity[k] - rate
        own[:] = 0.0
        bites = side * (stiff * wound + damp * slip) > 0.0
        if bites:
            tooth = stiff * wound + damp * slip
            own[0], own[1], own[2] = -stiff * side / 2, wound, slip
            if apart:
                rates[0] -= damp / inertia * side / 2
                for j in range(6):
                    rates[j] -= damp / inertia * arms[j]
        apart = side == 0.0 and gap > 0.0
        out[k, 0], out[k, 1], out[k, 2] = arm, tooth, rate
        push = tooth - viscous * rate
        pushes[3], pushes[5] = -push / inertia, -rate
        rate += dt * push / inertia
        way, stops = math.copysign(1.0, rate), abs(rate) <= dt * coulomb / inertia
        pushes[3] += way * coulomb / inertia
        pushes[4] = -way
        rate = 0.0 if stops else rate - way * dt * coulomb / inertia
        for j in range(6):
            torque = own[j] - stiff * arms[j] - damp * rates[j] if bites else 0.0
            slopes[k, 0, j], slopes[k, 1, j] = arms[j], torque
            rates[j] += dt * (torque - viscous * rates[j] + pushes[j]) / inertia
            rates[j] = 0.0 if stops else rates[j]
            arms[j] += dt * rates[j]
        arm += dt * rate
    return out, slopes
