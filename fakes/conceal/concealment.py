"""What a concealed effect is to the generator: how to put it in, and what to say of it after."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from fakes.conceal.robot import Robot
from fakes.conceal.truth import Truth

Basis = Literal["refitted", "as-given", "commanded"]
"""Against what an effect shows: the structure refitted; the twin's numbers as given, for what a
refit absorbs; or the structure refitted to the set-points, for torque that never reaches the joint.
"""

BASES: tuple[Basis, ...] = get_args(Basis)


@dataclass(frozen=True)
class Region:
    """Where an effect lives: a variable of contract section 6, and from where to where."""

    variable: str
    low: float
    high: float

    def to_json(self) -> dict[str, str | float]:
        """Return the region in the contract's words."""
        return {"variable": self.variable, "from": self.low, "to": self.high}


@dataclass(frozen=True)
class Concealment:
    """One effect, drawn but for its amplitude.

    Parameters
    ----------
    effect : str
        An id of contract section 4, or ``outsider:<name>``.
    form : str
        Which of the effect's equations, in words.
    basis : {"refitted", "as-given", "commanded"}
        Against what it shows.
    put : callable
        ``put(truth, amplitude)`` returns the truth with the effect in it; amplitude is above zero,
        and the effect grows with it.
    first, most : float
        An amplitude to try first, and the largest that a joint could have.
    where, parameters : callable
        From the final truth: the regions, and the numbers under contract or plain names.
    also : tuple of str
        Ids that name the very same columns: saying one of them is as right.
    """

    effect: str
    form: str
    put: Callable[[Truth, float], Truth]
    first: float
    most: float
    where: Callable[[Truth], tuple[Region, ...]]
    parameters: Callable[[Truth], Mapping[str, float]]
    basis: Basis = "refitted"
    also: tuple[str, ...] = ()


Maker = Callable[[np.random.Generator, Robot], Concealment]


class UnreachableError(ValueError):
    """The joint and design cannot show the effect at the size asked; drop and count the case."""


def scaled(
    factors: Mapping[str, float], fixed: Mapping[str, float] | None = None
) -> Callable[[Truth, float], Truth]:
    """Return a `put` that sets `fixed` as they are and `factors` times the amplitude."""

    def put(truth: Truth, amplitude: float) -> Truth:
        grown = {name: amplitude * factor for name, factor in factors.items()}
        return truth._replace(**dict(fixed or {}), **grown)

    return put


def numbers(**fields: str) -> Callable[[Truth], Mapping[str, float]]:
    """Return a `parameters` that reads fields of the truth under the names given."""
    return lambda truth: {name: float(getattr(truth, field)) for name, field in fields.items()}


def wave_numbers(
    amplitude: str, order: str, phase: str, unit: str, *, turn: str = "motor"
) -> Callable[[Truth], Mapping[str, float]]:
    """Return a `parameters` of ``A sin(n q + phase)``, as its cosine, sine and order."""

    def parameters(truth: Truth) -> Mapping[str, float]:
        size, angle_rad = getattr(truth, amplitude), getattr(truth, phase)
        return {
            f"cos_{unit}": size * math.sin(angle_rad),
            f"sin_{unit}": size * math.cos(angle_rad),
            f"order_per_{turn}_rev": float(getattr(truth, order)),
        }

    return parameters


def whole_axis(variable: str, low: float, high: float) -> Callable[[Truth], tuple[Region, ...]]:
    """Return a `where` of an effect that fills its axis."""
    region = (Region(variable, low, high),)

    def where(truth: Truth) -> tuple[Region, ...]:
        del truth  # wherever it is driven, whatever the numbers
        return region

    return where


def speeds(robot: Robot) -> Callable[[Truth], tuple[Region, ...]]:
    """Return a `where` of an effect at every velocity."""
    return whole_axis("velocity_rad_s", -robot.top_rad_s, robot.top_rad_s)


def stroke(robot: Robot) -> Callable[[Truth], tuple[Region, ...]]:
    """Return a `where` of an effect at every arm angle."""
    low, high = stroke_ends(robot)
    return whole_axis("arm_position_rad", low, high)


def stroke_ends(robot: Robot) -> tuple[float, float]:
    """Return the arm angles between which the joint is driven."""
    return (
        robot.centre_arm_rad - robot.reach_arm_rad,
        robot.centre_arm_rad + robot.reach_arm_rad,
    )


def either_sign(rng: np.random.Generator) -> float:
    """Return 1 or -1."""
    return float(rng.choice((-1.0, 1.0)))


def angle(rng: np.random.Generator) -> float:
    """Return a phase."""
    return float(rng.uniform(0.0, 2.0 * math.pi))


def time_to_travel_s(robot: Robot, distance_rad: float) -> float:
    """Return how long a gentle start takes for a distance: ``x = jerk t^3 / 6``."""
    gentle = 0.6 * robot.jerk_rad_s3
    return math.cbrt(6.0 * distance_rad / gentle)


def heaviest_nm(robot: Robot) -> float:
    """Return about the largest torque that the robot's trajectories ask for."""
    truth = robot.truth
    return (
        truth.inertia_kg_m2 * robot.acceleration_rad_s2
        + math.hypot(truth.gravity_sin_nm, truth.gravity_cos_nm)
        + truth.dry_nm
        + truth.viscous_nm_s_per_rad * robot.top_rad_s
    )
