"""What a stair may use, what is thought of the joint, and what the axis's limits leave of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from trajectories.checks import TrajectoryError, finite, not_negative, positive
from trajectories.design_information import Belief, TorqueNoise
from trajectories.extrema import TorqueModel
from trajectories.limits import AxisLimits

_SPARE = 3  # speeds beyond the law's parameters, so that the fit can contradict the law


@dataclass(frozen=True)
class DesignRequest:
    """What a stair may use, and what is thought of the joint.

    Parameters
    ----------
    from_rad, to_rad : float
        Ends of the stroke that may be used, motor side.
    duration_s : float
        The time budget, rests included.
    speed_min_rad_s, speed_max_rad_s : float
        Between them the speeds are chosen, the first below the second.
    acceleration_rad_s2, jerk_rad_s3 : float
        Bounds of the ramps.
    limits : AxisLimits
        Never exceeded, stopping distance included.
    belief, noise : Belief, TorqueNoise
        The joint and the torque signal as they are thought to be.
    torque_model : TorqueModel, optional
        For the torque limit.
    dwell_min_s, settle_s, rest_s : float
        No speed is held for less; lost at the start of every dwell, while the drive's loop and a
        soft arm settle; standstill between strokes.
    """

    from_rad: float
    to_rad: float
    duration_s: float
    speed_min_rad_s: float
    speed_max_rad_s: float
    acceleration_rad_s2: float
    jerk_rad_s3: float
    limits: AxisLimits
    belief: Belief
    noise: TorqueNoise
    torque_model: TorqueModel | None = None
    dwell_min_s: float = 0.5
    settle_s: float = 0.2
    rest_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("from_rad", "to_rad"):
            finite(name, getattr(self, name))
        for name in (
            "duration_s",
            "speed_min_rad_s",
            "speed_max_rad_s",
            "acceleration_rad_s2",
            "jerk_rad_s3",
            "dwell_min_s",
        ):
            positive(name, getattr(self, name))
        for name in ("settle_s", "rest_s"):
            not_negative(name, getattr(self, name))
        if self.from_rad == self.to_rad:
            raise TrajectoryError(f"a stair needs two positions, got {self.from_rad:g} rad twice")
        if self.dwell_min_s <= self.settle_s:
            raise TrajectoryError(
                f"dwell_min_s must be longer than settle_s, got {self.dwell_min_s:g} and "
                f"{self.settle_s:g} s"
            )
        if self.speed_min_rad_s >= self.speed_max_rad_s:
            raise TrajectoryError(
                f"speed_min_rad_s must lie below speed_max_rad_s, got {self.speed_min_rad_s:g} "
                f"and {self.speed_max_rad_s:g}"
            )

    @property
    def speeds_min(self) -> int:
        """The fewest different speeds: three more than the friction law has parameters."""
        return len(self.belief.friction_names) + _SPARE


def within_limits(request: DesignRequest) -> DesignRequest:
    """Lower speed, acceleration and jerk to what the axis may do, its torque included."""
    limits, model = request.limits, request.torque_model
    fastest = min(request.speed_max_rad_s, limits.velocity_max_rad_s)
    acceleration = min(request.acceleration_rad_s2, limits.acceleration_max_rad_s2)
    if fastest <= request.speed_min_rad_s:
        raise TrajectoryError(
            f"the slowest speed asked for, {request.speed_min_rad_s:g} rad/s, is not below the "
            f"axis's limit of {fastest:g} rad/s: a stair needs slower speeds"
        )
    if model is not None:
        sliding_nm = model.magnitude_nm(fastest, 0.0)
        left_nm = limits.torque_max_nm - sliding_nm
        if left_nm <= 0.0:
            raise TrajectoryError(
                f"{fastest:g} rad/s alone needs {sliding_nm:.2f} N m, and the axis may use "
                f"{limits.torque_max_nm:g} N m: a lower top speed would be needed"
            )
        if model.inertia_kg_m2 > 0.0:
            acceleration = min(acceleration, left_nm / model.inertia_kg_m2)
    return replace(
        request,
        speed_max_rad_s=fastest,
        acceleration_rad_s2=acceleration,
        jerk_rad_s3=min(request.jerk_rad_s3, limits.jerk_max_rad_s3),
    )


def window(request: DesignRequest) -> tuple[float, float]:
    """Return the positions that may be used: those asked for, inside the limits."""
    limits = request.limits
    low = max(min(request.from_rad, request.to_rad), limits.position_min_rad)
    high = min(max(request.from_rad, request.to_rad), limits.position_max_rad)
    if low >= high:
        raise TrajectoryError(
            f"the stroke from {request.from_rad:g} to {request.to_rad:g} rad lies outside the "
            f"position limits of {limits.position_min_rad:g} and {limits.position_max_rad:g} rad"
        )
    return low, high
