"""Whether a trajectory would exceed the axis's limits, where, and by how much."""

from __future__ import annotations

from dataclasses import dataclass

from trajectories.checks import TrajectoryError, finite, not_negative, positive
from trajectories.extrema import Peak, Stopping, TorqueModel, largest, reach, states
from trajectories.trajectory import Trajectory

# Values are computed in floating point: a trajectory made for a bound may pass it by a few bits.
# Relative to the larger of limit and value, and to one unit where both are near zero.
ROUNDING = 1e-9

UNITS = {
    "position": "rad",
    "velocity": "rad/s",
    "acceleration": "rad/s^2",
    "jerk": "rad/s^3",
    "torque": "N m",
}


@dataclass(frozen=True)
class AxisLimits:
    """What one axis may do, motor side.

    Parameters
    ----------
    position_min_rad, position_max_rad : float
        The motor may be anywhere between them, and must still be after a stop from any instant.
    velocity_max_rad_s, acceleration_max_rad_s2, jerk_max_rad_s3, torque_max_nm : float
        Magnitudes, above zero.
    stopping_deceleration_rad_s2 : float
        What a stop is sure to achieve.
    reaction_time_s : float
        From the moment when something is wrong until the axis begins to slow down.
    """

    position_min_rad: float
    position_max_rad: float
    velocity_max_rad_s: float
    acceleration_max_rad_s2: float
    jerk_max_rad_s3: float
    torque_max_nm: float
    stopping_deceleration_rad_s2: float
    reaction_time_s: float

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        for name in ("position_min_rad", "position_max_rad"):
            set_(self, name, finite(name, getattr(self, name)))
        for name in (
            "velocity_max_rad_s",
            "acceleration_max_rad_s2",
            "jerk_max_rad_s3",
            "torque_max_nm",
            "stopping_deceleration_rad_s2",
        ):
            set_(self, name, positive(name, getattr(self, name)))
        set_(self, "reaction_time_s", not_negative("reaction_time_s", self.reaction_time_s))
        if self.position_min_rad >= self.position_max_rad:
            raise TrajectoryError(
                f"position_min_rad must lie below position_max_rad, got "
                f"{self.position_min_rad:g} and {self.position_max_rad:g}"
            )

    @property
    def stopping(self) -> Stopping:
        """How a stop of this axis goes."""
        return Stopping(self.stopping_deceleration_rad_s2, self.reaction_time_s)


@dataclass(frozen=True)
class Margin:
    """How close one quantity comes to its limit.

    Parameters
    ----------
    quantity : str
        "position", "velocity", "acceleration", "jerk" or "torque".
    value : float
        The largest magnitude; for position, the farthest point that a stop would end at.
    limit : float
        What it may be; position has two limits and so two margins.
    time_s : float
        When it is reached.
    stopping_distance_rad : float
        For position: the part of `value` that is the stop.
    """

    quantity: str
    value: float
    limit: float
    time_s: float
    is_lower: bool = False
    stopping_distance_rad: float = 0.0

    @property
    def unit(self) -> str:
        """The unit of `value` and `limit`."""
        return UNITS[self.quantity]

    @property
    def remaining(self) -> float:
        """What is left before the limit; negative beyond it."""
        return self.value - self.limit if self.is_lower else self.limit - self.value

    @property
    def exceeded(self) -> bool:
        """Whether the limit is passed by more than rounding."""
        return self.remaining < -ROUNDING * max(1.0, abs(self.limit), abs(self.value))


@dataclass(frozen=True)
class Excess:
    """One limit that would be passed, in numbers and as a sentence."""

    quantity: str
    value: float
    limit: float
    unit: str
    time_s: float
    sentence: str


def margins(
    trajectory: Trajectory, limits: AxisLimits, torque_model: TorqueModel | None = None
) -> tuple[Margin, ...]:
    """Return how close the trajectory comes to every limit, exactly.

    Parameters
    ----------
    trajectory : Trajectory
    limits : AxisLimits
    torque_model : TorqueModel, optional
        Without it the torque is not estimated.

    Returns
    -------
    tuple of Margin
        Lower and upper position, velocity, acceleration, jerk and, with a model, torque.
    """
    stopping = limits.stopping
    candidates = states(trajectory, stopping, torque_model)
    lower, upper = (reach(candidates, stopping, direction) for direction in (-1.0, 1.0))
    out = [
        Margin(
            "position",
            lower.position_rad,
            limits.position_min_rad,
            lower.time_s,
            is_lower=True,
            stopping_distance_rad=lower.stopping_distance_rad,
        ),
        Margin(
            "position",
            upper.position_rad,
            limits.position_max_rad,
            upper.time_s,
            stopping_distance_rad=upper.stopping_distance_rad,
        ),
    ]

    def add(quantity: str, peak: Peak, limit: float) -> None:
        out.append(Margin(quantity, peak.value, limit, peak.time_s))

    add(
        "velocity",
        largest(candidates, lambda s: abs(s.velocity_rad_s)),
        limits.velocity_max_rad_s,
    )
    add(
        "acceleration",
        largest(candidates, lambda s: abs(s.acceleration_rad_s2)),
        limits.acceleration_max_rad_s2,
    )
    add("jerk", largest(candidates, lambda s: abs(s.jerk_rad_s3)), limits.jerk_max_rad_s3)
    if torque_model is not None:
        add(
            "torque",
            largest(
                candidates,
                lambda s: torque_model.magnitude_nm(s.velocity_rad_s, s.acceleration_rad_s2),
            ),
            limits.torque_max_nm,
        )
    return tuple(out)


def check(
    trajectory: Trajectory, limits: AxisLimits, torque_model: TorqueModel | None = None
) -> tuple[Excess, ...]:
    """Return every limit that the trajectory would pass; empty when it may be driven.

    Position counts with the stopping distance from the velocity of every instant.

    Parameters
    ----------
    trajectory : Trajectory
    limits : AxisLimits
    torque_model : TorqueModel, optional
        Without it the torque is not checked.
    """
    return tuple(
        Excess(m.quantity, m.value, m.limit, m.unit, m.time_s, _sentence(m))
        for m in margins(trajectory, limits, torque_model)
        if m.exceeded
    )


def _sentence(margin: Margin) -> str:
    unit = margin.unit
    digits = _digits(margin)
    value, limit = f"{margin.value:.{digits}f}", f"{margin.limit:.{digits}f}"
    including = (
        f" including the stopping distance of {margin.stopping_distance_rad:.{digits}f} rad"
        if margin.quantity == "position" and margin.stopping_distance_rad > 0.0
        else ""
    )
    return (
        f"{margin.quantity} would reach {value} {unit} at {margin.time_s:.1f} s{including}; "
        f"the limit is {limit} {unit}"
    )


def _digits(margin: Margin) -> int:
    """Return how many decimals tell value and limit apart; one at least."""
    return next((n for n in range(1, 12) if f"{margin.value:.{n}f}" != f"{margin.limit:.{n}f}"), 12)
