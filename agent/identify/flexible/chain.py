"""A chain of masses behind the motor, seen from the motor (thesis 3.2 and 3.3).

The motor feels the chain as an *apparent inertia* that depends on frequency; the laws of it and of
the chain's modes are in `agent.physics.flexibility`.

Everything is on the motor side, in numbers without dimension or in logarithms, so that no value
that an optimiser can reach is negative: ``omega_i = sqrt(k_i/J_i)``, ``zeta_i = d_i/(2 J_i
omega_i)``, and for two masses the gear's share of their inertia as a logit. The inertia of the
whole chain is a factor in front, and so linear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.physics.flexibility import (
    apparent_inertia_kg_m2,
    chain_matrix,
    held_poles_per_s,
    lag_share,
    undamped_rad_s,
)

Complexes = NDArray[np.complex128]
Kind = Literal["two-mass", "three-mass"]
Structure = Literal["two-mass", "three-mass", "two-arms"]
"""What hangs on the motor: a chain, or two single masses side by side, which swing as the modes of
a chain of two do."""

SHAPE_SIZE = {"two-mass": 2, "three-mass": 5, "two-arms": 4}
"""How many shape parameters a structure has: (ln w, ln z) a mass; a chain of two has a logit."""


@dataclass(frozen=True)
class Chain:
    """Masses behind the motor, the nearest first; tuples of one or two, motor side.

    Parameters
    ----------
    inertia_kg_m2, spring_nm_per_rad, damper_nm_s_per_rad : tuple of float
        Each mass, and the spring and damper that carry it; above zero.
    """

    inertia_kg_m2: tuple[float, ...]
    spring_nm_per_rad: tuple[float, ...]
    damper_nm_s_per_rad: tuple[float, ...]

    def __post_init__(self) -> None:
        values = (*self.inertia_kg_m2, *self.spring_nm_per_rad, *self.damper_nm_s_per_rad)
        lengths = {len(self.spring_nm_per_rad), len(self.damper_nm_s_per_rad)}
        if len(self.inertia_kg_m2) not in (1, 2) or lengths != {len(self.inertia_kg_m2)}:
            raise ValueError(f"expected one or two masses, each with spring and damper, got {self}")
        if not all(math.isfinite(v) and v > 0.0 for v in values):
            raise ValueError(f"expected inertias, springs and dampers above zero, got {self}")

    @property
    def total_kg_m2(self) -> float:
        """Return the inertia of the whole chain."""
        return sum(self.inertia_kg_m2)

    def antiresonances_rad_s(self) -> Floats:
        """Return where the chain swings against a held motor, undamped, rising, shape (m,)."""
        return undamped_rad_s(chain_matrix(self.spring_nm_per_rad), np.array(self.inertia_kg_m2))

    def resonances_rad_s(self, motor_inertia_kg_m2: float) -> Floats:
        """Return where motor and chain swing freely, undamped, rising, shape (m,)."""
        inertias = np.array((motor_inertia_kg_m2, *self.inertia_kg_m2))
        return undamped_rad_s(chain_matrix((0.0, *self.spring_nm_per_rad)), inertias)[1:]


def chain_of(shape: Floats, total_kg_m2: float = 1.0) -> Chain:
    """Return the chain that a vector of shape parameters and a total inertia stand for.

    Parameters
    ----------
    shape : ndarray, shape (2,) or (5,)
        ``ln omega, ln zeta`` for each mass, the nearest first; for two masses then the logit of
        the nearest mass' share of their inertia.
    total_kg_m2 : float
        Inertia of all masses together.
    """
    if shape.shape[0] == 2:
        shares: tuple[float, ...] = (1.0,)
    else:
        nearest = 1.0 / (1.0 + math.exp(-float(shape[4])))
        shares = (nearest, 1.0 - nearest)
    inertias = tuple(total_kg_m2 * share for share in shares)
    omegas = np.exp(shape[0 : 2 * len(shares) : 2])
    zetas = np.exp(shape[1 : 2 * len(shares) : 2])
    return Chain(
        inertias,
        tuple(float(j * w * w) for j, w in zip(inertias, omegas, strict=True)),
        tuple(float(2.0 * z * w * j) for j, w, z in zip(inertias, omegas, zetas, strict=True)),
    )


def chains_of(structure: Structure, shape: Floats) -> list[Chain]:
    """Return the chains of unit inertia that hang on the motor side by side."""
    if structure == "two-arms":
        return [chain_of(shape[:2]), chain_of(shape[2:])]
    return [chain_of(shape)]


def shape_of(chain: Chain) -> Floats:
    """Return the shape parameters of a chain: the inverse of `chain_of`."""
    out: list[float] = []
    for j, k, d in zip(
        chain.inertia_kg_m2, chain.spring_nm_per_rad, chain.damper_nm_s_per_rad, strict=True
    ):
        out += [0.5 * math.log(k / j), math.log(d / (2.0 * math.sqrt(k * j)))]
    if len(chain.inertia_kg_m2) == 2:
        out.append(math.log(chain.inertia_kg_m2[0] / chain.inertia_kg_m2[1]))
    return np.array(out)


def apparent_inertia(chain: Chain, omega_rad_s: Floats) -> Complexes:
    """Return the chain's torque on the motor per motor acceleration, kg m2, shape (n,)."""
    return apparent_inertia_kg_m2(
        chain.inertia_kg_m2, chain.spring_nm_per_rad, chain.damper_nm_s_per_rad, omega_rad_s
    )


def stiffening(chain: Chain, omega_rad_s: Floats) -> Complexes:
    """Return the torque on the motor per torque of a cubic spring beside that of a single mass.

    ``J s^2/(J s^2 + d s + k)``: slow torque moves the mass and is felt as its inertia already.
    """
    (inertia,), (spring,), (damper,) = (
        chain.inertia_kg_m2,
        chain.spring_nm_per_rad,
        chain.damper_nm_s_per_rad,
    )
    return lag_share(inertia, spring, damper, omega_rad_s)


def behind_spring(chain: Chain, omega_rad_s: Floats) -> Complexes:
    """Return what viscous friction of 1 N m s/rad adds on a single mass and not on the motor.

    The torque on the motor per its acceleration, in first order: ``(T^2 - 1)/s``, where
    ``T = (d s + k)/(J s^2 + d s + k)`` carries motion to the mass and torque back; slow motion
    knows no difference.
    """
    carried = 1.0 - stiffening(chain, omega_rad_s)
    s = 1j * np.where(omega_rad_s > 0.0, omega_rad_s, 1.0)
    return np.asarray(np.where(omega_rad_s > 0.0, (carried**2 - 1.0) / s, 0.0))


def free_motion(chain: Chain, count: int, period_s: float) -> Floats:
    """Return how the chain's torque dies away by itself while the motor stands.

    Parameters
    ----------
    chain : Chain
        Of m masses.
    count : int
        Samples n, from zero upward.
    period_s : float
        Between them.

    Returns
    -------
    ndarray, shape (n, 2 m)
        A basis of all free motions: ``Re`` and ``Im`` of ``exp(s t)`` for every pair of complex
        poles, ``exp(s t)`` for every real one.
    """
    columns = []
    for pole in held_poles_per_s(
        chain.inertia_kg_m2, chain.spring_nm_per_rad, chain.damper_nm_s_per_rad
    ):
        if pole.imag > 0.0:
            decay = _decay(pole, count, period_s)
            columns += [decay.real, decay.imag]
        elif pole.imag == 0.0:
            columns.append(_decay(pole, count, period_s).real)
    return np.stack(columns, axis=-1)


def _decay(pole_per_s: complex, count: int, period_s: float) -> Complexes:
    """Return ``exp(s t)``, shape (n,), from the exponentials of some 2 sqrt(n) samples."""
    block = math.isqrt(count) + 1
    begins = np.exp(pole_per_s * (period_s * block) * np.arange(block))
    within = np.exp(pole_per_s * period_s * np.arange(block))
    return np.asarray(np.outer(begins, within).ravel()[:count], dtype=np.complex128)
