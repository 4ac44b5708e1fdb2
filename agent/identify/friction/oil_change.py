"""What a joint's friction would be with another oil, read off the surface of the oil in use.

A film's friction depends on the oil's viscosity and the speed, so a joint with another oil at one
temperature has the friction that it has with its own oil at the temperature of equal kinematic
viscosity (Walther / ASTM D341, `agent.physics.thermal.Oil`). No new law is fitted: the measured
surface is read at that temperature, and only inside the temperatures that were measured.

What this assumes: equal density and additives, so that the Coulomb level and the boundary film
stay; gears and seals, whose friction is no film's, warm along with the oil. Thesis appendix A is
a check on it: its friction integral falls 20.53/15.09 = 1.36 and 22.89/15.09 = 1.52 times as
steeply with oils 2 and 3 as with oil 1, where their viscosities over 24 to 50 degC say 1.15 and
1.57. So the order of the oils and the size of the change hold, to about a fifth.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agent.identify.friction.surface import Surface
from agent.identify.result import Floats
from agent.physics.thermal import Oil

ASSUMPTION = (
    "assumes that temperature and oil change friction through viscosity alone, with density and "
    "additives alike; on the thesis's oils that holds to about a fifth"
)
_COLDEST_DEGC, _HOTTEST_DEGC, _STEP_DEGC = -20.0, 150.0, 0.02
_MARGIN_DEGC = 0.5


@dataclass(frozen=True)
class OilCurve:
    """The friction curve that one oil would give at the comparison's temperature.

    Parameters
    ----------
    name : str
    in_use : bool
        Whether it is the oil of the measurements.
    equivalent_degc : float
        Temperature at which the oil in use is as thick.
    friction_nm : ndarray, shape (n,)
        At the comparison's speeds; empty where `reason` says why there is none.
    ci95_nm : ndarray, shape (n, 2)
        Of the surface; the assumption is not in it.
    reason : str
    """

    name: str
    in_use: bool
    equivalent_degc: float
    friction_nm: Floats = field(default_factory=lambda: np.empty(0))
    ci95_nm: Floats = field(default_factory=lambda: np.empty((0, 2)))
    reason: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "name": self.name,
            "in_use": self.in_use,
            "equivalent_degc": self.equivalent_degc,
            "friction_nm": self.friction_nm.tolist(),
            "ci95_nm": self.ci95_nm.tolist(),
            "reason": self.reason,
        }


@dataclass(frozen=True)
class OilComparison:
    """Several oils in one joint at one temperature, over `speed_rad_s`, shape (n,)."""

    temperature_degc: float
    speed_rad_s: Floats
    curves: tuple[OilCurve, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "temperature_degc": self.temperature_degc,
            "speed_rad_s": self.speed_rad_s.tolist(),
            "oils": [curve.to_json() for curve in self.curves],
            "assumption": ASSUMPTION,
        }


def equivalent_degc(own: Oil, other: Oil, temperature_degc: float) -> float:
    """Return the temperature at which `own` is as thick as `other` is at a temperature.

    Infinite, with its sign, where that lies beyond what an oil's law is good for.
    """
    grid = np.arange(_COLDEST_DEGC, _HOTTEST_DEGC + _STEP_DEGC, _STEP_DEGC)
    viscosity = own.viscosity_mm2_s(grid)
    wanted = float(other.viscosity_mm2_s(np.array(temperature_degc)))
    if not viscosity[-1] <= wanted <= viscosity[0]:
        return math.copysign(math.inf, viscosity[0] - wanted)
    return float(np.interp(-math.log(wanted), -np.log(viscosity), grid))


def compare_oils(
    surface: Surface,
    own_name: str,
    oils: Mapping[str, Oil],
    speed_rad_s: Floats,
    candidates_degc: Floats,
) -> OilComparison:
    """Predict the friction curve with every oil, at the temperature that shows most of them.

    Parameters
    ----------
    surface : Surface
        With a temperature law, of the oil in use.
    own_name : str
        Which of the oils that is.
    oils : mapping of str to Oil
    speed_rad_s : ndarray, shape (n,)
        Above zero.
    candidates_degc : ndarray, shape (k,)
        Temperatures to choose from: those that were measured, so that points lie on the curve.

    Raises
    ------
    ValueError
        The surface has no temperature law, or the oil in use is none of the oils.
    """
    if not surface.identified:
        raise ValueError(f"expected a surface with a temperature law: {surface.reason}")
    if own_name not in oils:
        raise ValueError(f"expected one of {', '.join(oils)}, got {own_name}")
    own, (low, high) = oils[own_name], surface.measured_degc

    def seen(temperature: float) -> int:
        at = [equivalent_degc(own, oil, temperature) for oil in oils.values()]
        return sum(low - _MARGIN_DEGC <= t <= high + _MARGIN_DEGC for t in at)

    middle = 0.5 * (low + high)
    best = float(max(candidates_degc, key=lambda t: (seen(float(t)), -abs(float(t) - middle))))
    curves = [
        _curve(surface, name, name == own_name, equivalent_degc(own, oil, best), speed_rad_s)
        for name, oil in oils.items()
    ]
    return OilComparison(best, speed_rad_s, tuple(curves))


def _curve(
    surface: Surface, name: str, in_use: bool, at_degc: float, speed_rad_s: Floats
) -> OilCurve:
    low, high = surface.measured_degc
    if not low - _MARGIN_DEGC <= at_degc <= high + _MARGIN_DEGC:
        thick = "thicker" if at_degc < low else "thinner"
        end = "colder" if at_degc < low else "warmer"
        return OilCurve(
            name,
            in_use,
            at_degc,
            reason=f"not identified: it is {thick} than the oil was in any recording; record {end}",
        )
    temperature = np.full_like(speed_rad_s, at_degc)
    return OilCurve(
        name,
        in_use,
        at_degc,
        surface.friction_nm(speed_rad_s, temperature),
        surface.friction_ci95_nm(speed_rad_s, temperature),
    )
