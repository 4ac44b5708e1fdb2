"""What the oil does to friction: it thins as it warms and as it is sheared.

Torques oppose motion with the sign of the velocity (motor side) and are zero at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.law import Law, require

Floats = NDArray[np.float64]

_DECAY_GROWTH = 0.2


def thinning_share(
    temperature_degc: Floats | float, reference_degc: Floats | float, decay_k: Floats | float
) -> Floats:
    """Return how much of the viscous part that falls is left, ``exp(-(T - Tr)/Tv)``, broadcast.

    1 at the reference temperature, more below it (no unit); the law is `TemperatureViscous`.
    """
    return np.asarray(np.exp(-np.subtract(temperature_degc, reference_degc) / decay_k))


def thinned_share(fall: Floats) -> Floats:
    """Return which share a film's viscosity has lost after `fall` decays of temperature, (n,).

    ``1 - exp(-x + x^2/10)``, x = (T - Tr)/Tv: `thinning_share` where the decay grows with
    temperature, as it does over wide ranges. For each of the thesis's three oils (viscosities at 40
    and 100 degC by Walther's law) the logarithm bends by 0.19 to 0.20 of its slope's square between
    20 and 50 degC.
    """
    reach = np.minimum(fall, 1.0 / _DECAY_GROWTH)
    return np.asarray(-np.expm1(-reach + 0.5 * _DECAY_GROWTH * reach**2))


def power_law_nm(
    level_nm: Floats | float, velocity_rad_s: Floats, reference_velocity_rad_s: float, power: float
) -> Floats:
    """Return ``fp |v/vr|^p``, shape (n,), of the level's unit and sign; `NonlinearViscous`."""
    speed = np.abs(velocity_rad_s) / reference_velocity_rad_s
    return np.asarray(level_nm * speed**power)


def eyring_nm(
    level_nm: Floats | float, velocity_rad_s: Floats, shear_velocity_rad_s: float
) -> Floats:
    """Return ``fe asinh(|v|/ve)``, shape (n,), of the level's unit and sign; `EyringShear`."""
    return np.asarray(level_nm * np.arcsinh(np.abs(velocity_rad_s) / shear_velocity_rad_s))


def cross_nm(
    level_nm: Floats | float, velocity_rad_s: Floats, plateau_velocity_rad_s: float
) -> Floats:
    """Return ``fb |v|/(|v| + vb)``, shape (n,), of the level's unit and sign; `CrossShear`."""
    speed = np.abs(velocity_rad_s)
    return np.asarray(level_nm * speed / (speed + plateau_velocity_rad_s))


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
        reference = self.reference_velocity_rad_s
        return power_law_nm(self.power_nm, velocity_rad_s, reference, self.exponent) * sign


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
        return eyring_nm(self.shear_nm, velocity_rad_s, self.shear_velocity_rad_s) * sign


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
        return cross_nm(self.plateau_nm, velocity_rad_s, self.plateau_velocity_rad_s) * sign
