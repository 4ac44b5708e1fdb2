"""The numbers of an effect, named and scaled for a technician.

`agent.numbers` knows the twin's own parameters; what effects add is here: rates per kelvin,
hour and run, angles of the arm in degrees, and names that say what a number does.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from agent.numbers import Scale, parameter_label, parameter_unit, scale_for

_LABELS: Mapping[str, str] = MappingProxyType(
    {
        "antiresonance_hz": "Swing of the arm on the gear's spring, motor held",
        "arm_coulomb_nm": "Coulomb friction of the arm, motor side",
        "arm_inertia_kg_m2": "Inertia of the arm, motor side",
        "arm_viscous_nm_s_per_rad": "Viscous friction of the arm, motor side",
        "balancer_nm": "Pull of the spring at no length, times the shorter lever",
        "balancer_stiffness_nm": "Stiffness of the spring, times both levers",
        "center_arm_rad": "Middle of the place, arm angle",
        "cos_nm": "Cosine part",
        "cos_second_nm": "Cosine part, double order",
        "cos_share": "Cosine part, over the torque",
        "cos_rad": "Cosine part, motor angle",
        "changed_at": "From when on",
        "coulomb_change_nm": "Coulomb friction, change in the end",
        "coulomb_difference_nm": "Coulomb friction, forward less backward",
        "coulomb_extra_nm": "Coulomb friction, true less simulated",
        "coulomb_nm_per_h": "Coulomb friction, growth with time",
        "coulomb_nm_per_1000_turns": "Coulomb friction, growth with the motor's turns",
        "coulomb_nm_per_operating_h": "Coulomb friction, growth with operation",
        "coulomb_nm_per_k": "Coulomb friction, growth with temperature",
        "coulomb_nm_per_run": "Coulomb friction, growth from run to run",
        "coulomb_step_nm": "Coulomb friction, change from then on",
        "cubic_stiffness_nm_per_rad3": "Stiffness that grows with twist",
        "damping_nm_s_per_rad": "Damping",
        "damping_ratio": "Damping of the swing, over critical damping",
        "decay_k": "Warming by which it falls to 37 %",
        "dead_center_arm_rad": "Arm angle where the spring is shortest",
        "dent_nm": "Torque to either side of the place",
        "encoder_late_s": "Arm's encoder, later than the motor's by",
        "exponent": "Exponent",
        "factor": "Torque factor (real over reported)",
        "factor_per_k": "Torque factor, growth with temperature",
        "film_damping_nm_s_per_rad": "Damping between teeth that are apart",
        "gravity_cos_nm_per_kg": "Gravity, cosine of the arm angle, of a kilogram more",
        "gravity_sin_nm_per_kg": "Gravity, sine of the arm angle, of a kilogram more",
        "gravity_cos_nm": "Gravity missing, cosine of the arm angle",
        "gravity_sin_nm": "Gravity missing, sine of the arm angle",
        "driving_excess": "Share of it, more where the motor drives, less where it is driven",
        "half_gap_rad": "Half of the gap, motor angle",
        "half_gap_spread": "Share by which the gap differs along its turn",
        "parting_damping_share": "Share of the contact's damping that holds parting teeth back",
        "height_nm": "Height",
        "hysteresis_nm": "Inner friction",
        "hysteresis_travel_arm_rad": "Travel of the inner friction, arm angle",
        "hysteresis_travel_rad": "Twist of the inner friction",
        "inertia_kg_m2_per_kg": "Inertia of a kilogram more, motor side",
        "inertia_extra_kg_m2": "Inertia, true less simulated",
        "lever_ratio": "Shorter lever over the longer",
        "limit_nm": "Torque limit of the drive",
        "load_boundary_coefficient": "Friction per load at low speed",
        "load_coefficient": "Friction per load",
        "load_power": "Power of the load with which it grows",
        "load_growth_per_nm": "Growth with the torque",
        "load_velocity_rad_s": "Speed at which that has faded",
        "motor_1000_turns": "Turns of the motor when they began",
        "neutral_arm_rad": "Arm angle without pull",
        "operating_h": "Time of operation when they began",
        "order_per_arm_rev": "Order per arm turn",
        "order_per_motor_rev": "Order per motor turn",
        "plateau_nm": "Bend, torque that it ends at",
        "plateau_velocity_rad_s": "Speed at which half of that is there",
        "power_nm": "Bend, torque at the reference speed",
        "recorded_from": "When recordings began, and the last ended",
        "reference_1000_turns": "Reference use",
        "reference_degc": "Reference temperature",
        "reference_load_nm": "Load of that friction per load",
        "reference_operating_h": "Reference use",
        "reference_payload_kg": "Reference payload",
        "reference_run": "Reference run",
        "reference_started_at": "Reference time",
        "reference_velocity_rad_s": "Reference speed",
        "settling_1000_turns": "Turns until 37 % of the change is left",
        "settling_operating_h": "Operation until 37 % of the change is left",
        "settling_h": "Time until 37 % of the change is left",
        "shape_exponent": "Shape exponent",
        "shear_nm": "Bend, stress of the oil as torque",
        "shear_velocity_rad_s": "Speed at which it begins to bend",
        "sin_nm": "Sine part",
        "sin_second_nm": "Sine part, double order",
        "sin_share": "Sine part, over the torque",
        "sin_rad": "Sine part, motor angle",
        "period_arm_rad": "Arm travel after which it comes again",
        "slack_below_arm_rad": "Slack below that angle",
        "slack_above_arm_rad": "Slack above that angle",
        "sliding_travel_rad": "Motor travel until all of it slides",
        "static_extra_nm": "Extra friction at standstill",
        "static_nm": "Extra friction at standstill, at 0 °C",
        "static_nm_per_k": "Extra friction, growth with temperature",
        "cubic_nm_per_arm_rad3": "Stiffening over the arm angle",
        "stiffening_arm_rad": "Arm angle in which it stiffens",
        "stiffness_nm_per_arm_rad": "Stiffness over the arm angle",
        "stiffness_nm_per_rad": "Stiffness",
        "yielding_share": "Share of the friction that yields",
        "stribeck_velocity_rad_s": "Stribeck velocity",
        "stribeck_velocity_rad_s_per_k": "Stribeck velocity, growth with temperature",
        "tenth_less_nm": "Reported torque of which a tenth is not there",
        "torque_delay_s": "Delay of the torque",
        "torque_lag_s": "Time constant of its low-pass",
        "velocity_delay_s": "Delay of the velocity",
        "viscous_step_nm_s_per_rad": "Viscous friction, change from then on",
        "viscous_change_nm_s_per_rad": "Viscous friction, change in the end",
        "viscous_difference_nm_s_per_rad": "Viscous friction, forward less backward",
        "viscous_extra_nm_s_per_rad": "Viscous friction, true less simulated",
        "viscous_nm_s_per_rad_per_1000_turns": "Viscous friction, growth with the motor's turns",
        "viscous_nm_s_per_rad_per_operating_h": "Viscous friction, growth with operation",
        "viscous_nm_s_per_rad_per_h": "Viscous friction, growth with time",
        "viscous_nm_s_per_rad_per_run": "Viscous friction, growth from run to run",
        "viscous_thermal_nm_s_per_rad": "Viscous friction that warmth takes away",
        "width_above_arm_rad": "Half of its width above, arm angle",
        "width_arm_rad": "Half of its width, arm angle",
        "zero_spread_nm": "Spread of the recordings' zeros",
    }
)

# A rate's name ends with what it is taken per.
_PER: Mapping[str, str] = MappingProxyType(
    {
        "_per_k": "/K",
        "_per_kg": "/kg",
        "_per_nm": "/(N m)",
        "_per_operating_h": "/h",
        "_per_h": "/h",
        "_per_run": " per run",
        "_per_1000_turns": " per 1000 turns",
    }
)
_WHOLE: Mapping[str, str] = MappingProxyType(
    {
        "_nm_per_arm_rad": "N m/rad",
        "_nm_per_arm_rad3": "N m/rad³",
        "_nm_per_rad3": "N m/rad³",
        "_1000_turns": "thousand turns",
        "_k": "K",
        "_h": "h",
    }
)
_SCALED = ("N m s/rad", "N m", "kg m²")  # what `scale_for` can write small, the longest first


def quantity_label(name: str) -> str:
    """Return what a number of an effect is called."""
    return _LABELS.get(name) or parameter_label(name)


def quantity_scale(name: str, values: Iterable[float]) -> Scale:
    """Return the unit in which a number of an effect is written, and the factor from SI to it.

    Parameters
    ----------
    name : str
        As in a twin; it ends with the unit.
    values : iterable of float
        What is to be written; what is not finite is left out.
    """
    if name.endswith("_arm_rad") and "_per_" not in name:
        return Scale(math.degrees(1.0), "degrees")
    unit = _unit(name)
    for base in _SCALED:
        if unit.startswith(base):
            scale = scale_for(base, values)
            return Scale(scale.factor, scale.unit + unit.removeprefix(base))
    return scale_for(unit, values)


def _unit(name: str) -> str:
    for suffix, per in _PER.items():
        if name.endswith(suffix):
            unit = parameter_unit(name.removesuffix(suffix))
            return f"{unit}{per}" if unit else f"1{per}"
    for suffix, unit in _WHOLE.items():
        if name.endswith(suffix):
            return unit
    return parameter_unit(name)
