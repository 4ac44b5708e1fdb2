"""Friction without memory beyond Coulomb, viscous and Stribeck: each law once.

All torques oppose motion with the sign of the velocity (motor side), so that ``torque - friction``
accelerates the joint. Every law but `StaticFriction` returns zero at rest, where friction is
indeterminate; `StaticFriction` answers there with what holds the joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.friction import boundary_share
from agent.physics.law import Law, require
from agent.physics.periodic import wave

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
        "[cl |l| + sl |l| exp(-|v/vl|^a)] sign(v)",
        {
            "load_coefficient": "cl, friction per load while sliding fast (no unit)",
            "load_boundary_coefficient": "sl, more of it in the boundary region (no unit)",
            "load_velocity_rad_s": "vl, where the boundary part has fallen to 1/e",
            "exponent": "a, how sharply it falls",
        },
        "Bittencourt & Gunnarsson, JDSMC 134 (2012) 051013",
        "load l is the transmitted torque on the motor side, up to the gear's rated one",
    )
    load_coefficient: float
    load_boundary_coefficient: float = 0.0
    load_velocity_rad_s: float = 1.0
    exponent: float = 1.0

    def __post_init__(self) -> None:
        """Refuse a load that would drive the joint."""
        require(
            self.law,
            self,
            positive="load_velocity_rad_s exponent",
            not_negative="load_coefficient load_boundary_coefficient",
        )

    def torque_nm(
        self, velocity_rad_s: Floats, load_nm: Floats, direction: Floats | None = None
    ) -> Floats:
        """Return the load's part of friction, shape (n,)."""
        sign = np.sign(velocity_rad_s) if direction is None else direction
        boundary = boundary_share(velocity_rad_s, self.load_velocity_rad_s, self.exponent)
        share = self.load_coefficient + self.load_boundary_coefficient * boundary
        return np.asarray(share * np.abs(load_nm) * sign)


def thinning_share(
    temperature_degc: Floats | float, reference_degc: Floats | float, decay_k: Floats | float
) -> Floats:
    """Return how much of the viscous part that falls is left, ``exp(-(T - Tr)/Tv)``, broadcast.

    1 at the reference temperature, more below it (no unit); the law is `TemperatureViscous`.
    """
    return np.asarray(np.exp(-np.subtract(temperature_degc, reference_degc) / decay_k))


@dataclass(frozen=True)
class TemperatureViscous:
    """Viscous friction that falls exponentially with the oil's temperature."""

    law: ClassVar[Law] = Law(
        "temperature-viscous",
        "[fv + fvt exp(-(T - Tr)/Tv)] v",
        {
            "viscous_nm_s_per_rad": "fv, what is left when hot",
            "viscous_thermal_nm_s_per_rad": "fvt, the part that falls, at Tr",
            "reference_degc": "Tr",
            "decay_k": "Tv, temperature rise that leaves 1/e of fvt",
        },
        "Bittencourt et al., ICRA 2010 workshop; thesis 5.3.2 for the effect",
        "the sliding regime; 30 to 80 degC for the published numbers; film fully formed",
    )
    viscous_nm_s_per_rad: float
    viscous_thermal_nm_s_per_rad: float
    reference_degc: float
    decay_k: float

    def __post_init__(self) -> None:
        """Refuse viscosity below zero."""
        require(
            self.law,
            self,
            positive="decay_k",
            not_negative="viscous_nm_s_per_rad viscous_thermal_nm_s_per_rad",
        )

    def torque_nm(self, velocity_rad_s: Floats, temperature_degc: Floats) -> Floats:
        """Return the viscous torque, broadcast over velocity and temperature."""
        fall = thinning_share(temperature_degc, self.reference_degc, self.decay_k)
        slope = self.viscous_nm_s_per_rad + self.viscous_thermal_nm_s_per_rad * fall
        return np.asarray(slope * velocity_rad_s)


@dataclass(frozen=True)
class NonlinearViscous:
    """Sliding friction that bends with speed: a power law, shear thinning below exponent 1."""

    law: ClassVar[Law] = Law(
        "viscous-nonlinear",
        "fp |v/vr|^p sign(v)",
        {
            "power_nm": "fp, torque at the reference velocity (below zero: bends downwards)",
            "reference_velocity_rad_s": "vr, any speed of the cycle",
            "exponent": "p; 1 is a viscous line",
        },
        "Ostwald-de Waele power law; Waiboer, Aarts, Jonker, Euromech 452 (2005) for gears",
        "the range of speeds that it was fitted in; a power law has no plateau",
    )
    power_nm: float
    reference_velocity_rad_s: float
    exponent: float

    def __post_init__(self) -> None:
        """Refuse a power that has no value at rest."""
        require(self.law, self, positive="reference_velocity_rad_s exponent")

    def torque_nm(self, velocity_rad_s: Floats, direction: Floats | None = None) -> Floats:
        """Return the torque, shape (n,)."""
        sign = np.sign(velocity_rad_s) if direction is None else direction
        speed = np.abs(velocity_rad_s) / self.reference_velocity_rad_s
        return np.asarray(self.power_nm * speed**self.exponent * sign)


@dataclass(frozen=True)
class EyringShear:
    """Oil that thins as it is sheared, a plain viscous line at low speed: no plateau, no power."""

    law: ClassVar[Law] = Law(
        "eyring-shear",
        "fe asinh(|v|/ve) sign(v)",
        {
            "shear_nm": "fe, Eyring's stress at the gear's contacts, as torque",
            "shear_velocity_rad_s": "ve, speed up to which it is viscous, slope fe/ve",
        },
        "Eyring, J. Chem. Phys. 4 (1936) 283",
        "one temperature: both numbers change with the oil's warmth",
    )
    shear_nm: float
    shear_velocity_rad_s: float

    def __post_init__(self) -> None:
        """Refuse what has no slope at rest."""
        require(self.law, self, positive="shear_velocity_rad_s")

    def torque_nm(self, velocity_rad_s: Floats, direction: Floats | None = None) -> Floats:
        """Return the torque, shape (n,)."""
        sign = np.sign(velocity_rad_s) if direction is None else direction
        speed = np.abs(velocity_rad_s) / self.shear_velocity_rad_s
        return np.asarray(self.shear_nm * np.arcsinh(speed) * sign)


@dataclass(frozen=True)
class CrossShear:
    """Oil whose thickener gives way as it is sheared: what that adds has a plateau."""

    law: ClassVar[Law] = Law(
        "cross-shear",
        "fb |v|/(|v| + vb) sign(v)",
        {
            "plateau_nm": "fb, what it adds at high speed",
            "plateau_velocity_rad_s": "vb, speed at which half of that is there",
        },
        "Cross, J. Colloid Sci. 20 (1965) 417, with m = 1",
        "one temperature: both numbers change with the oil's warmth",
    )
    plateau_nm: float
    plateau_velocity_rad_s: float

    def __post_init__(self) -> None:
        """Refuse what has no slope at rest."""
        require(self.law, self, positive="plateau_velocity_rad_s")

    def torque_nm(self, velocity_rad_s: Floats, direction: Floats | None = None) -> Floats:
        """Return the torque, shape (n,)."""
        sign = np.sign(velocity_rad_s) if direction is None else direction
        speed = np.abs(velocity_rad_s)
        return np.asarray(self.plateau_nm * speed / (speed + self.plateau_velocity_rad_s) * sign)


@dataclass(frozen=True)
class PositionDependent:
    """A friction level that is modulated along the position; its sign follows velocity."""

    law: ClassVar[Law] = Law(
        "position-dependent",
        "[c cos(n q) + s sin(n q)] sign(v)",
        {
            "cos_nm": "c, in phase with position zero",
            "sin_nm": "s, a quarter of a period later",
            "order": "n, periods per turn of the angle q that is handed in",
        },
        "Armstrong-Helouvry, Control of Machines with Friction (1991), chapter 4",
        "one order; the modulation must stay below the Coulomb level, or friction would drive",
    )
    cos_nm: float
    sin_nm: float
    order: float

    def __post_init__(self) -> None:
        """Refuse what has no period."""
        require(self.law, self, positive="order")

    def torque_nm(
        self, angle_rad: Floats, velocity_rad_s: Floats, direction: Floats | None = None
    ) -> Floats:
        """Return the modulation of friction, shape (n,)."""
        sign = np.sign(velocity_rad_s) if direction is None else direction
        return wave(self.cos_nm, self.sin_nm, self.order, angle_rad) * sign


@dataclass(frozen=True)
class TemperatureCoulomb:
    """A Coulomb level that changes in proportion to the gearbox's temperature."""

    law: ClassVar[Law] = Law(
        "temperature-coulomb",
        "fT (T - Tr) sign(v), beside fc sign(v) at Tr",
        {
            "coulomb_nm_per_k": "fT, growth of the Coulomb level per kelvin (below zero: falls)",
            "reference_degc": "Tr, temperature of the Coulomb level",
        },
        "first-order term of Bittencourt & Gunnarsson, JDSMC 134 (2012) 051013, its fs0 + fsT T",
        "a straight line, over the temperatures that it was fitted in",
    )
    coulomb_nm_per_k: float
    reference_degc: float

    def __post_init__(self) -> None:
        """Refuse what is not finite."""
        require(self.law, self)

    def torque_nm(self, direction: Floats, temperature_degc: Floats) -> Floats:
        """Return what the temperature adds to Coulomb friction, broadcast."""
        warmer = np.subtract(temperature_degc, self.reference_degc)
        return np.asarray(self.coulomb_nm_per_k * warmer * direction)


@dataclass(frozen=True)
class TightSpot:
    """More (or less) friction near one place of the arm."""

    law: ClassVar[Law] = Law(
        "tight-spot",
        "h exp(-((q - q0)/w)^2/2) sign(v), q the arm's angle",
        {
            "height_nm": "h, what the friction level has more at the place's middle",
            "center_arm_rad": "q0, its place",
            "width_arm_rad": "w, half of its width at 61 % of its height",
        },
        "Armstrong-Helouvry, Control of Machines with Friction (1991), chapter 4, as one bump",
        "one place; a dent deeper than the Coulomb level would drive",
    )
    height_nm: float
    center_arm_rad: float
    width_arm_rad: float

    def __post_init__(self) -> None:
        """Refuse a place without a width."""
        require(self.law, self, positive="width_arm_rad")

    def torque_nm(self, arm_rad: Floats, direction: Floats) -> Floats:
        """Return the bump of friction, shape (n,)."""
        share = bump_share(arm_rad, self.center_arm_rad, self.width_arm_rad)
        return self.height_nm * share * direction


def bump_share(arm_rad: Floats, center_arm_rad: float, width_arm_rad: float) -> Floats:
    """Return the bell ``exp(-((q - q0)/w)^2/2)``, from 1 at the place to 0 far from it."""
    return np.asarray(np.exp(-0.5 * ((arm_rad - center_arm_rad) / width_arm_rad) ** 2))
