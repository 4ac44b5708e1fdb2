"""What to drive: frozen, validated, serialisable motion on the motor side. NumPy only."""

from trajectories.arm import arm_deg, motor_rad
from trajectories.checks import TrajectoryError
from trajectories.design import DesignedStair, design_stair
from trajectories.design_information import Belief, Expectation, TorqueNoise, expect
from trajectories.design_request import DesignRequest
from trajectories.document import SCHEMA
from trajectories.extrema import TorqueModel
from trajectories.lasting import lasting
from trajectories.limits import AxisLimits, Excess, Margin, check, margins
from trajectories.paired_stair import stair_paired
from trajectories.point_to_point import point_to_point
from trajectories.reversals import reversals
from trajectories.segment import Phase, Segment
from trajectories.speeds import Spacing, spaced_speeds
from trajectories.stair import stair_between
from trajectories.summary import Summary, summarise
from trajectories.trajectory import (
    PositionWindow,
    SetPoint,
    SetPoints,
    SteadyWindow,
    Trajectory,
)
from trajectories.triangle import triangle, triangle_period_s
from trajectories.warm_up import warm_up

__all__ = [
    "SCHEMA",
    "AxisLimits",
    "Belief",
    "DesignRequest",
    "DesignedStair",
    "Excess",
    "Expectation",
    "Margin",
    "Phase",
    "PositionWindow",
    "Segment",
    "SetPoint",
    "SetPoints",
    "Spacing",
    "SteadyWindow",
    "Summary",
    "TorqueModel",
    "TorqueNoise",
    "Trajectory",
    "TrajectoryError",
    "arm_deg",
    "check",
    "design_stair",
    "expect",
    "lasting",
    "margins",
    "motor_rad",
    "point_to_point",
    "reversals",
    "spaced_speeds",
    "stair_between",
    "stair_paired",
    "summarise",
    "triangle",
    "triangle_period_s",
    "warm_up",
]
