"""A spring on two levers that carries an arm's weight: a balancer, with a coil or with gas."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.law import Law, require

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Balancer:
    """A spring between a pivot on the arm and one on the frame, each on its own lever.

    Between levers a and b its length is ``sqrt(a^2 + b^2 - 2 a b cos p)``, and what pulls along it
    turns the arm by ``a b sin p`` over that length. A force that grows with the length, k times it,
    is a sine of the angle, as a weight is; what it holds beside that, as the preload of a coil or
    the pressure of a gas does, is not.
    """

    law: ClassVar[Law] = Law(
        "balancer",
        "s sin(p) + b sin(p)/sqrt(1 + c^2 - 2 c cos(p)); p = q - q0, q the arm's angle",
        {
            "balancer_nm": "b, the shorter lever times the force that the spring would have at no"
            " length (below zero: one that pushes, or a coil without preload)",
            "lever_ratio": "c, the shorter lever over the longer, below 1",
            "dead_center_arm_rad": "q0, arm angle where the spring is shortest",
            "balancer_stiffness_nm": "s, both levers' product times the spring's stiffness: a sine,"
            " as a weight (0: a force that its length does not change)",
        },
        "the law of cosines, and the virtual work of a force along the length",
        "one spring without friction, linear or of constant force; gas as one that is long enough",
    )
    balancer_nm: float
    lever_ratio: float
    dead_center_arm_rad: float
    balancer_stiffness_nm: float = 0.0

    def __post_init__(self) -> None:
        """Refuse levers that are none, and a spring that gives way the further it is drawn."""
        require(self.law, self, positive="lever_ratio", not_negative="balancer_stiffness_nm")
        if self.lever_ratio >= 1.0:  # of equal levers the spring has no length at its dead center
            raise ValueError(
                f"{self.law.id}: lever_ratio: expected a number below 1, got {self.lever_ratio}"
            )

    def torque_nm(self, arm_rad: Floats) -> Floats:
        """Return what the motor needs against it, shape (n,), on the motor side."""
        beside = balancer_share(arm_rad, self.lever_ratio, self.dead_center_arm_rad)
        sine = np.sin(arm_rad - self.dead_center_arm_rad)
        return np.asarray(self.balancer_nm * beside + self.balancer_stiffness_nm * sine)


def balancer_share(
    arm_rad: Floats, lever_ratio: float, dead_center_arm_rad: float | Floats
) -> Floats:
    """Return ``sin(p)/sqrt(1 + c^2 - 2 c cos(p))``, never beyond 1 in size, shape (n,).

    Dead centers of shape (k, 1) give as many rows, shape (k, n).
    """
    past = arm_rad - dead_center_arm_rad
    length = np.sqrt(1.0 + lever_ratio**2 - 2.0 * lever_ratio * np.cos(past))
    return np.asarray(np.sin(past) / length)
