"""Two and three masses with springs between them (thesis 3.2, 3.3), on the motor side.

The thesis writes both sides of the gear with a ratio r below 1; here every angle, inertia, spring
and damper is seen by the motor (an arm's inertia divided by N^2, its angle multiplied by N), so
that the ratio drops out of the equations. Time simulation lives elsewhere: these are the laws.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.law import Law, require

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class StateSpace:
    """``dx/dt = A x + B tau - E l``, ``y = C x``: motor torque in, motor velocity out.

    The load l pulls at the last mass.
    """

    A: Floats
    B: Floats
    C: Floats
    E: Floats

    def response(self, frequency_hz: Floats) -> Complexes:
        """Return motor velocity over motor torque, rad/s per N m, shape (n,)."""
        s = 2j * np.pi * np.asarray(frequency_hz)[:, np.newaxis, np.newaxis]
        inside = np.linalg.solve(
            s * np.eye(len(self.A)) - self.A, self.B[np.newaxis, :, np.newaxis]
        )
        return np.asarray((self.C @ inside)[:, 0, 0], dtype=np.complex128)


@dataclass(frozen=True)
class TwoMass:
    """Motor and arm, joined by a spring that may stiffen with its twist."""

    law: ClassVar[Law] = Law(
        "two-mass",
        "Jm am = tau - tau_f - d(vm - va) - tau_s; Ja aa = d(vm - va) + tau_s;"
        " tau_s = k x + k3 x^3, x = qm - qa",
        {
            "motor_inertia_kg_m2": "Jm",
            "arm_inertia_kg_m2": "Ja, seen by the motor",
            "stiffness_nm_per_rad": "k",
            "cubic_stiffness_nm_per_rad3": "k3",
            "damping_nm_s_per_rad": "d",
        },
        "thesis (3.2) and 3.4.1",
        "one flexible mode, the gearbox; slow motion of a stiff arm; no clearance",
    )
    motor_inertia_kg_m2: float
    arm_inertia_kg_m2: float
    stiffness_nm_per_rad: float
    damping_nm_s_per_rad: float = 0.0
    cubic_stiffness_nm_per_rad3: float = 0.0

    def __post_init__(self) -> None:
        """Refuse masses and springs below zero."""
        require(
            self.law,
            self,
            positive="motor_inertia_kg_m2 arm_inertia_kg_m2 stiffness_nm_per_rad",
            not_negative="damping_nm_s_per_rad cubic_stiffness_nm_per_rad3",
        )

    def spring_nm(self, twist_rad: Floats) -> Floats:
        """Return the spring's torque."""
        x = np.asarray(twist_rad)
        return np.asarray(self.stiffness_nm_per_rad * x + self.cubic_stiffness_nm_per_rad3 * x**3)

    def energy_j(self, state: Floats) -> Floats:
        """Return kinetic and spring energy of states ``[twist, vm, va]``, shape (..., 3)."""
        x, vm, va = np.moveaxis(np.asarray(state), -1, 0)
        spring = self.stiffness_nm_per_rad * x**2 + 0.5 * self.cubic_stiffness_nm_per_rad3 * x**4
        return np.asarray(
            0.5 * (self.motor_inertia_kg_m2 * vm**2 + self.arm_inertia_kg_m2 * va**2 + spring)
        )

    def derivative(self, state: Floats, torque_nm: Floats | float) -> Floats:
        """Return d/dt of ``[twist, vm, va]``, shape (..., 3), for motor torque less friction."""
        x, vm, va = np.moveaxis(np.asarray(state), -1, 0)
        shaft = self.spring_nm(x) + self.damping_nm_s_per_rad * (vm - va)
        motor = (torque_nm - shaft) / self.motor_inertia_kg_m2
        return np.stack(np.broadcast_arrays(vm - va, motor, shaft / self.arm_inertia_kg_m2), -1)

    def state_space(self, viscous_nm_s_per_rad: float = 0.0) -> StateSpace:
        """Return the linear part (``k3 = 0``) with viscous friction at the motor; 3 states."""
        jm, ja = self.motor_inertia_kg_m2, self.arm_inertia_kg_m2
        k, d = self.stiffness_nm_per_rad, self.damping_nm_s_per_rad
        matrix = np.array(
            [
                [0.0, 1.0, -1.0],
                [-k / jm, -(d + viscous_nm_s_per_rad) / jm, d / jm],
                [k / ja, d / ja, -d / ja],
            ]
        )
        drive, load = np.array([0.0, 1.0 / jm, 0.0]), np.array([0.0, 0.0, 1.0 / ja])
        return StateSpace(matrix, drive, np.array([[0.0, 1.0, 0.0]]), load)

    def antiresonance_hz(self) -> float:
        """Return where the arm swings against a held motor, undamped."""
        return float(np.sqrt(self.stiffness_nm_per_rad / self.arm_inertia_kg_m2) / (2.0 * np.pi))

    def resonance_hz(self) -> float:
        """Return where arm and motor swing freely against each other, undamped."""
        share = 1.0 / self.motor_inertia_kg_m2 + 1.0 / self.arm_inertia_kg_m2
        return float(np.sqrt(self.stiffness_nm_per_rad * share) / (2.0 * np.pi))


@dataclass(frozen=True)
class ThreeMass:
    """Motor, gear and arm: the gearbox's spring and the arm's own."""

    law: ClassVar[Law] = Law(
        "three-mass",
        "Jm am = tau - tau_f - tau_g; Jg ag = tau_g - tau_a; Ja aa = tau_a;"
        " tau_g = kg(qm - qg) + kg3(qm - qg)^3 + dg(vm - vg); tau_a = ka(qg - qa) + da(vg - va)",
        {
            "motor_inertia_kg_m2": "Jm",
            "gear_inertia_kg_m2": "Jg, seen by the motor",
            "arm_inertia_kg_m2": "Ja, seen by the motor",
            "gear_stiffness_nm_per_rad": "kg",
            "gear_cubic_stiffness_nm_per_rad3": "kg3",
            "gear_damping_nm_s_per_rad": "dg",
            "arm_stiffness_nm_per_rad": "ka",
            "arm_damping_nm_s_per_rad": "da",
        },
        "thesis (3.3); Wernholt & Gunnarsson, SYSID 2006, for the cubic gear spring",
        "two flexible modes; springs without clearance; friction at the motor only",
    )
    motor_inertia_kg_m2: float
    gear_inertia_kg_m2: float
    arm_inertia_kg_m2: float
    gear_stiffness_nm_per_rad: float
    arm_stiffness_nm_per_rad: float
    gear_damping_nm_s_per_rad: float = 0.0
    arm_damping_nm_s_per_rad: float = 0.0
    gear_cubic_stiffness_nm_per_rad3: float = 0.0

    def __post_init__(self) -> None:
        """Refuse masses and springs below zero."""
        require(
            self.law,
            self,
            positive="motor_inertia_kg_m2 gear_inertia_kg_m2 arm_inertia_kg_m2"
            " gear_stiffness_nm_per_rad arm_stiffness_nm_per_rad",
            not_negative="gear_damping_nm_s_per_rad arm_damping_nm_s_per_rad"
            " gear_cubic_stiffness_nm_per_rad3",
        )

    @property
    def _inertias(self) -> Floats:
        return np.array([self.motor_inertia_kg_m2, self.gear_inertia_kg_m2, self.arm_inertia_kg_m2])

    def derivative(self, state: Floats, torque_nm: Floats | float) -> Floats:
        """Return d/dt of ``[qm - qg, qg - qa, vm, vg, va]``, shape (..., 5)."""
        xg, xa, vm, vg, va = np.moveaxis(np.asarray(state), -1, 0)
        gear = self.gear_stiffness_nm_per_rad * xg + self.gear_cubic_stiffness_nm_per_rad3 * xg**3
        gear = gear + self.gear_damping_nm_s_per_rad * (vm - vg)
        arm = self.arm_stiffness_nm_per_rad * xa + self.arm_damping_nm_s_per_rad * (vg - va)
        jm, jg, ja = self._inertias
        accelerations = ((torque_nm - gear) / jm, (gear - arm) / jg, arm / ja)
        return np.stack(np.broadcast_arrays(vm - vg, vg - va, *accelerations), -1)

    def state_space(self, viscous_nm_s_per_rad: float = 0.0) -> StateSpace:
        """Return the linear part (``kg3 = 0``) with viscous friction at the motor; 5 states."""
        jm, jg, ja = self._inertias
        kg, dg = self.gear_stiffness_nm_per_rad, self.gear_damping_nm_s_per_rad
        ka, da = self.arm_stiffness_nm_per_rad, self.arm_damping_nm_s_per_rad
        matrix = np.array(
            [
                [0.0, 0.0, 1.0, -1.0, 0.0],
                [0.0, 0.0, 0.0, 1.0, -1.0],
                [-kg / jm, 0.0, -(dg + viscous_nm_s_per_rad) / jm, dg / jm, 0.0],
                [kg / jg, -ka / jg, dg / jg, -(dg + da) / jg, da / jg],
                [0.0, ka / ja, 0.0, da / ja, -da / ja],
            ]
        )
        drive = np.array([0.0, 0.0, 1.0 / jm, 0.0, 0.0])
        load = np.array([0.0, 0.0, 0.0, 0.0, 1.0 / ja])
        return StateSpace(matrix, drive, np.array([[0.0, 0.0, 1.0, 0.0, 0.0]]), load)

    def antiresonances_hz(self) -> Floats:
        """Return where gear and arm swing behind a held motor, undamped, rising, shape (2,)."""
        return undamped_rad_s(self._stiffness()[1:, 1:], self._inertias[1:]) / (2.0 * np.pi)

    def resonances_hz(self) -> Floats:
        """Return where all three swing freely, undamped, rising, shape (2,)."""
        return undamped_rad_s(self._stiffness(), self._inertias)[1:] / (2.0 * np.pi)

    def _stiffness(self) -> Floats:
        return chain_matrix((0.0, self.gear_stiffness_nm_per_rad, self.arm_stiffness_nm_per_rad))


def chain_matrix(links: Sequence[float]) -> Floats:
    """Return the matrix K (or D) of masses in a row, shape (n, n), from one link a mass.

    Parameters
    ----------
    links : sequence of float, length n
        Stiffness (or damping) of what carries each mass; the first hangs on what stands still,
        and is zero where the first mass is free.
    """
    count = len(links)
    matrix = np.zeros((count, count))
    for i, link in enumerate(links):
        matrix[i, i] += link
        if i:
            matrix[i - 1, i - 1] += link
            matrix[i - 1, i] -= link
            matrix[i, i - 1] -= link
    return matrix


def undamped_rad_s(stiffness: Floats, inertias: Floats) -> Floats:
    """Return the undamped angular frequencies of ``K - w^2 J``, rising."""
    root = np.sqrt(inertias)
    squares = np.linalg.eigvalsh(stiffness / np.outer(root, root))
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))


def held_poles_per_s(
    inertias: Sequence[float], springs: Sequence[float], dampers: Sequence[float]
) -> Complexes:
    """Return the poles of a chain of n masses behind a motor that stands, shape (2 n,).

    The nearest mass first, each with the spring and damper that carry it.
    """
    count = len(inertias)
    inverse = np.array(inertias)[:, np.newaxis]
    state = np.zeros((2 * count, 2 * count))
    state[:count, count:] = np.eye(count)
    state[count:, :count] = -chain_matrix(springs) / inverse
    state[count:, count:] = -chain_matrix(dampers) / inverse
    return np.asarray(np.linalg.eigvals(state), dtype=np.complex128)


def apparent_inertia_kg_m2(
    inertias: Sequence[float],
    springs: Sequence[float],
    dampers: Sequence[float],
    omega_rad_s: Floats,
) -> Complexes:
    """Return a chain's torque on the motor per motor acceleration, shape (n,).

    A mass J behind a spring k with damper d, carried by something that accelerates, answers with
    ``M(s) = m (d s + k) / (m s^2 + d s + k)``, where m is its own inertia plus the apparent
    inertia of what it carries itself. At low frequency the chain is rigid, ``M(0) = sum J``; where
    its masses swing against a held motor (antiresonance) M has its poles. The nearest mass first.
    """
    s = 1j * omega_rad_s
    carried: Complexes = np.zeros_like(s)
    for inertia, spring, damper in reversed(list(zip(inertias, springs, dampers, strict=True))):
        m = inertia + carried
        link = damper * s + spring
        carried = m * link / (m * s * s + link)
    return carried


def lag_share(
    inertia_kg_m2: float,
    stiffness_nm_per_rad: float,
    damping_nm_s_per_rad: float,
    omega_rad_s: Floats,
) -> Complexes:
    """Return by which share of its way a single mass lags behind the motor, shape (n,).

    ``J s^2/(J s^2 + d s + k)``, which is ``1 - M(s)/J`` of `apparent_inertia_kg_m2`: nothing at low
    frequency, all of the way far above the antiresonance.
    """
    s = 1j * omega_rad_s
    inert = inertia_kg_m2 * s * s
    return np.asarray(inert / (inert + damping_nm_s_per_rad * s + stiffness_nm_per_rad))
