"""What repeats with position: torque ripple and cogging, kinematic error, resolver error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.law import Law, require

Floats = NDArray[np.float64]


def wave(cos: float, sin: float, order: float, angle_rad: Floats, derivative: int = 0) -> Floats:
    """Return ``cos cos(n q) + sin sin(n q)``, or its n-th derivative by the angle."""
    phase = order * angle_rad + derivative * (0.5 * np.pi)
    return np.asarray(order**derivative * (cos * np.cos(phase) + sin * np.sin(phase)))


def followed(order: float, velocity_rad_s: Floats, period_s: float) -> Floats:
    """Return 1 where samples can follow a wave along the motion, else 0, shape (n,).

    What passes faster than half the sampling rate would come out as a slower wave that no joint
    makes. Nor does the motor's torque hold it in the joint: the loop is slower, and inertia bears
    it.

    Parameters
    ----------
    order : float
        Periods per turn of the motor.
    velocity_rad_s : ndarray, shape (n,)
    period_s : float
        Between samples; 0 where it is not known, and all is followed.
    """
    return np.asarray(np.abs(order * velocity_rad_s) * period_s < np.pi, dtype=np.float64)


def wave_rates(
    order: float, cosine: Floats, sine: Floats, velocity_rad_s: Floats, acceleration_rad_s2: Floats
) -> tuple[Floats, Floats]:
    """Return ``e'(q) a + e''(q) v^2`` of ``cos(n q)`` and of ``sin(n q)``, each shape (n,).

    Their second derivatives by time along a motion: what `KinematicError.shaking` and
    `ResolverError.true_motion` make of any sum of the two, for searches that have both at hand.
    """
    square = velocity_rad_s**2
    return (
        -order * sine * acceleration_rad_s2 - order**2 * cosine * square,
        order * cosine * acceleration_rad_s2 - order**2 * sine * square,
    )


@dataclass(frozen=True)
class TorqueRipple:
    """Torque at one order of the motor's turn: cogging, or in proportion to torque."""

    law: ClassVar[Law] = Law(
        "torque-ripple",
        "[c cos(n q) + s sin(n q)] (1 + p |tau|) + [a cos(n q) + b sin(n q)] tau",
        {
            "cos_nm": "c",
            "sin_nm": "s",
            "order_per_motor_rev": "n, periods per motor turn",
            "load_growth_per_nm": "p, growth with motor torque (0: cogging, magnets on slots)",
            "cos_share": "a, of the torque: phases whose gains differ, harmonics of the flux",
            "sin_share": "b, likewise",
        },
        "thesis 3.2 (torque ripple); Holtz & Springob, IEEE TIE 43 (1996)",
        "one order each; orders of the slots and pole pairs, whatever the speed;"
        " a twin has it where it passes slower than half the sampling rate",
    )
    cos_nm: float
    sin_nm: float
    order_per_motor_rev: float
    load_growth_per_nm: float = 0.0
    cos_share: float = 0.0
    sin_share: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what has no period."""
        require(self.law, self, positive="order_per_motor_rev", not_negative="load_growth_per_nm")

    def torque_nm(self, position_rad: Floats, torque_nm: Floats | float = 0.0) -> Floats:
        """Return the ripple, shape (n,), at motor angles, for a motor torque."""
        ripple = wave(self.cos_nm, self.sin_nm, self.order_per_motor_rev, position_rad)
        share = wave(self.cos_share, self.sin_share, self.order_per_motor_rev, position_rad)
        return np.asarray(
            ripple * (1.0 + self.load_growth_per_nm * np.abs(torque_nm)) + share * torque_nm
        )


@dataclass(frozen=True)
class KinematicError:
    """A gear whose ratio wobbles: the arm follows ``q + e(q)``."""

    law: ClassVar[Law] = Law(
        "kinematic-error",
        "tau = (1 + e') {Ja [(1 + e') a + e'' v^2] + l}, e(q) = c cos(n q) + s sin(n q)",
        {
            "cos_rad": "c, on the motor side (arm error times N)",
            "sin_rad": "s, likewise",
            "order_per_motor_rev": "n, periods per motor turn",
            "arm_inertia_kg_m2": "Ja, seen by the motor",
        },
        "Lagrange's equation of an inertia behind q + e(q); Tuttle & Seering, IEEE TRA 12 (1996)",
        "a stiff gear, or one spring through which the wobble shakes the arm; n e far below 1; l is"
        " what the gear carries beside Ja: the weight and the arm's friction;"
        " a twin has it where it passes slower than half the sampling rate",
    )
    cos_rad: float
    sin_rad: float
    order_per_motor_rev: float
    arm_inertia_kg_m2: float

    def __post_init__(self) -> None:
        """Refuse a gear that would turn backwards."""
        require(self.law, self, positive="order_per_motor_rev", not_negative="arm_inertia_kg_m2")
        if self.order_per_motor_rev * np.hypot(self.cos_rad, self.sin_rad) >= 1.0:
            raise ValueError("kinematic-error: expected order times amplitude below 1")

    def arm_rad(self, position_rad: Floats) -> Floats:
        """Return the arm's angle on the motor side, ``q + e(q)``, shape (n,)."""
        return position_rad + self._error(position_rad, 0)

    def torque_nm(
        self,
        position_rad: Floats,
        velocity_rad_s: Floats,
        acceleration_rad_s2: Floats,
        load_nm: Floats | float = 0.0,
        shaken_nm: Floats | None = None,
        seen: Floats | float = 1.0,
    ) -> Floats:
        """Return what the wobble adds to the torque ``Ja a + l`` of a true gear, shape (n,).

        Parameters
        ----------
        position_rad, velocity_rad_s, acceleration_rad_s2 : ndarray, shape (n,)
            Of the motor.
        load_nm : ndarray, shape (n,), optional
            What the gear carries beside the inertia, seen by the motor: weight, the arm's friction.
        shaken_nm : ndarray, shape (n,), optional
            What the gear's spring bears of the arm that is shaken by e(q); all of it, ``Ja`` times
            the second derivative of e by time, where the gear is stiff.
        seen : ndarray, shape (n,), optional
            Where the wobble is `followed`.
        """
        ratio = 1.0 + seen * self._error(position_rad, 1)
        if shaken_nm is not None:
            borne = self.arm_inertia_kg_m2 * acceleration_rad_s2 + load_nm
            return np.asarray(ratio * shaken_nm + (ratio - 1.0) * borne)
        bend = seen * self._error(position_rad, 2) * velocity_rad_s**2
        wobbling = ratio * (ratio * acceleration_rad_s2 + bend)
        shaken = self.arm_inertia_kg_m2 * (wobbling - acceleration_rad_s2)
        return np.asarray(shaken + (ratio - 1.0) * load_nm)

    def shaking(
        self,
        position_rad: Floats,
        velocity_rad_s: Floats,
        acceleration_rad_s2: Floats,
        seen: Floats | float = 1.0,
    ) -> tuple[Floats, Floats, Floats]:
        """Return e(q) and its first two derivatives by time along a motion, each shape (n,)."""
        return _along(self._error, position_rad, velocity_rad_s, acceleration_rad_s2, seen)

    def _error(self, position_rad: Floats, derivative: int) -> Floats:
        return wave(self.cos_rad, self.sin_rad, self.order_per_motor_rev, position_rad, derivative)


@dataclass(frozen=True)
class ResolverError:
    """A measured angle that is wrong by a sum of sinusoids of itself."""

    law: ClassVar[Law] = Law(
        "resolver-error",
        "q_true = q - sum_i [c_i cos(n_i q) + s_i sin(n_i q)]",
        {
            "cos_rad": "c_i, one each",
            "sin_rad": "s_i, one each",
            "order_per_motor_rev": "n_i, periods per motor turn",
        },
        "thesis 3.2 (measurement inaccuracies: a sum of sinusoids); Hanselman, IEEE TIE 37 (1990)",
        "a function of the measured angle alone; the converter's lag is another matter; a stiff"
        " gear, or one spring on which the arm lags behind the motor that the error shakes;"
        " a twin has it where it passes slower than half the sampling rate",
    )
    cos_rad: tuple[float, ...]
    sin_rad: tuple[float, ...]
    order_per_motor_rev: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse sums of unequal length and an angle that would run backwards."""
        terms = (self.cos_rad, self.sin_rad, self.order_per_motor_rev)
        if len({len(t) for t in terms}) != 1 or not np.all(np.isfinite(np.array(terms))):
            raise ValueError(f"resolver-error: expected as many finite c, s and n, got {terms}")
        steepest = sum(n * np.hypot(c, s) for c, s, n in zip(*terms, strict=True))
        if min(self.order_per_motor_rev, default=1.0) <= 0.0 or steepest >= 1.0:
            raise ValueError("resolver-error: expected orders above 0 and a slope below 1")

    def error_rad(self, position_rad: Floats, derivative: int = 0) -> Floats:
        """Return measured less true angle at measured angles, or its n-th derivative by them."""
        terms = zip(self.cos_rad, self.sin_rad, self.order_per_motor_rev, strict=True)
        total = np.zeros_like(position_rad)
        for c, s, n in terms:
            total = total + wave(c, s, n, position_rad, derivative)
        return total

    def true_motion(
        self,
        position_rad: Floats,
        velocity_rad_s: Floats,
        acceleration_rad_s2: Floats,
        seen: Floats | float = 1.0,
    ) -> tuple[Floats, Floats, Floats]:
        """Return true angle, velocity and acceleration for those measured, each shape (n,).

        Where the error is not `followed` they are those measured.
        """
        measured = position_rad, velocity_rad_s, acceleration_rad_s2
        angle, speed, change = self.erring(*measured, seen)
        return position_rad - angle, velocity_rad_s - speed, acceleration_rad_s2 - change

    def erring(
        self,
        position_rad: Floats,
        velocity_rad_s: Floats,
        acceleration_rad_s2: Floats,
        seen: Floats | float = 1.0,
    ) -> tuple[Floats, Floats, Floats]:
        """Return the error along a measured motion, and its first two derivatives by time, (n,)."""
        return _along(self.error_rad, position_rad, velocity_rad_s, acceleration_rad_s2, seen)


def _along(
    error: Callable[[Floats, int], Floats],
    position_rad: Floats,
    velocity_rad_s: Floats,
    acceleration_rad_s2: Floats,
    seen: Floats | float,
) -> tuple[Floats, Floats, Floats]:
    """Return an error that goes by the angle, and its first two derivatives by time, each (n,)."""
    slope = seen * error(position_rad, 1)
    bend = seen * error(position_rad, 2) * velocity_rad_s**2
    return (
        np.asarray(seen * error(position_rad, 0)),
        np.asarray(slope * velocity_rad_s),
        np.asarray(slope * acceleration_rad_s2 + bend),
    )
