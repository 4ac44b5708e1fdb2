"""What the simulation's own structure leaves unexplained, by a least squares of the fakes' own.

The structure: ``Coulomb sign(v) + viscous v + inertia a + gravity_sin sin(q/N) + gravity_cos
cos(q/N)``, without an offset, and without the gravity columns where the axis has none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Booleans = NDArray[np.bool_]

NAMES = ("coulomb_nm", "viscous_nm_s_per_rad", "inertia_kg_m2", "gravity_sin_nm", "gravity_cos_nm")
_SLOWEST_RAD_S = 0.5


@dataclass(frozen=True)
class Motion:
    """Position, velocity, acceleration and torque of one run, each of shape (n,)."""

    position_rad: Floats
    velocity_rad_s: Floats
    acceleration_rad_s2: Floats
    torque_nm: Floats


@dataclass(frozen=True)
class Refit:
    """The structure's best numbers and what they leave.

    `residual_nm` has one array for each run and every sample; `rms_nm` counts the sliding ones.
    """

    numbers: dict[str, float]
    residual_nm: tuple[Floats, ...]
    rms_nm: float


def sliding(
    velocity_rad_s: Floats,
    position_rad: Floats,
    edge_rad: float,
    slowest_rad_s: float = _SLOWEST_RAD_S,
) -> Booleans:
    """Tell which samples are beyond the edges, shape (n,); slower than the slowest stands still.

    At rest and within `edge_rad` of a start or reversal, dry friction is anything between its two
    levels, and nobody's simulation is wrong there: those samples do not count.
    """
    direction = np.sign(np.where(np.abs(velocity_rad_s) > slowest_rad_s, velocity_rad_s, 0.0))
    turned = np.r_[True, direction[1:] != direction[:-1]]
    began = np.maximum.accumulate(np.where(turned, np.arange(turned.size), 0))
    travelled = np.abs(position_rad - position_rad[began])
    return np.asarray((direction != 0.0) & (travelled > edge_rad))


def columns(motion: Motion, gear_ratio: float, *, gravity: bool) -> Floats:
    """Return the structure's columns, shape (n, 5), or (n, 3) without gravity."""
    arm = motion.position_rad / gear_ratio
    velocity = motion.velocity_rad_s
    base = [np.sign(velocity), velocity, motion.acceleration_rad_s2]
    return np.column_stack([*base, np.sin(arm), np.cos(arm)] if gravity else base)


def refit(
    motions: Sequence[Motion],
    counted: Sequence[Booleans],
    gear_ratio: float,
    *,
    gravity: bool,
    numbers: dict[str, float] | None = None,
    through: Callable[[Floats], Floats] | None = None,
) -> Refit:
    """Return the best fit of the structure over all runs together.

    Parameters
    ----------
    motions, counted : sequences of Motion and of bool arrays, shape (n,)
        The runs, and which samples of each count.
    gear_ratio : float
        Motor turns per arm turn.
    gravity : bool
        Whether the structure has the two gravity columns.
    numbers : dict, optional
        Take these numbers as given instead of fitting.
    through : callable, optional
        What the structure's columns, shape (n, k), and the torque, shape (n, 1), pass alike.
    """
    tables = [columns(motion, gear_ratio, gravity=gravity) for motion in motions]
    torques = [motion.torque_nm for motion in motions]
    if through is not None:
        tables = [through(table) for table in tables]
        torques = [through(torque[:, np.newaxis])[:, 0] for torque in torques]
    if numbers is None:
        table = np.vstack([t[m] for t, m in zip(tables, counted, strict=True)])
        torque = np.concatenate([t[m] for t, m in zip(torques, counted, strict=True)])
        theta = _solve(table, torque)
    else:
        theta = np.array([numbers[name] for name in NAMES[: tables[0].shape[1]]])
    residual = tuple(t - table @ theta for t, table in zip(torques, tables, strict=True))
    kept = np.concatenate([r[m] for r, m in zip(residual, counted, strict=True)])
    named = dict.fromkeys(NAMES, 0.0) | {
        name: float(value) for name, value in zip(NAMES, theta, strict=False)
    }
    return Refit(named, residual, float(np.sqrt(np.mean(kept**2))))


def _solve(table: Floats, torque: Floats) -> Floats:
    """Return the least-squares solution; columns are scaled, so the normal equations will do."""
    scale = np.sqrt(np.mean(table**2, axis=0))
    scaled = table / scale
    return np.asarray(np.linalg.solve(scaled.T @ scaled, scaled.T @ torque) / scale)
