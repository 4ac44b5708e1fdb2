"""What a drive reports of a true torque or velocity: its constant, its limit, its delay."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.law import Law, require

Floats = NDArray[np.float64]

_LOST = 40.0 / 3.0  # 4/3 of what a torque's square is over, as a tenth is lost


@dataclass(frozen=True)
class TorqueConstant:
    """Current times a nominal constant, where the motor's real one is another."""

    law: ClassVar[Law] = Law(
        "torque-constant",
        "tau = tau_reported K [1 + p (Tm - Tr)] [1 - (tau_reported / m)^2 / 10]",
        {
            "factor": "K, real over reported torque at Tr",
            "factor_per_k": "p, its change per kelvin of the motor (NdFeB about -0.001)",
            "reference_degc": "Tr, motor temperature of K",
            "tenth_less_nm": "m, reported torque of which a tenth is not there; 0 for none",
        },
        "remanence against temperature: magnet makers' data sheets (NdFeB -0.1 %/K, ferrite -0.2);"
        " iron that saturates: the first even power of the current, as a motor turns both ways",
        "magnets below their limit; the drive reports current x constant; beyond 1.2 m of torque"
        " no current gives more",
    )
    factor: float = 1.0
    factor_per_k: float = 0.0
    reference_degc: float = 20.0
    tenth_less_nm: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a motor without torque."""
        require(self.law, self, positive="factor", not_negative="tenth_less_nm")

    def reported_nm(self, torque_nm: Floats, motor_temperature_degc: Floats | None) -> Floats:
        """Return what the drive reports for a true torque, shape (n,).

        Raises
        ------
        ValueError
            The temperatures leave no torque, or are needed and not there.
        """
        if not self.factor_per_k:
            return self._saturated_nm(torque_nm / self.factor)
        if motor_temperature_degc is None:
            raise ValueError("needs motor_temperature_degc, and none was given")
        warmer = motor_temperature_degc - self.reference_degc
        factor = self.factor * (1.0 + self.factor_per_k * warmer)
        if np.any(factor <= 0.0):
            raise ValueError("torque-constant: expected a factor above 0 at every temperature")
        return self._saturated_nm(torque_nm / factor)

    def _saturated_nm(self, torque_nm: Floats) -> Floats:
        """Return what is reported where iron saturates: the cubic's root that begins at none."""
        if not self.tenth_less_nm:
            return torque_nm
        # u - u^3/10 = w is sin(3 a) = 3 w / A of u = A sin(a), with A^2 = 40/3.
        share, size = torque_nm / self.tenth_less_nm, math.sqrt(_LOST)
        angle = np.arcsin(np.clip(3.0 * share / size, -1.0, 1.0)) / 3.0
        return np.asarray(self.tenth_less_nm * size * np.sin(angle))


def limited_nm(torque_nm: Floats, limit_nm: float) -> Floats:
    """Return ``max(-m, min(m, tau))``, shape (n,); the law is `TorqueSaturation`."""
    return np.clip(torque_nm, -limit_nm, limit_nm)


@dataclass(frozen=True)
class TorqueSaturation:
    """A drive that gives no more than its limit."""

    law: ClassVar[Law] = Law(
        "torque-saturation",
        "tau_reported = max(-m, min(m, tau))",
        {"limit_nm": "m, the drive's torque limit"},
        "IEC 61800-7-201 (CiA 402), object 6072h: maximum torque",
        "one limit in both directions, whatever the speed; no field weakening",
    )
    limit_nm: float

    def __post_init__(self) -> None:
        """Refuse a drive that gives nothing."""
        require(self.law, self, positive="limit_nm")

    def reported_nm(self, torque_nm: Floats) -> Floats:
        """Return the clipped torque, shape (n,)."""
        return limited_nm(torque_nm, self.limit_nm)


@dataclass(frozen=True)
class Delay:
    """A channel that tells now what was true a while ago."""

    law: ClassVar[Law] = Law(
        "measurement-delay",
        "y_reported(t) = y(t - d)",
        {"delay_s": "d (below zero: the other channels are the late ones)"},
        "pure transport delay, interpolated by the cubic through the four samples around",
        "a constant delay; a filter's lag is one only far below its corner",
    )
    delay_s: float

    def __post_init__(self) -> None:
        """Refuse what is not finite."""
        require(self.law, self)

    def reported(self, time_s: Floats, true: Floats) -> Floats:
        """Return what the late channel says, shape (n,); NaN where its past is not known.

        Parameters
        ----------
        time_s : ndarray, shape (n,)
            Rising, even or not.
        true : ndarray, shape (n,)
            What the channel would say without delay.
        """
        return at_times(time_s, true, time_s - self.delay_s)

    def true(self, time_s: Floats, reported: Floats) -> Floats:
        """Return what was true at the samples, shape (n,); NaN where it was never reported."""
        return at_times(time_s, reported, time_s + self.delay_s)


@dataclass(frozen=True)
class Smoothing:
    """A channel that passes a low-pass before it is told."""

    law: ClassVar[Law] = Law(
        "measurement-lag",
        "T dy/dt = x - y",
        {"lag_s": "T, the filter's time constant"},
        "a first-order low-pass, as drives and loggers have it before a torque or a current",
        "one pole; filters of a higher order are one pole and a delay far below their corner",
    )
    lag_s: float

    def __post_init__(self) -> None:
        """Refuse what is not finite, or no filter."""
        require(self.law, self, positive="lag_s")

    def reported(self, time_s: Floats, true: Floats) -> Floats:
        """Return what the channel says, shape (n,); it begins settled.

        Parameters
        ----------
        time_s : ndarray, shape (n,)
            Rising, even or not.
        true : ndarray, shape (n,)
            What the channel would say without the filter; NaN where it is not known.
        """
        from agent.physics.kernels import smoothed

        return np.asarray(smoothed(time_s, true[:, np.newaxis], self.lag_s)[:, 0])


def at_times(time_s: Floats, values: Floats, when_s: Floats) -> Floats:
    """Return values between samples by the cubic through the four around, shape of `when_s`.

    No filter, and so no phase of its own; NaN outside the samples' time.
    """
    if time_s.shape[0] < 4 or np.any(np.diff(time_s) <= 0.0):
        raise ValueError("time_s: expected at least four rising samples")
    left = np.clip(np.searchsorted(time_s, when_s, side="right") - 2, 0, time_s.shape[0] - 4)
    points = left[:, np.newaxis] + np.arange(4)
    knots, out = time_s[points], np.zeros_like(when_s)
    for k in range(4):
        others = [j for j in range(4) if j != k]
        away = np.prod(when_s[:, np.newaxis] - knots[:, others], axis=1)
        weight = away / np.prod(knots[:, [k]] - knots[:, others], axis=1)
        # A sample that is not a number spoils only what leans on it.
        out = out + np.where(weight == 0.0, 0.0, weight * values[points[:, k]])
    inside = (when_s >= time_s[0]) & (when_s <= time_s[-1])
    return np.where(inside, out, np.nan)
