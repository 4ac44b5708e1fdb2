"""Temperature of gearbox, oil and winding (thesis Appendix A and 5.3.2)."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.law import Law, require

Floats = NDArray[np.float64]

ZERO_DEGC_K = 273.15


def remaining_share(rate_per_s: Floats | float, time_s: Floats | float) -> Floats:
    """Return how much of a temperature difference is left after a time, ``exp(-r t)``, broadcast.

    The core of Newton's law of cooling (`GearboxTemperature`; no unit).
    """
    return np.asarray(np.exp(-np.multiply(rate_per_s, time_s)))


def relaxed_degc(
    rate_per_s: Floats | float,
    final_degc: Floats | float,
    start_degc: Floats | float,
    time_s: Floats | float,
) -> Floats:
    """Return the temperature on its way from a start to a lasting one, broadcast (A.1)."""
    whole = np.subtract(start_degc, final_degc)
    return np.asarray(final_degc + whole * remaining_share(rate_per_s, time_s))


def relaxation_columns(rate_per_s: float, time_s: Floats) -> Floats:
    """Return what 1 degC of lasting and of initial temperature contribute, shape (n, 2).

    `relaxed_degc` is linear in both: ``columns @ [final, start]``.
    """
    # 1 - exp(-r t) without the cancellation that a slow gearbox would suffer.
    risen = -np.expm1(-rate_per_s * time_s)
    return np.stack((risen, remaining_share(rate_per_s, time_s)), axis=-1)


def relaxation_time_s(
    rate_per_s: Floats | float,
    final_degc: Floats | float,
    start_degc: Floats | float,
    target_degc: Floats | float,
) -> Floats:
    """Return when a temperature is reached, broadcast; infinite where it never is."""
    ratio = np.subtract(target_degc, final_degc) / np.subtract(start_degc, final_degc)
    reached = (ratio > 0.0) & (ratio <= 1.0)
    return np.where(reached, -np.log(np.where(reached, ratio, 1.0)) / rate_per_s, np.inf)


def followed_k(rate_per_s: float, time_s: Floats, environment_k: Floats) -> Floats:
    """Return how far a gearbox follows its environment's changes, shape (n,), from zero.

    The environment is taken at its mean between two samples; then each step is exact (A.1).
    """
    out = np.zeros_like(time_s)
    left = remaining_share(rate_per_s, np.diff(time_s))
    middle = 0.5 * (environment_k[1:] + environment_k[:-1])
    for i in range(1, out.size):
        out[i] = middle[i - 1] + (out[i - 1] - middle[i - 1]) * left[i - 1]
    return out


@dataclass(frozen=True)
class GearboxTemperature:
    """Newton cooling towards the environment and what a repeated work cycle adds to it."""

    law: ClassVar[Law] = Law(
        "newton-cooling",
        "T(t) = Te + Tf + (T0 - Te - Tf) exp(-r t)",
        {
            "rate_per_s": "r; its reciprocal is the time constant",
            "environment_degc": "Te",
            "added_k": "Tf, what the cycle's losses add in the end (0: cooling down)",
        },
        "thesis (A.1), (A.2)",
        "one body of one temperature; losses that do not change with temperature",
    )
    rate_per_s: float
    environment_degc: float
    added_k: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what never cools."""
        require(self.law, self, positive="rate_per_s")

    @property
    def final_degc(self) -> float:
        """Return the lasting temperature, ``Te + Tf`` (A.2)."""
        return self.environment_degc + self.added_k

    def temperature_degc(self, time_s: Floats, start_degc: float) -> Floats:
        """Return the gearbox's temperature, shape (n,), from its start (A.1)."""
        return relaxed_degc(self.rate_per_s, self.final_degc, start_degc, time_s)


@dataclass(frozen=True)
class WindingResistance:
    """Copper's resistance against temperature."""

    law: ClassVar[Law] = Law(
        "winding-resistance",
        "R(T) = R20 (235 + T)/(235 + 20)",
        {"resistance_20degc_ohm": "R20"},
        "thesis (A.4); IEC 60034-1",
        "copper from -40 to 200 degC; aluminium has 225",
    )
    resistance_20degc_ohm: float

    def __post_init__(self) -> None:
        """Refuse a superconductor."""
        require(self.law, self, positive="resistance_20degc_ohm")

    def resistance_ohm(self, temperature_degc: Floats) -> Floats:
        """Return the resistance at a winding's temperature."""
        return np.asarray(self.resistance_20degc_ohm * (235.0 + temperature_degc) / 255.0)

    def temperature_degc(self, resistance_ohm: Floats) -> Floats:
        """Return the winding's temperature from its resistance."""
        return np.asarray(255.0 * resistance_ohm / self.resistance_20degc_ohm - 235.0)


@dataclass(frozen=True)
class Oil:
    """Kinematic viscosity against temperature from a data sheet's two values."""

    law: ClassVar[Law] = Law(
        "walther",
        "log10 log10(nu + 0.7) = A - B log10(T + 273.15)",
        {
            "viscosity_40degc_mm2_s": "nu at 40 degC",
            "viscosity_100degc_mm2_s": "nu at 100 degC",
        },
        "Walther (1931); ASTM D341; the oils: thesis 5.3.2",
        "mineral and synthetic base oils from the cloud point to boiling, nu above 2 mm2/s",
    )
    viscosity_40degc_mm2_s: float
    viscosity_100degc_mm2_s: float

    def __post_init__(self) -> None:
        """Refuse an oil that thickens when it warms, or is thinner than the formula holds."""
        require(self.law, self)
        if not self.viscosity_40degc_mm2_s > self.viscosity_100degc_mm2_s >= 2.0:
            raise ValueError(
                f"walther: expected viscosities of at least 2 mm2/s that fall from 40 to 100 degC, "
                f"got {self.viscosity_40degc_mm2_s} and {self.viscosity_100degc_mm2_s}"
            )

    def viscosity_mm2_s(self, temperature_degc: Floats) -> Floats:
        """Return the kinematic viscosity, of the temperature's shape."""
        known = np.array([self.viscosity_40degc_mm2_s, self.viscosity_100degc_mm2_s])
        thin, thick = np.log10(np.log10(known + 0.7))[::-1]
        warm, hot = np.log10(np.array([40.0, 100.0]) + ZERO_DEGC_K)
        slope = (thick - thin) / (hot - warm)
        distance = np.log10(np.asarray(temperature_degc) + ZERO_DEGC_K) - warm
        return np.asarray(10.0 ** (10.0 ** (thick - slope * distance)) - 0.7)


THESIS_OILS = MappingProxyType(
    {"oil 1": Oil(150.0, 18.0), "oil 2": Oil(220.0, 34.4), "oil 3": Oil(320.0, 52.7)}
)
"""The three oils of thesis 5.3.2."""


def friction_integral(velocity_rad_s: Floats, friction_nm: Floats) -> Floats:
    """Return the integral of friction curves over velocity, N m rad/s (thesis Figure A.1).

    Parameters
    ----------
    velocity_rad_s : ndarray, shape (n,)
        Rising.
    friction_nm : ndarray, shape (..., n)
        One curve a row.
    """
    if np.any(np.diff(velocity_rad_s) <= 0.0):
        raise ValueError("velocity_rad_s: expected rising values")
    return np.asarray(np.trapezoid(friction_nm, velocity_rad_s, axis=-1))


def integral_slope(temperature_degc: Floats, integral: Floats) -> float:
    """Return the straight line's slope of a friction integral, N m rad/s per kelvin."""
    if len(temperature_degc) < 2 or np.ptp(temperature_degc) == 0.0:
        raise ValueError("temperature_degc: expected at least two different temperatures")
    centred = temperature_degc - np.mean(temperature_degc)
    return float(centred @ integral / (centred @ centred))
