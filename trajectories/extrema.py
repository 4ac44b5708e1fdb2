"""The largest values that a trajectory reaches: exact, piece by piece, never by sampling.

On a piece of constant jerk, position is a cubic, velocity a quadratic and acceleration a line in
time. Every quantity that is checked is smooth where velocity keeps its sign, so its largest value
lies at an end of the piece, where velocity crosses zero, or where its derivative vanishes: the root
of a polynomial of degree three at most. All such instants are candidates; a candidate too many does
no harm, since only values that are really reached are compared.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trajectories.checks import TrajectoryError, not_negative
from trajectories.segment import Piece
from trajectories.trajectory import Trajectory


class Peak(NamedTuple):
    """A largest (or smallest) value and when it is reached first."""

    value: float
    time_s: float


class Reach(NamedTuple):
    """How far a stop begun at `time_s` would carry the motor, and the part that is the stop."""

    position_rad: float
    stopping_distance_rad: float
    time_s: float


@dataclass(frozen=True)
class Stopping:
    """How a stop goes: nothing happens for a reaction time, then constant deceleration.

    The stopping distance from a speed ``v`` is ``v reaction + v^2 / (2 deceleration)``. A motion
    that runs on as planned during the reaction time is covered as well: it is the stop without
    reaction from the later instant, which lies within the one from that instant.

    Parameters
    ----------
    deceleration_rad_s2 : float
        Above zero.
    reaction_time_s : float
        Zero or more.
    """

    deceleration_rad_s2: float
    reaction_time_s: float

    def distance_rad(self, speed_rad_s: float) -> float:
        """Return the stopping distance from a speed (zero or more)."""
        return speed_rad_s * (self.reaction_time_s + 0.5 * speed_rad_s / self.deceleration_rad_s2)


@dataclass(frozen=True)
class TorqueModel:
    """A coarse torque balance at the motor, for an estimate before anything is known better.

    ``|torque| = |J a + sign(v) coulomb + viscous v| + gravity``: gravity is taken at its peak and
    against the motion everywhere, so the estimate is an upper bound of the model.

    Parameters
    ----------
    inertia_kg_m2, coulomb_nm, viscous_nm_s_per_rad : float
        Motor side, zero or more.
    gravity_nm : float
        Largest magnitude over the stroke, seen at the motor.
    """

    inertia_kg_m2: float
    coulomb_nm: float
    viscous_nm_s_per_rad: float
    gravity_nm: float = 0.0

    def __post_init__(self) -> None:
        for name in ("inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad", "gravity_nm"):
            object.__setattr__(self, name, not_negative(name, getattr(self, name)))

    def magnitude_nm(self, velocity_rad_s: float, acceleration_rad_s2: float) -> float:
        """Return the bound on the torque; at standstill friction may point either way."""
        inertial = self.inertia_kg_m2 * acceleration_rad_s2
        if velocity_rad_s == 0.0:
            return abs(inertial) + self.coulomb_nm + self.gravity_nm
        friction = math.copysign(self.coulomb_nm, velocity_rad_s)
        friction += self.viscous_nm_s_per_rad * velocity_rad_s
        return abs(inertial + friction) + self.gravity_nm


class State(NamedTuple):
    """One instant of a piece."""

    time_s: float
    position_rad: float
    velocity_rad_s: float
    acceleration_rad_s2: float
    jerk_rad_s3: float


def states(
    trajectory: Trajectory,
    stopping: Stopping | None = None,
    torque_model: TorqueModel | None = None,
) -> tuple[State, ...]:
    """Return every instant at which position, speed, acceleration, reach or torque may peak.

    Parameters
    ----------
    trajectory : Trajectory
    stopping : Stopping, optional
        Adds the instants where the reach of a stop may peak.
    torque_model : TorqueModel, optional
        Adds the instants where the torque may peak.

    Returns
    -------
    tuple of State
        In order of time; never empty.
    """
    out = [State(0.0, trajectory.start_position_rad, 0.0, 0.0, 0.0)]
    for piece in trajectory.pieces:
        out.extend(_candidates(piece, stopping, torque_model))
    out.append(State(trajectory.duration_s, trajectory.end_position_rad, 0.0, 0.0, 0.0))
    return tuple(out)


def largest(states: tuple[State, ...], magnitude: Callable[[State], float]) -> Peak:
    """Return the largest of a quantity over the candidates, and when it is reached first."""
    best = max(states, key=magnitude)  # max keeps the first of equals
    return Peak(magnitude(best), best.time_s)


def reach(states: tuple[State, ...], stopping: Stopping, direction: float) -> Reach:
    """Return the farthest position in one direction that a stop begun at some instant ends at.

    Parameters
    ----------
    states : tuple of State
        From `states`, made with the same `stopping`.
    stopping : Stopping
    direction : float
        +1 upward, -1 downward.
    """

    def overrun(state: State) -> float:
        return stopping.distance_rad(max(direction * state.velocity_rad_s, 0.0))

    best = max(states, key=lambda s: direction * s.position_rad + overrun(s))
    distance = overrun(best)
    return Reach(best.position_rad + direction * distance, distance, best.time_s)


def _candidates(
    piece: Piece, stopping: Stopping | None, torque_model: TorqueModel | None
) -> Iterator[State]:
    """Yield the instants of one piece, in order of time."""
    _, duration, x, v, a, j = piece
    standstill = _roots((0.5 * j, a, v), duration)
    # A segment's acceleration keeps its sign, so that speed has no peak inside a piece.
    times = {0.0, duration, *standstill}
    if stopping is not None:
        for direction in (1.0, -1.0):
            times.update(_roots(_reach_slope(piece, stopping, direction), duration))
    if torque_model is not None:
        inertia, viscous = torque_model.inertia_kg_m2, torque_model.viscous_nm_s_per_rad
        times.update(_roots((viscous * j, inertia * j + viscous * a), duration))
    for d in sorted(times):
        yield State(
            piece.start_s + d,
            x + d * (v + d * (0.5 * a + d * j / 6.0)),
            0.0 if d in standstill else v + d * (a + 0.5 * d * j),
            a + d * j,
            j,
        )


def _reach_slope(piece: Piece, stopping: Stopping, direction: float) -> tuple[float, ...]:
    """Return the polynomial in time whose roots are the turning points of a stop's reach.

    With ``w = +-v`` the speed in that direction and ``b`` its derivative, the reach grows as
    ``w + b reaction + w b / deceleration``; multiplied by the deceleration.
    """
    w, b, c = (
        direction * piece.velocity_rad_s,
        direction * piece.acceleration_rad_s2,
        direction * piece.jerk_rad_s3,
    )
    brake, react = stopping.deceleration_rad_s2, stopping.reaction_time_s
    return (
        0.5 * c * c,
        1.5 * b * c + 0.5 * c * brake,
        b * b + w * c + b * brake + c * react * brake,
        w * b + w * brake + b * react * brake,
    )


def _roots(coefficients: tuple[float, ...], duration_s: float) -> list[float]:
    """Return candidates for the real roots in (0, duration), highest power first.

    The real part of a complex root is kept too: a double root that rounding has split stays found.
    """
    if not any(coefficients):
        return []
    # In units of the duration, so that what is negligible can be told without units.
    factor, terms = 1.0, []
    for coefficient in reversed(coefficients):
        terms.append(coefficient * factor if coefficient != 0.0 else 0.0)
        factor *= duration_s
    scaled = np.array(terms[::-1])
    size = float(np.max(np.abs(scaled)))
    if not math.isfinite(size):
        raise TrajectoryError(f"a piece of {duration_s:g} s is beyond floating point to check")
    if size == 0.0:
        return []
    scaled = np.where(np.abs(scaled) < 1e-13 * size, 0.0, scaled) / size
    found = np.roots(scaled).real
    return [float(r) * duration_s for r in found if 0.0 < r < 1.0]
