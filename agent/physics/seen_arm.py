"""An arm of which an encoder of its own says where it is, so that nothing has to be simulated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.derivative import bend_over
from agent.physics.law import Law, require

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SeenArm:
    """An arm behind whatever gear: that gear carries what the arm's own motion needs."""

    law: ClassVar[Law] = Law(
        "seen-arm",
        "tau_s - Ja a = Ja d2x/dt2, x = N qa(t + s) - q(t)",
        {
            "arm_inertia_kg_m2": "Ja, of the arm, seen from the motor",
            "encoder_late_s": "s, by how much the arm's encoder is later than the motor's",
        },
        "Newton's second law of the arm, as in thesis (3.3), its angle measured",
        "friction and weight as a stiff gear has them: motor and arm are never far apart",
    )
    arm_inertia_kg_m2: float
    encoder_late_s: float

    def __post_init__(self) -> None:
        """Refuse an arm without inertia."""
        require(self.law, self, positive="arm_inertia_kg_m2")

    def extra_nm(self, time_s: Floats, arm_rad: Floats, motor_rad: Floats) -> Floats:
        """Return what the arm's own motion adds to the torque of a stiff gear, shape (n,).

        Nothing where the late encoder's value has not been recorded, or not yet.

        Parameters
        ----------
        time_s, arm_rad, motor_rad : ndarray, shape (n,)
            Samples of both angles, that of the arm seen from the motor: ``N qa`` and ``q``.
        """
        from scipy.interpolate import CubicSpline

        then = time_s + self.encoder_late_s
        if self.encoder_late_s and time_s.shape[0] > 1:
            arm_rad = CubicSpline(time_s, arm_rad)(np.clip(then, time_s[0], time_s[-1]))
        out = self.arm_inertia_kg_m2 * bend_over(time_s, arm_rad - motor_rad)
        return np.where((then > time_s[0]) & (then < time_s[-1]), out, 0.0)
