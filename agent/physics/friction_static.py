"""Friction without memory at one temperature and place: static, by direction, under load.

All torques oppose motion with the sign of the velocity (motor side), so that ``torque - friction``
accelerates the joint. Every law but `StaticFriction` returns zero at rest, where friction is
indeterminate; `StaticFriction` answers there with what holds the joint. Coulomb, viscous and
Stribeck friction are `agent.physics.friction`'s; what the oil does is `friction_oil`'s, and what
the place of the arm does `friction_place`'s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.friction import boundary_share
from agent.physics.law import Law, require

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class StaticFriction:
    """Coulomb and viscous sliding, and a higher level that must be overcome to leave rest."""

    law: ClassVar[Law] = Law(
        "static",
        "v = 0: clip(tau, -(fc + fs), fc + fs); else fc sign(v) + fv v",
        {
            "coulomb_nm": "fc, sliding level",
            "viscous_nm_s_per_rad": "fv, growth with velocity",
            "static_extra_nm": "fs, breakaway level above fc",
        },
        "thesis 3.7, Figure 3.7(c); Olsson et al., Eur. J. Control 4 (1998) 176",
        "jumps at zero speed; no fall over a range of speeds, no elastic displacement",
    )
    coulomb_nm: float
    viscous_nm_s_per_rad: float
    static_extra_nm: float

    def __post_init__(self) -> None:
        """Refuse levels below zero."""
        require(self.law, self, not_negative=" ".join(self.law.parameters))

    def torque_nm(self, velocity_rad_s: Floats, applied_nm: Floats) -> Floats:
        """Return the friction torque, shape (n,); at rest it holds what is applied, to a limit."""
        limit = self.coulomb_nm + self.static_extra_nm
        sliding = (
            self.coulomb_nm * np.sign(velocity_rad_s) + self.viscous_nm_s_per_rad * velocity_rad_s
        )
        holding = np.clip(applied_nm, -limit, limit)
        return np.where(velocity_rad_s == 0.0, holding, sliding)


@dataclass(frozen=True)
class DirectionDependent:
    """Levels that differ between the two directions, as a part beside the symmetric law."""

    law: ClassVar[Law] = Law(
        "direction-dependent",
        "(dc |sign(v)| + dv |v|)/2, beside a symmetric fc sign(v) + fv v",
        {
            "coulomb_difference_nm": "dc, forward minus backward Coulomb level",
            "viscous_difference_nm_s_per_rad": "dv, forward minus backward viscous slope",
        },
        "thesis 3.7 (fc depends on direction); Bittencourt & Gunnarsson, JDSMC 134 (2012) 051013",
        "dc alone cannot be told from a torque offset while the joint slides",
    )
    coulomb_difference_nm: float = 0.0
    viscous_difference_nm_s_per_rad: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is not finite."""
        require(self.law, self)

    def torque_nm(self, velocity_rad_s: Floats, direction: Floats | None = None) -> Floats:
        """Return the asymmetric part, shape (n,), even in velocity; zero at rest."""
        moving = np.abs(np.sign(velocity_rad_s) if direction is None else direction)
        slope = self.viscous_difference_nm_s_per_rad * np.abs(velocity_rad_s)
        return np.asarray(0.5 * (self.coulomb_difference_nm * moving + slope))


@dataclass(frozen=True)
class LoadDependent:
    """Friction that grows with the torque that the gear transmits."""

    law: ClassVar[Law] = Law(
        "load-dependent",
        "c |l| |l/lr|^(p - 1) sign(v) / (1 - e c/c0 sign(l v)), c = cl + sl exp(-|v/vl|^a)",
        {
            "load_coefficient": "cl, friction per load while sliding fast (no unit)",
            "load_boundary_coefficient": "sl, more of it in the boundary region (no unit)",
            "load_velocity_rad_s": "vl, where the boundary part has fallen to 1/e",
            "exponent": "a, how sharply it falls",
            "load_power": "p, power of the load with which it grows (1: in proportion)",
            "reference_load_nm": "lr, load at which cl and sl are friction per load",
            "driving_excess": "e, more of it where the motor drives the load, less where the load "
            "drives, at rest, where c is c0 (0: none; u c0 of friction a share u of which loads "
            "the gear itself: 1 of the motor's torque, 1/2 of its mean with the load)",
        },
        "Bittencourt & Gunnarsson, JDSMC 134 (2012) 051013, p = 1, e = 0; of the motor's torque, "
        "or the mean: Duclusaud et al., Extended friction models for the physics simulation of "
        "servo actuators (2025), M3 to M6; other powers: our own choice",
        "load l is the transmitted torque on the motor side, up to the gear's rated one",
    )
    load_coefficient: float
    load_boundary_coefficient: float = 0.0
    load_velocity_rad_s: float = 1.0
    exponent: float = 1.0
    load_power: float = 1.0
    reference_load_nm: float = 1.0
    driving_excess: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a load that would drive the joint."""
        require(
            self.law,
            self,
            positive="load_velocity_rad_s exponent load_power reference_load_nm",
            not_negative="load_coefficient load_boundary_coefficient driving_excess",
        )
        if self.driving_excess >= 1.0:
            raise ValueError(
                f"{self.law.id}: driving_excess: expected a number below 1, "
                f"got {self.driving_excess}"
            )

    def torque_nm(
        self, velocity_rad_s: Floats, load_nm: Floats, direction: Floats | None = None
    ) -> Floats:
        """Return the load's part of friction, shape (n,)."""
        sign = np.sign(velocity_rad_s) if direction is None else direction
        boundary = boundary_share(velocity_rad_s, self.load_velocity_rad_s, self.exponent)
        share = self.load_coefficient + self.load_boundary_coefficient * boundary
        load = powered_nm(load_nm, self.load_power, self.reference_load_nm)
        if not self.driving_excess:
            return np.asarray(share * load * sign)
        at_rest = self.load_coefficient + self.load_boundary_coefficient
        own = self.driving_excess * share / max(at_rest, 1e-300)
        return np.asarray(share * load * sign / one_less(own, load_nm * sign))


def one_less(own: Floats | float, driven_nm: Floats) -> Floats:
    """Return what friction under load is divided by as it loads the gear itself, shape (n,).

    It adds to the load where the motor drives that, and takes from it where the load drives.

    Parameters
    ----------
    own : float or ndarray, shape (n,)
        Friction per load, as far as it loads the gear: below 1.
    driven_nm : ndarray, shape (n,)
        The load along the motion: above zero where the motor drives it.
    """
    return np.asarray(1.0 - own * np.sign(driven_nm))


def powered_nm(load_nm: Floats, power: float, reference_nm: float) -> Floats:
    """Return ``|l| |l/lr|^(p - 1)``, shape (n,): a load to a power, itself at the reference."""
    size = np.abs(load_nm)
    return size if power == 1.0 else np.asarray(reference_nm * (size / reference_nm) ** power)
