"""Torques at one place or along the arm's angle that are no friction: hoses, cables, bumps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.friction_dynamic import Dahl
from agent.physics.friction_place import BELL, AtAPlace, away_from
from agent.physics.law import Law, require

Floats = NDArray[np.float64]

_FURTHEST = 50.0  # angles of stiffening: beyond, a number has no meaning, and overflows soon


@dataclass(frozen=True)
class CableForce:
    """Hoses and cables that pull the arm back; their inner friction may lag behind."""

    law: ClassVar[Law] = Law(
        "cable-force",
        "k w sinh(d/w) + c d^3 + tau_h; d = q - q0 beyond the slack;"
        " dtau_h/dq = (h/x)(1 - tau_h sign(v)/h)",
        {
            "stiffness_nm_per_arm_rad": "k, motor torque per arm angle",
            "neutral_arm_rad": "q0, arm angle where the bundle hangs free",
            "cubic_nm_per_arm_rad3": "c, by which it stiffens when drawn taut (0: a plain spring)",
            "hysteresis_nm": "h, what its inner friction holds (0: a spring without loss)",
            "hysteresis_travel_arm_rad": "x, arm travel after a reversal that leaves 1/e of h",
            "slack_below_arm_rad": "how far below q0 it hangs free as well",
            "slack_above_arm_rad": "how far above q0 it hangs free as well",
            "stiffening_arm_rad": "w, drawn so far it is 1.5 times as stiff, and e times as stiff"
            " for every such angle further on (0: a plain spring, k d)",
        },
        "Dahl's law in the arm's angle for the hysteresis: Dahl, Aerospace Corp. TOR-0158 (1968)",
        "one posture of the other axes; stiffens alike to both sides; starts without hysteresis",
    )
    stiffness_nm_per_arm_rad: float
    neutral_arm_rad: float = 0.0
    hysteresis_nm: float = 0.0
    hysteresis_travel_arm_rad: float = 1.0
    cubic_nm_per_arm_rad3: float = 0.0
    slack_below_arm_rad: float = 0.0
    slack_above_arm_rad: float = 0.0
    stiffening_arm_rad: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a bundle that pushes on, and a loss that is none."""
        require(
            self.law,
            self,
            positive="hysteresis_travel_arm_rad",
            not_negative="stiffness_nm_per_arm_rad cubic_nm_per_arm_rad3 hysteresis_nm"
            " slack_below_arm_rad slack_above_arm_rad stiffening_arm_rad",
        )

    def spring_nm(self, arm_rad: Floats) -> Floats:
        """Return the elastic part, shape (n,), on the motor side."""
        away = beyond_slack(
            arm_rad - self.neutral_arm_rad, self.slack_below_arm_rad, self.slack_above_arm_rad
        )
        drawn = stiffening(away, self.stiffening_arm_rad) if self.stiffening_arm_rad else away
        return self.stiffness_nm_per_arm_rad * drawn + self.cubic_nm_per_arm_rad3 * away**3

    def hysteresis_part_nm(self, time_s: Floats, arm_velocity_rad_s: Floats) -> Floats:
        """Return what the bundle's inner friction adds, shape (n,), on the motor side."""
        if self.hysteresis_nm == 0.0:
            return np.zeros_like(arm_velocity_rad_s)
        slope = self.hysteresis_nm / self.hysteresis_travel_arm_rad
        return Dahl(self.hysteresis_nm, slope).torque_nm(time_s, arm_velocity_rad_s)


def stiffening(away_rad: Floats, every_rad: float) -> Floats:
    """Return the pull of a bundle of stiffness 1 that is stiffer the further it is drawn, (n,)."""
    return np.asarray(every_rad * np.sinh(np.clip(away_rad / every_rad, -_FURTHEST, _FURTHEST)))


def beyond_slack(away_rad: Floats, below_rad: float, above_rad: float) -> Floats:
    """Return how far a bundle is drawn beyond where it hangs free, shape (n,)."""
    drawn = np.maximum(away_rad - above_rad, 0.0) + np.minimum(away_rad + below_rad, 0.0)
    return np.asarray(drawn)


@dataclass(frozen=True)
class LocalFault(AtAPlace):
    """A torque at one place of the arm that does not turn with the direction of motion."""

    law: ClassVar[Law] = Law(
        "local-fault",
        "h exp(-|(q - q0)/w|^p/2), q the arm's angle",
        {"height_nm": "h, torque at the place's middle, in its sign", **BELL},
        "a bell as the shape of a chipped tooth, dent or rubbing hose: our own choice",
        "one place of the travel, or one in every period, as a tooth of a gear that goes round has:"
        " q0 is then the nearest of its returns",
    )
    height_nm: float
    center_arm_rad: float
    width_arm_rad: float
    period_arm_rad: float = 0.0
    width_above_arm_rad: float = 0.0
    shape_exponent: float = 2.0

    def torque_nm(self, arm_rad: Floats) -> Floats:
        """Return the bump, shape (n,)."""
        return self.height_nm * self.share(arm_rad)


@dataclass(frozen=True)
class Dent:
    """A place that holds back what enters it from either side: first against the motion, then with.

    Its torque is the slope of a bell: of a bump that the arm rolls over, or of a dent.
    """

    law: ClassVar[Law] = Law(
        "dent",
        "h ((q - q0)/w) exp(1/2 - ((q - q0)/w)^2/2), q the arm's angle",
        {
            "dent_nm": "h, greatest torque, above the place in its sign and below against it",
            "center_arm_rad": "q0, its place",
            "width_arm_rad": "w, how far from its place the torque is greatest",
            "period_arm_rad": "P, arm travel after which it comes again (0: one place)",
        },
        "the slope of a bell-shaped potential, as a rolling element over a dent: our own choice",
        "takes no energy: what is also rubbed there is friction",
    )
    dent_nm: float
    center_arm_rad: float
    width_arm_rad: float
    period_arm_rad: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a place without a width."""
        require(self.law, self, positive="width_arm_rad", not_negative="period_arm_rad")

    def torque_nm(self, arm_rad: Floats) -> Floats:
        """Return the torque, shape (n,)."""
        place = self.center_arm_rad, self.width_arm_rad, self.period_arm_rad
        return self.dent_nm * dent_share(arm_rad, *place)


def dent_share(
    arm_rad: Floats, center_arm_rad: float, width_arm_rad: float, period_arm_rad: float = 0.0
) -> Floats:
    """Return ``d exp(1/2 - d^2/2)``, d the way from the place over the width: -1 to 1, (n,)."""
    way = away_from(arm_rad, center_arm_rad, period_arm_rad) / width_arm_rad
    return np.asarray(way * np.exp(0.5 - 0.5 * way**2))
