"""Friction that changes with the place of the arm: along a turn, or at one spot.

Torques oppose motion with the sign of the velocity (motor side) and are zero at rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.law import Law, require
from agent.physics.periodic import wave

Floats = NDArray[np.float64]


BELL: Mapping[str, str] = {
    "center_arm_rad": "q0, its place",
    "width_arm_rad": "w, half of its width at 61 % of its height",
    "period_arm_rad": "P, arm travel after which it comes again (0: one place)",
    "width_above_arm_rad": "w at angles above q0, where it leans to a side (0: the same)",
    "shape_exponent": "p: 2 is a bell, more has a flat top and steep flanks, less a sharp peak",
}
"""What says where a place is, and of which shape."""


class AtAPlace:
    """What the laws of a place have in common: a bell along the arm, whatever it weighs there."""

    law: ClassVar[Law]
    center_arm_rad: float
    width_arm_rad: float
    period_arm_rad: float
    width_above_arm_rad: float
    shape_exponent: float

    def __post_init__(self) -> None:
        """Refuse a place without a width."""
        positive = "width_arm_rad shape_exponent"
        require(
            self.law, self, positive=positive, not_negative="period_arm_rad width_above_arm_rad"
        )

    def share(self, arm_rad: Floats) -> Floats:
        """Return the bell, from 1 at the place to 0 far from it, shape (n,)."""
        return bump_share(
            arm_rad,
            self.center_arm_rad,
            self.width_arm_rad,
            self.period_arm_rad,
            self.width_above_arm_rad,
            self.shape_exponent,
        )


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
        "one order; the modulation must stay below the Coulomb level, or friction would drive;"
        " a twin has it where it passes slower than half the sampling rate",
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
class TightSpot(AtAPlace):
    """More (or less) friction near one place of the arm."""

    law: ClassVar[Law] = Law(
        "tight-spot",
        "h exp(-|(q - q0)/w|^p/2) sign(v), q the arm's angle",
        {"height_nm": "h, what the friction level has more at the place's middle", **BELL},
        "Armstrong-Helouvry, Control of Machines with Friction (1991), chapter 4, as one bump; its"
        " shape is our own choice",
        "one place, or one in every period: q0 is then the nearest of its returns; a dent deeper"
        " than the Coulomb level would drive",
    )
    height_nm: float
    center_arm_rad: float
    width_arm_rad: float
    period_arm_rad: float = 0.0
    width_above_arm_rad: float = 0.0
    shape_exponent: float = 2.0

    def torque_nm(self, arm_rad: Floats, direction: Floats) -> Floats:
        """Return the bump of friction, shape (n,)."""
        return self.height_nm * self.share(arm_rad) * direction


def away_from(arm_rad: Floats, center_arm_rad: float, period_arm_rad: float = 0.0) -> Floats:
    """Return the way from a place, to the nearest of its returns where it has a period, (n,)."""
    away = arm_rad - center_arm_rad
    if period_arm_rad:
        away = away - period_arm_rad * np.round(away / period_arm_rad)
    return np.asarray(away)


def bump_share(
    arm_rad: Floats,
    center_arm_rad: float,
    width_arm_rad: float,
    period_arm_rad: float = 0.0,
    width_above_arm_rad: float = 0.0,
    shape_exponent: float = 2.0,
) -> Floats:
    """Return the bell ``exp(-|(q - q0)/w|^p/2)``, from 1 at the place to 0 far from it, (n,).

    With a width of its own above the place it leans; the greater p, the flatter its top and the
    steeper its flanks.
    """
    away = away_from(arm_rad, center_arm_rad, period_arm_rad)
    above = width_above_arm_rad or width_arm_rad
    ways = np.where(away > 0.0, away / above, -away / width_arm_rad)
    powers = ways**2 if shape_exponent == 2.0 else ways**shape_exponent
    return np.asarray(np.exp(-0.5 * powers))
