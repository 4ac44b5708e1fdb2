"""Friction that changes with running time or use, not with temperature: drift and running-in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.law import Law, require

Floats = NDArray[np.float64]

_SOURCE = "first-order description, no law of wear: LiTH-ISY-R-3058 scales wear, but has no rates"


@dataclass(frozen=True)
class LinearDrift:
    """Levels that rise or fall evenly with hours, or with runs."""

    law: ClassVar[Law] = Law(
        "linear-drift",
        "(dc sign(v) + dv v)(t - t0)",
        {
            "coulomb_nm_per_step": "dc, change of the Coulomb level per hour or run",
            "viscous_nm_s_per_rad_per_step": "dv, change of the viscous slope per hour or run",
        },
        _SOURCE,
        "a straight line has no end: believed only about as far beyond the data as they reach",
    )
    coulomb_nm_per_step: float = 0.0
    viscous_nm_s_per_rad_per_step: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is not finite."""
        require(self.law, self)

    def torque_nm(self, velocity_rad_s: Floats, direction: Floats, since: Floats) -> Floats:
        """Return what has been added since the reference, shape (n,).

        Parameters
        ----------
        velocity_rad_s, direction : ndarray, shape (n,)
        since : ndarray, broadcast to (n,)
            Hours or runs since the reference; below zero before it.
        """
        slope = self.viscous_nm_s_per_rad_per_step * velocity_rad_s
        return np.asarray((self.coulomb_nm_per_step * direction + slope) * since)


@dataclass(frozen=True)
class RunIn:
    """Levels that settle at new values after a reference instant: running-in, new grease."""

    law: ClassVar[Law] = Law(
        "run-in",
        "(dc sign(v) + dv v)(1 - exp(-(t - t0)/th)), t >= t0",
        {
            "coulomb_change_nm": "dc, change of the Coulomb level in the end",
            "viscous_change_nm_s_per_rad": "dv, change of the viscous slope in the end",
            "settling_h": "th, hours after which 1/e of the change is still to come",
        },
        _SOURCE,
        "one change that settles; nothing is said of the time before its reference",
    )
    coulomb_change_nm: float = 0.0
    viscous_change_nm_s_per_rad: float = 0.0
    settling_h: float = 1.0

    def __post_init__(self) -> None:
        """Refuse a change that never settles."""
        require(self.law, self, positive="settling_h")

    def torque_nm(self, velocity_rad_s: Floats, direction: Floats, since_h: Floats) -> Floats:
        """Return what has been added since the reference, shape (n,).

        Raises
        ------
        ValueError
            A time before the reference: the law would grow without bound backwards.
        """
        if np.any(np.asarray(since_h) < 0.0):
            raise ValueError("run-in: expected a recording that starts after reference_started_at")
        slope = self.viscous_change_nm_s_per_rad * velocity_rad_s
        done = -np.expm1(-np.asarray(since_h) / self.settling_h)
        return np.asarray((self.coulomb_change_nm * direction + slope) * done)
