"""Clearance in the gear: the dead zone (thesis 3.6) and the Nordin-Gutman gap (thesis 3.8)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.law import Law, require

Floats = NDArray[np.float64]


def dead_zone(twist_rad: Floats, half_gap_rad: float) -> Floats:
    """Return what is left of a twist outside plus and minus half the gap (thesis 3.6)."""
    return np.asarray(twist_rad - np.clip(twist_rad, -half_gap_rad, half_gap_rad))


@dataclass(frozen=True)
class DeadZone:
    """A spring that bears only outside the gap; no damping."""

    law: ClassVar[Law] = Law(
        "dead-zone",
        "tau_s = k D(x); D(x) = x - a for x > a, x + a for x < -a, else 0",
        {
            "half_gap_rad": "a, half of the lost motion",
            "stiffness_nm_per_rad": "k, of the teeth in contact",
        },
        "thesis (3.6), Figure 3.6, with the lower branch at x < -a (printed as x < a)",
        "an undamped shaft: with a damper it would pull on teeth that have parted",
    )
    half_gap_rad: float
    stiffness_nm_per_rad: float

    def __post_init__(self) -> None:
        """Refuse a gap or a spring below zero."""
        require(self.law, self, positive="stiffness_nm_per_rad", not_negative="half_gap_rad")

    def torque_nm(self, twist_rad: Floats) -> Floats:
        """Return the shaft's torque for the twist ``qm - qa``, shape (n,)."""
        return self.stiffness_nm_per_rad * dead_zone(twist_rad, self.half_gap_rad)


@dataclass(frozen=True)
class NordinGutman:
    """A damped spring in series with a gap, whose own angle is the hidden state."""

    law: ClassVar[Law] = Law(
        "nordin-gutman",
        "tau_s = k ts + c dts/dt, ts = td - tb; dtb/dt = max(0, w) at tb = -a, w inside,"
        " min(0, w) at tb = a; w = dtd/dt + (k/c)(td - tb)",
        {
            "half_gap_rad": "a, half of the lost motion",
            "stiffness_nm_per_rad": "k",
            "damping_nm_s_per_rad": "c",
        },
        "Nordin, Galic, Gutman, Int. J. Adapt. Control 11 (1997) 49; thesis (3.7), (3.8)",
        "shaft without mass; the printed (3.7) has the torque on both sides, read as its twist",
    )
    half_gap_rad: float
    stiffness_nm_per_rad: float
    damping_nm_s_per_rad: float

    def __post_init__(self) -> None:
        """Refuse what is not a damped spring behind a gap."""
        require(
            self.law,
            self,
            positive="stiffness_nm_per_rad damping_nm_s_per_rad",
            not_negative="half_gap_rad",
        )

    def gap_rad(self, time_s: Floats, twist_rad: Floats) -> Floats:
        """Return the gap's angle tb, shape (n,), for the twist ``td = qm - qa`` at the samples.

        Inside the gap the spring relaxes exactly over any step; at a wall it stays while it bears.
        """
        from agent.physics.kernels import gap_angle

        step = np.diff(time_s, prepend=time_s[:1])
        rate = self.stiffness_nm_per_rad / self.damping_nm_s_per_rad
        return np.asarray(gap_angle(twist_rad, step, float(self.half_gap_rad), float(rate)))

    def torque_nm(self, time_s: Floats, twist_rad: Floats, rate_rad_s: Floats) -> Floats:
        """Return the shaft's torque, shape (n,); zero while the teeth are parted.

        Parameters
        ----------
        time_s, twist_rad, rate_rad_s : ndarray, shape (n,)
            Samples of the twist and of its derivative.
        """
        gap = self.gap_rad(time_s, twist_rad)
        torque = self.stiffness_nm_per_rad * (twist_rad - gap)
        torque = torque + self.damping_nm_s_per_rad * rate_rad_s
        forward = np.where(gap >= self.half_gap_rad, np.maximum(torque, 0.0), 0.0)
        backward = np.where(gap <= -self.half_gap_rad, np.minimum(torque, 0.0), 0.0)
        return np.asarray(forward + backward if self.half_gap_rad > 0.0 else torque)
