"""What one cycle will do: a frozen value made from the cell before any bus is opened."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from agent.cell.cell import Axis, Cell
from agent.cycle.gate import GateLimits
from trajectories import (
    Trajectory,
    TrajectoryError,
    spaced_speeds,
    stair_between,
    stair_paired,
    triangle,
)

TRIANGLE_PERIODS = 12
TRIANGLE_PERIOD_S = 1.6
_CORNER = 2.0 / 3.0  # of the stair's acceleration
_RINGING = 3.0  # times the acceleration: what an undamped arm answers to a corner with
_TORQUE = 0.8  # of the torque limit
_VELOCITY = 0.9  # of the velocity limit


@dataclass(frozen=True)
class Approach:
    """How the joint gets to the start of its trajectory and back; motor side."""

    velocity_rad_s: float
    acceleration_rad_s2: float
    jerk_rad_s3: float
    tolerance_rad: float
    settle_s: float = 0.3
    attempts: int = 3


@dataclass(frozen=True)
class CyclePlan:
    """One cycle on one axis.

    Parameters
    ----------
    robot, axis : str, int
        Whose joint moves.
    gear_ratio : float
        Motor turns per arm turn.
    trajectory : trajectories.Trajectory
        The stair.
    approach : Approach
        How to get to its start and back.
    limits : GateLimits
        What every set-point must satisfy.
    tick_s : float
        Control and sample period.
    transition_timeout_s : float
        How long the drive may take to be on, or off.
    temperature_beside_drive : bool
        Whether another device than the drive measures the gearbox's temperature: the recording
        then carries its age and quality.
    """

    robot: str
    axis: int
    gear_ratio: float
    trajectory: Trajectory
    approach: Approach
    limits: GateLimits
    tick_s: float
    transition_timeout_s: float = 3.0
    temperature_beside_drive: bool = False


def stair_of(axis: Axis, *, reverse: bool = False) -> Trajectory:
    """Return the stair that the cell asks for on this axis.

    Speeds are spaced geometrically, so that the falling part of the friction curve is as well
    covered as the viscous one.

    Parameters
    ----------
    axis : agent.cell.axis.Axis
        Its stair and its gear ratio.
    reverse : bool
        Whether to return the validation run: the same passes in reverse order.

    Raises
    ------
    trajectories.TrajectoryError
        Where no stair fits: says what would.
    """
    stair = axis.stair
    build = stair_paired if stair.kind == "paired" else stair_between
    trajectory = build(
        axis.motor_rad(stair.arm_from_deg),
        axis.motor_rad(stair.arm_to_deg),
        speeds_rad_s=spaced_speeds(
            stair.motor_velocity_min_rad_s, stair.motor_velocity_max_rad_s, stair.speeds
        ),
        duration_s=stair.duration_s,
        acceleration_rad_s2=stair.motor_acceleration_rad_s2,
        jerk_rad_s3=stair.motor_jerk_rad_s3,
    )
    return trajectory.reversed() if reverse else trajectory


def triangle_of(axis: Axis) -> Trajectory:
    """Return the triangle wave of velocity that shows this axis's flexible joint (thesis 4.2.1).

    It swings about the middle of the stair's arm positions. A corner turns the acceleration from
    ``-a`` to ``a``, and a lightly damped arm answers with up to ``3 a`` where a ramp of the stair
    gets ``2 a``: at two thirds of the stair's acceleration neither asks for more torque than the
    other. Where the cell gives a rough idea of the joint, ``3 a J`` and friction also stay within
    0.8 of the torque limit. Corners are turned at the axis's highest jerk, because they excite the
    spring; the peak is what a period of 1.6 s, the velocity limit and the stair's stroke allow.

    Parameters
    ----------
    axis : agent.cell.axis.Axis
        Its stair, its limits and its gear ratio.

    Raises
    ------
    trajectories.TrajectoryError
        Friction, gravity and ringing alone take the torque that the limits allow.
    """
    stair, limits = axis.stair, axis.limits
    low, high = axis.motor_rad(stair.arm_from_deg), axis.motor_rad(stair.arm_to_deg)
    acceleration = _CORNER * stair.motor_acceleration_rad_s2
    peak = min(
        acceleration * TRIANGLE_PERIOD_S / 4.0,
        stair.motor_velocity_max_rad_s,
        _VELOCITY * limits.motor_velocity_max_rad_s,
    )
    model = axis.torque_model
    if model is not None and model.inertia_kg_m2 > 0.0:
        friction = model.coulomb_nm + model.gravity_nm + model.viscous_nm_s_per_rad * peak
        left = _TORQUE * limits.motor_torque_max_nm - friction
        if left <= 0.0:
            raise TrajectoryError(
                f"friction and gravity take {friction:.3g} N m of the "
                f"{limits.motor_torque_max_nm:.3g} N m that the axis may use: nothing is left to "
                "excite its spring with"
            )
        acceleration = min(acceleration, left / (_RINGING * model.inertia_kg_m2))
        peak = min(peak, acceleration * TRIANGLE_PERIOD_S / 4.0)
    # Half a period covers peak^2 / a, and at most peak a / jerk more for its rounded corners.
    corner_s = acceleration / limits.motor_jerk_max_rad_s3
    widest = math.sqrt(corner_s**2 + 4.0 * (high - low) / acceleration) - corner_s
    peak = min(peak, 0.5 * acceleration * widest)
    return triangle(
        0.5 * (low + high) + 0.5 * peak * (peak / acceleration + corner_s),
        peak_velocity_rad_s=peak,
        acceleration_rad_s2=acceleration,
        jerk_rad_s3=limits.motor_jerk_max_rad_s3,
        periods=TRIANGLE_PERIODS,
    )


NAMED: Mapping[str, Callable[[Axis], Trajectory]] = MappingProxyType({"triangle": triangle_of})
"""What can be driven by its name: each made from the cell's own numbers for the axis."""


def trajectory_of(axis: Axis, given: Trajectory | None, *, reverse: bool = False) -> Trajectory:
    """Return what a cycle drives: the trajectory given, else the cell's stair."""
    if given is None:
        return stair_of(axis, reverse=reverse)
    return given.reversed() if reverse else given


def plan_cycle(
    cell: Cell, axis: Axis, *, reverse: bool = False, trajectory: Trajectory | None = None
) -> CyclePlan:
    """Return the plan of one cycle: the trajectory and the limits that will be enforced.

    Parameters
    ----------
    cell, axis : Cell, Axis
        The description.
    reverse : bool
        Whether to drive backward in time (validation run).
    trajectory : Trajectory, optional
        Takes the place of the cell's stair; everything else, limits included, stays the cell's.
    """
    limits, stair, motor = axis.limits, axis.stair, axis.motor_limits
    return CyclePlan(
        robot=cell.robot,
        axis=axis.number,
        gear_ratio=axis.gear_ratio,
        trajectory=trajectory_of(axis, trajectory, reverse=reverse),
        approach=Approach(
            velocity_rad_s=stair.approach_velocity_rad_s,
            acceleration_rad_s2=stair.motor_acceleration_rad_s2,
            jerk_rad_s3=stair.motor_jerk_rad_s3,
            tolerance_rad=axis.motor_rad(stair.start_tolerance_arm_deg),
        ),
        limits=GateLimits(
            velocity_max_rad_s=limits.motor_velocity_max_rad_s,
            acceleration_max_rad_s2=limits.motor_acceleration_max_rad_s2,
            position_min_rad=motor.position_min_rad,
            position_max_rad=motor.position_max_rad,
            stopping_deceleration_rad_s2=limits.stopping_deceleration_rad_s2,
            reaction_time_s=axis.reaction_time_s,
            velocity_error_max_rad_s=limits.velocity_error_max_rad_s,
            following_error_max_rad=axis.motor_rad(limits.following_error_max_arm_deg),
            torque_max_nm=limits.motor_torque_max_nm,
            temperature_min_degc=limits.gearbox_temperature_min_degc,
            temperature_max_degc=limits.gearbox_temperature_max_degc,
            temperature_required=axis.has_gearbox_temperature,
            sample_age_max_s=axis.supervision.sample_age_max_s,
        ),
        tick_s=1.0 / cell.recording.sample_rate_hz,
        temperature_beside_drive=axis.temperature is not None,
    )
