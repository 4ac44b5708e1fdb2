"""Friction over speed, load and temperature at once, with the numbers of one ABB joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.friction import boundary_share
from agent.physics.friction_oil import thinning_share
from agent.physics.law import Law, require

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ExtendedFriction:
    """The extended law; defaults are the published joint's, torque normalised by its maximum."""

    law: ClassVar[Law] = Law(
        "extended",
        "{fc0 + fcl|l| + fsl|l| e^-(|v|/vl)^a + (fs0 + fsT T) e^-(|v|/(vs0 + vsT T))^a"
        " + (fv0 + fvT e^(-T/Tv))|v|} sign(v)",
        {
            "coulomb": "fc0, level without load (share of maximum torque)",
            "coulomb_load": "fcl, Coulomb level per load",
            "static_load": "fsl, boundary level per load",
            "load_velocity_rad_s": "vl, where the load's boundary part falls",
            "static": "fs0, boundary level at 0 degC",
            "static_per_k": "fsT, its growth with temperature",
            "stribeck_velocity_rad_s": "vs0, Stribeck velocity at 0 degC",
            "stribeck_velocity_rad_s_per_k": "vsT, its growth with temperature",
            "viscous_s_per_rad": "fv0, viscous slope when hot",
            "viscous_thermal_s_per_rad": "fvT, viscous slope that falls with temperature",
            "decay_k": "Tv, temperature rise that leaves 1/e of it",
            "exponent": "a",
            "maximum_torque_nm": "what the shares are multiplied with",
        },
        "Bittencourt & Gunnarsson, JDSMC 134 (2012) 051013 (ABB joint, gear 242.73)",
        "30 to 80 degC, load 0 to 100 % of maximum torque; clamped to these, since the Stribeck"
        " velocity turns negative below 25.3 degC",
    )
    lowest_degc: ClassVar[float] = 30.0
    highest_degc: ClassVar[float] = 80.0

    coulomb: float = 3.11e-2
    coulomb_load: float = 2.34e-2
    static_load: float = 0.126
    load_velocity_rad_s: float = 9.22
    static: float = -2.5e-2
    static_per_k: float = 1.6e-3
    stribeck_velocity_rad_s: float = -24.81
    stribeck_velocity_rad_s_per_k: float = 0.98
    viscous_s_per_rad: float = 1.3e-4
    viscous_thermal_s_per_rad: float = 1.32e-3
    decay_k: float = 20.71
    exponent: float = 1.36
    maximum_torque_nm: float = 26.0

    def __post_init__(self) -> None:
        """Refuse numbers that leave the law without a value inside its range."""
        require(self.law, self, positive="load_velocity_rad_s decay_k exponent maximum_torque_nm")
        fall = (
            self.stribeck_velocity_rad_s + self.stribeck_velocity_rad_s_per_k * self.lowest_degc,
            self.stribeck_velocity_rad_s + self.stribeck_velocity_rad_s_per_k * self.highest_degc,
        )
        if min(fall) <= 0.0:
            raise ValueError(
                f"extended: expected a Stribeck velocity above 0 from {self.lowest_degc:g} to "
                f"{self.highest_degc:g} degC, got {min(fall):.3g} rad/s"
            )

    def torque_nm(
        self, velocity_rad_s: Floats, temperature_degc: Floats, load_nm: Floats
    ) -> Floats:
        """Return the friction torque in N m, broadcast over the three arguments.

        Temperature and load outside the law's range count as the nearest inside; what does is
        found with `outside`.
        """
        speed = np.abs(velocity_rad_s)
        temperature = np.clip(temperature_degc, self.lowest_degc, self.highest_degc)
        load = np.minimum(np.abs(load_nm) / self.maximum_torque_nm, 1.0)
        fall = self.stribeck_velocity_rad_s + self.stribeck_velocity_rad_s_per_k * temperature
        loaded = self.static_load * boundary_share(speed, self.load_velocity_rad_s, self.exponent)
        boundary = self.static + self.static_per_k * temperature
        boundary = boundary * boundary_share(speed, fall, self.exponent)
        thermal = self.viscous_thermal_s_per_rad * thinning_share(temperature, 0.0, self.decay_k)
        level = (
            self.coulomb
            + (self.coulomb_load + loaded) * load
            + boundary
            + (self.viscous_s_per_rad + thermal) * speed
        )
        return np.asarray(self.maximum_torque_nm * level * np.sign(velocity_rad_s))

    def outside(self, temperature_degc: Floats, load_nm: Floats) -> NDArray[np.bool_]:
        """Return where the law's range is left and the nearest value in it was taken."""
        cold_or_hot = (temperature_degc < self.lowest_degc) | (temperature_degc > self.highest_degc)
        return np.asarray(cold_or_hot | (np.abs(load_nm) > self.maximum_torque_nm))
