"""The simulated joint's friction: Coulomb, Stribeck and a viscous part that thins with heat.

Written apart from the product's own friction laws on purpose, so that the two can disagree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from fakes.checks import require_finite, require_not_negative, require_positive

HIGHEST_TEMPERATURE_DEGC = 150.0


@dataclass(frozen=True)
class FrictionTruth:
    """The friction law at one temperature: what an estimator should find.

    ``torque = sign(w) (coulomb + static_extra exp(-(|w| / v_s)^exponent)) + viscous w``, where
    v_s is the Stribeck velocity.
    """

    coulomb_nm: float
    viscous_nm_s_per_rad: float
    static_extra_nm: float
    stribeck_velocity_rad_s: float
    exponent: float

    @property
    def breakaway_nm(self) -> float:
        """Return the torque below which the resting motor does not move."""
        return self.coulomb_nm + self.static_extra_nm

    def torque_nm(self, velocity_rad_s: float) -> float:
        """Return the friction torque at a sliding speed; zero at standstill."""
        if velocity_rad_s == 0.0:
            return 0.0
        speed = abs(velocity_rad_s)
        boundary = self.static_extra_nm * math.exp(
            -((speed / self.stribeck_velocity_rad_s) ** self.exponent)
        )
        dry = math.copysign(self.coulomb_nm + boundary, velocity_rad_s)
        return dry + self.viscous_nm_s_per_rad * velocity_rad_s


@dataclass(frozen=True)
class FrictionParameters:
    """Friction of a lubricated gear, motor side, with its dependence on temperature.

    The sliding part follows the shape of A. C. Bittencourt, S. Gunnarsson, "Static friction in
    a robot joint" (ASME J. Dyn. Sys. Meas. Control 134, 2012): an exponential in speed for the
    boundary regime and a viscosity that decays exponentially with temperature.

    Parameters
    ----------
    coulomb_nm, viscous_nm_s_per_rad, static_extra_nm, stribeck_velocity_rad_s : float
        At `reference_temperature_degc`.
    exponent : float
        Shape of the Stribeck exponential.
    viscous_floor_share : float
        Share of the viscous coefficient that even hot oil keeps, 0 to 1.
    viscous_scale_degc : float
        Temperature rise over which the rest falls to 1/e.
    stribeck_velocity_per_degc : float
        Relative growth of the Stribeck velocity a degree: thin oil carries later.
    """

    coulomb_nm: float = 0.6042
    viscous_nm_s_per_rad: float = 0.0107
    static_extra_nm: float = 0.15
    stribeck_velocity_rad_s: float = 6.0
    exponent: float = 1.3
    reference_temperature_degc: float = 25.0
    viscous_floor_share: float = 0.3
    viscous_scale_degc: float = 20.0
    stribeck_velocity_per_degc: float = 0.01

    def __post_init__(self) -> None:
        require_finite(self)
        require_not_negative(
            self, "coulomb_nm", "viscous_nm_s_per_rad", "static_extra_nm", "viscous_floor_share"
        )
        require_positive(self, "stribeck_velocity_rad_s", "exponent", "viscous_scale_degc")
        if self.viscous_floor_share > 1.0:
            raise ValueError(
                f"viscous_floor_share: expected 0 to 1, got {self.viscous_floor_share}"
            )

    def truth(self, temperature_degc: float) -> FrictionTruth:
        """Return the law that acts at a gearbox temperature.

        ``viscous(T) = viscous_ref (floor + (1 - floor) exp(-(T - T_ref) / scale))``
        """
        rise = min(temperature_degc, HIGHEST_TEMPERATURE_DEGC) - self.reference_temperature_degc
        thinning = self.viscous_floor_share + (1.0 - self.viscous_floor_share) * math.exp(
            -rise / self.viscous_scale_degc
        )
        widening = max(0.1, 1.0 + self.stribeck_velocity_per_degc * rise)
        return FrictionTruth(
            coulomb_nm=self.coulomb_nm,
            viscous_nm_s_per_rad=self.viscous_nm_s_per_rad * thinning,
            static_extra_nm=self.static_extra_nm,
            stribeck_velocity_rad_s=self.stribeck_velocity_rad_s * widening,
            exponent=self.exponent,
        )
