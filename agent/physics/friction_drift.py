"""Friction that changes with the clock or with use, not with temperature: drift and running-in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.law import Law, require

Floats = NDArray[np.float64]

_SLACK_S = 1.0  # a label's rounding: two recordings of one axis do not begin within it
_SOURCE = "first-order description, no law of wear: LiTH-ISY-R-3058 scales wear, but has no rates"


def _levels_nm(coulomb: float, viscous: float, velocity: Floats, direction: Floats) -> Floats:
    """Return the torque of a Coulomb level and a viscous slope, shape (n,)."""
    return np.asarray(coulomb * direction + viscous * velocity)


def come_share(since: Floats, settling: float) -> Floats:
    """Return which share of a change has come, ``1 - exp(-(t - t0)/th)``, shape (n,); `RunIn`."""
    return np.asarray(-np.expm1(-np.asarray(since) / settling))


def coming_share(since: Floats, settling: float) -> Floats:
    """Return which share of a change is still to come, ``exp(-(t - t0)/th)``; see `come_share`."""
    return np.asarray(np.exp(-np.asarray(since) / settling))


@dataclass(frozen=True)
class LinearDrift:
    """Levels that rise or fall evenly with hours, runs, operating hours or turns."""

    law: ClassVar[Law] = Law(
        "linear-drift",
        "(dc sign(v) + dv v)(t - t0)",
        {
            "coulomb_nm_per_step": "dc, change of the Coulomb level per hour, run or unit of use",
            "viscous_nm_s_per_rad_per_step": "dv, that of the viscous slope",
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
            Hours, runs or use since the reference; below zero before it.
        """
        own = self.coulomb_nm_per_step, self.viscous_nm_s_per_rad_per_step
        return np.asarray(_levels_nm(*own, velocity_rad_s, direction) * since)


@dataclass(frozen=True)
class LevelStep:
    """Levels that are others from an instant on: new grease, a repair, a seal that has gone."""

    law: ClassVar[Law] = Law(
        "level-step",
        "dc sign(v) + dv v, t >= t0",
        {
            "coulomb_step_nm": "dc, by how much the Coulomb level is another from then on",
            "viscous_step_nm_s_per_rad": "dv, the same of the viscous slope",
        },
        _SOURCE,
        "one change, and all at once; what made it is not in the recordings",
    )
    coulomb_step_nm: float = 0.0
    viscous_step_nm_s_per_rad: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is not finite."""
        require(self.law, self)

    def torque_nm(self, velocity_rad_s: Floats, direction: Floats, since: Floats) -> Floats:
        """Return what has been added, shape (n,).

        Parameters
        ----------
        velocity_rad_s, direction : ndarray, shape (n,)
        since : ndarray, broadcast to (n,)
            Time since the instant, in any unit; below zero before it.
        """
        own = self.coulomb_step_nm, self.viscous_step_nm_s_per_rad
        return np.asarray(_levels_nm(*own, velocity_rad_s, direction) * (np.asarray(since) >= 0.0))


@dataclass(frozen=True)
class RunIn:
    """Levels that settle at new values after a reference instant: running-in, new grease."""

    law: ClassVar[Law] = Law(
        "run-in",
        "(dc sign(v) + dv v)(1 - exp(-(t - t0)/th)), t >= t0",
        {
            "coulomb_change_nm": "dc, change of the Coulomb level in the end",
            "viscous_change_nm_s_per_rad": "dv, change of the viscous slope in the end",
            "settling_h": "th, hours, or use, after which 1/e of the change is still to come",
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

        `since_h` is in the unit of `settling_h`: hours, or use.

        Raises
        ------
        ValueError
            A time before the reference: the law would grow without bound backwards.
        """
        if np.any(np.asarray(since_h) < 0.0):
            raise ValueError("run-in: expected a recording that starts after reference_started_at")
        own = self.coulomb_change_nm, self.viscous_change_nm_s_per_rad
        done = come_share(since_h, self.settling_h)
        return np.asarray(_levels_nm(*own, velocity_rad_s, direction) * done)


@dataclass(frozen=True)
class Odometer:
    """How much a joint had been used when recordings began, as far as it was recorded.

    A drive's hour meter runs while its power stage is on, and wear of a bearing goes by its turns
    (Archard, J. Appl. Phys. 24 (1953) 981: worn volume in proportion to the path that is slid).
    What the joint did while nobody recorded is not in it.

    Parameters
    ----------
    recorded_from_unix_s : tuple of float
        When recordings began, in their order, and when the last of them ended.
    reading : tuple of float
        What the odometer showed at these instants; from 0, in any unit of use.
    """

    recorded_from_unix_s: tuple[float, ...]
    reading: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse an odometer that runs backwards, or has not one reading for every instant."""
        if len(self.recorded_from_unix_s) != len(self.reading) or not self.reading:
            raise ValueError(
                f"odometer: expected a reading for each of {len(self.recorded_from_unix_s)} "
                f"instants in recorded_from, got {len(self.reading)}"
            )
        if np.any(np.diff(self.recorded_from_unix_s) < 0.0) or np.any(np.diff(self.reading) < 0.0):
            raise ValueError("odometer: expected instants and readings that do not fall")

    def at(self, started_unix_s: float) -> float:
        """Return the reading when a recording begins.

        One that lies between others begins with what the next of them began with. Beyond the last
        nothing is known to have been added, before the first nothing to have been missing.
        """
        instants = np.asarray(self.recorded_from_unix_s)
        index = int(np.searchsorted(instants, started_unix_s - _SLACK_S))
        return self.reading[min(index, len(self.reading) - 1)]
