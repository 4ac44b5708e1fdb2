"""The contour check: the travel at a creep, under a tight torque limit, before anything is fast.

It answers two questions before the first cycle of a joint: is the way free over the whole travel,
and is it heavier somewhere than elsewhere? Whatever stands in the way stops the joint at a torque
not far above its own friction, and at a speed at which little can happen.
"""

from __future__ import annotations

from agent.cell.cell import Axis
from trajectories import Segment, Trajectory, TrajectoryError

CREEP_ARM_RAD_S = 0.1
"""Of the arm: 150 mm/s at a reach of 1.5 m; manual reduced speed would be 250 mm/s."""

RAMP_S = 0.3
REST_S = 0.5
LEAST_STROKE_S = 4.0
TORQUE_MARGIN = 1.5
"""Of the friction and gravity that the cell expects: room for breakaway and a cold gearbox."""

TORQUE_SHARE = 0.3
"""Of the axis's torque limit, where the cell expects nothing."""

FOLLOWING_ARM_DEG = 1.0


def creep_rad_s(axis: Axis) -> float:
    """Return the motor velocity of the check, in rad/s."""
    stair = axis.stair
    travel_rad = axis.motor_rad(stair.arm_to_deg) - axis.motor_rad(stair.arm_from_deg)
    return min(
        CREEP_ARM_RAD_S * axis.gear_ratio,
        0.5 * axis.limits.motor_velocity_max_rad_s,
        abs(travel_rad) / LEAST_STROKE_S,
    )


def contour_of(axis: Axis) -> Trajectory:
    """Return the way from one end of the stair's travel to the other and back, at a creep.

    Parameters
    ----------
    axis : agent.cell.axis.Axis
        Its stair's arm positions, its limits, its gear ratio.

    Raises
    ------
    trajectories.TrajectoryError
        The travel is too short for the axis's jerk limit.
    """
    stair, speed = axis.stair, creep_rad_s(axis)
    low, high = axis.motor_rad(stair.arm_from_deg), axis.motor_rad(stair.arm_to_deg)
    acceleration = min(speed / RAMP_S, axis.limits.motor_acceleration_max_rad_s2)
    jerk = min(4.0 * acceleration / RAMP_S, axis.limits.motor_jerk_max_rad_s3)
    up, down = (
        Segment.ramp(0.0, speed, acceleration, jerk),
        Segment.ramp(speed, 0.0, acceleration, jerk),
    )
    steady_rad = high - low - up.displacement_rad - down.displacement_rad
    if steady_rad <= 0.0:
        raise TrajectoryError(
            f"a travel of {high - low:.3g} rad is too short to reach {speed:.3g} rad/s on it"
        )
    out = (up, Segment.steady(speed, steady_rad / speed), down)
    back = tuple(segment.reversed() for segment in reversed(out))
    rest = Segment.rest(REST_S)
    return Trajectory(
        "contour",
        {"from_rad": low, "to_rad": high, "speed_rad_s": speed},
        low,
        (rest, *out, rest, *back, rest),
    )


def creeping(axis: Axis, torque_nm: float | None = None) -> Axis:
    """Return the axis with the tighter limits that hold during the check; nothing is widened.

    Parameters
    ----------
    axis : agent.cell.axis.Axis
        As the cell describes it.
    torque_nm : float, optional
        The torque limit; by itself `TORQUE_MARGIN` times the friction and gravity that the cell
        expects, and what the ramps need.
    """
    limits, speed = axis.limits, creep_rad_s(axis)
    tight_nm = _tight_nm(axis) if torque_nm is None else torque_nm
    return axis.model_copy(
        update={
            "limits": limits.model_copy(
                update={
                    "motor_velocity_max_rad_s": 2.0 * speed,
                    "motor_torque_max_nm": min(tight_nm, limits.motor_torque_max_nm),
                    "following_error_max_arm_deg": min(
                        FOLLOWING_ARM_DEG, limits.following_error_max_arm_deg
                    ),
                }
            ),
            "stair": axis.stair.model_copy(
                update={
                    "approach_velocity_rad_s": min(speed, axis.stair.approach_velocity_rad_s),
                    "motor_acceleration_rad_s2": min(
                        speed / RAMP_S, axis.stair.motor_acceleration_rad_s2
                    ),
                }
            ),
        }
    )


def _tight_nm(axis: Axis) -> float:
    """Return the torque limit of the check that follows from what the cell expects."""
    model = axis.torque_model
    if model is None:
        return TORQUE_SHARE * axis.limits.motor_torque_max_nm
    speed = creep_rad_s(axis)
    friction_nm = model.coulomb_nm + model.viscous_nm_s_per_rad * speed
    ramp_nm = 2.0 * model.inertia_kg_m2 * speed / RAMP_S  # a soft arm swings to twice the step
    return TORQUE_MARGIN * (friction_nm + model.gravity_nm) + ramp_nm
