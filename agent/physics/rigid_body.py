"""One rigid joint: the torque that a measured motion needs (thesis 3.1, 3.4, 4.5).

``torque = J a + fv v + fc sign(v) + g_sin sin(q/N) + g_cos cos(q/N) + offset``, everything on the
motor side, with the arm angle q/N behind a gear of ratio N. Valid below the first resonance of
arm and gear, for one axis moving at a time.
"""

from __future__ import annotations

import math
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

PARAMETERS: tuple[str, ...] = (
    "inertia_kg_m2",
    "viscous_nm_s_per_rad",
    "coulomb_nm",
    "gravity_sin_nm",
    "gravity_cos_nm",
    "torque_offset_nm",
)
"""The regression's parameters in the order of thesis (4.5), with the torque offset last."""

GRAVITY: tuple[str, ...] = ("gravity_sin_nm", "gravity_cos_nm")
"""Those of a weight, which belong together: what it is depends on where zero is."""

MEANING = MappingProxyType(
    {
        "inertia_kg_m2": "inertia of motor and arm, seen by the motor",
        "viscous_nm_s_per_rad": "friction that grows with velocity",
        "coulomb_nm": "friction that depends on direction only",
        "gravity_sin_nm": "gravity torque in proportion to the sine of the arm angle",
        "gravity_cos_nm": "gravity torque in proportion to the cosine of the arm angle",
        "torque_offset_nm": "constant part of the reported torque",
    }
)


def gravity_columns(position_rad: Floats, gear_ratio: float) -> Floats:
    """Return ``[sin(q/N), cos(q/N)]``, shape (n, 2), of the motor angle q (thesis 3.4)."""
    arm_rad = position_rad / gear_ratio
    return np.stack([np.sin(arm_rad), np.cos(arm_rad)], axis=-1)


def weight_nm(arm_rad: float, sin_nm: float, cos_nm: float) -> float:
    """Return gravity's torque at one arm angle: `gravity_columns` for loops over plain numbers."""
    return sin_nm * math.sin(arm_rad) + cos_nm * math.cos(arm_rad)


def regressor(
    position_rad: Floats | None,
    velocity_rad_s: Floats,
    acceleration_rad_s2: Floats,
    direction: Floats,
    gear_ratio: float,
) -> Floats:
    """Return the columns of thesis (4.5), shape (n, 6), in the order of `PARAMETERS`.

    Parameters
    ----------
    position_rad : ndarray, shape (n,), optional
        Motor angle; without it the two gravity columns are zero.
    velocity_rad_s, acceleration_rad_s2 : ndarray, shape (n,)
        Motor velocity and acceleration.
    direction : ndarray, shape (n,)
        Sign of the velocity, thresholded as in thesis (4.10).
    gear_ratio : float
        Motor turns per arm turn, N.
    """
    columns = np.zeros((velocity_rad_s.shape[0], len(PARAMETERS)))
    columns[:, 0] = acceleration_rad_s2
    columns[:, 1] = velocity_rad_s
    columns[:, 2] = direction
    if position_rad is not None:
        columns[:, 3:5] = gravity_columns(position_rad, gear_ratio)
    columns[:, 5] = 1.0
    return columns
