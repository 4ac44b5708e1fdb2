"""Arm degrees to motor radians and back: the one conversion that a technician's numbers need."""

from __future__ import annotations

import math

from trajectories.checks import finite, positive


def motor_rad(angle_arm_deg: float, gear_ratio: float) -> float:
    """Return the motor angle in rad of an arm angle; `gear_ratio` is motor turns per arm turn."""
    return math.radians(finite("angle_arm_deg", angle_arm_deg)) * positive("gear_ratio", gear_ratio)


def arm_deg(position_rad: float, gear_ratio: float) -> float:
    """Return the arm angle in degrees of a motor angle in rad."""
    return math.degrees(finite("position_rad", position_rad) / positive("gear_ratio", gear_ratio))
