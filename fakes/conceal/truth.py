"""All that is true of one concealed joint, as numbers: the joint, its drive, and what is hidden."""

from __future__ import annotations

from typing import NamedTuple


class Truth(NamedTuple):
    """One joint with its drive; a number that is zero switches its physics off.

    Motor side and SI throughout. The kernel (`fakes.conceal.kernel`) reads the fields by name and
    holds the equations; only plain numbers are here, so that compiled code can take them whole.
    """

    # Masses, springs, gravity. The tool is a third mass behind a second spring.
    gear_ratio: float
    motor_inertia_kg_m2: float
    arm_inertia_kg_m2: float
    tool_inertia_kg_m2: float
    stiffness_nm_per_rad: float
    damping_nm_s_per_rad: float
    tool_stiffness_nm_per_rad: float
    tool_damping_nm_s_per_rad: float
    gravity_sin_nm: float
    gravity_cos_nm: float

    # Friction that every case has: level, slope, and how far the contacts yield before they slip.
    coulomb_nm: float  # at the motor
    arm_coulomb_nm: float  # at the arm: what keeps a gear's clearance closed
    viscous_nm_s_per_rad: float
    presliding_rad: float

    # The drive: cascaded position and velocity loops over a current loop.
    position_gain_per_s: float
    velocity_gain_nm_s_per_rad: float
    integral_per_s: float
    feedforward_kg_m2: float
    current_lag_s: float
    report_lag_s: float
    torque_limit_nm: float

    # Heat: of the oil, of the winding.
    oil_capacity_j_per_k: float
    oil_cooling_per_s: float
    winding_k_per_nm2_s: float
    winding_cooling_per_s: float
    sensor_lag_s: float

    # What a simulation may leave out.
    stribeck_nm: float = 0.0
    stribeck_velocity_rad_s: float = 1.0
    stribeck_exponent: float = 1.0
    stribeck_is_rational: float = 0.0
    bend_nm: float = 0.0
    bend_velocity_rad_s: float = 1.0
    bend_exponent: float = 0.0  # 0: Cross, -1: Eyring, else a power
    asymmetry_nm: float = 0.0
    asymmetry_nm_s_per_rad: float = 0.0
    load_friction: float = 0.0
    oil_share: float = 0.0
    oil_scale_k: float = 20.0
    oil_is_andrade: float = 0.0
    tight_nm: float = 0.0
    tight_order_per_arm_rev: float = 0.0  # 0: one tight spot
    tight_phase_rad: float = 0.0
    tight_center_arm_rad: float = 0.0
    tight_half_width_arm_rad: float = 1.0
    drift_share: float = 0.0
    drift_runs: float = 0.0  # 0: grows evenly; else settles over so many runs
    ripple_nm: float = 0.0
    ripple_order: float = 1.0
    ripple_phase_rad: float = 0.0
    wobble_rad: float = 0.0
    wobble_order: float = 1.0
    wobble_phase_rad: float = 0.0
    resolver_rad: float = 0.0
    resolver_order: float = 1.0
    resolver_phase_rad: float = 0.0
    cable_nm_per_arm_rad: float = 0.0
    cable_neutral_arm_rad: float = 0.0
    cable_cubic_per_arm_rad2: float = 0.0
    half_gap_rad: float = 0.0
    bump_nm: float = 0.0
    bump_center_arm_rad: float = 0.0
    bump_half_width_arm_rad: float = 1.0
    bump_follows_velocity: float = 0.0

    # What is in no library: outsiders.
    dwell_nm: float = 0.0
    dwell_time_s: float = 1.0
    dwell_travel_rad: float = 1.0
    settling_nm: float = 0.0
    settling_time_s: float = 1.0
    settling_backward: float = 0.0
    speeding_up_nm: float = 0.0
    speeding_up_rad_s2: float = 1.0
    play_nm: float = 0.0
    play_half_width_rad: float = 1.0
    play_velocity_rad_s: float = 1.0
    neighbour_nm: float = 0.0
    neighbour_hz: float = 1.0
    neighbour_beat_hz: float = 1.0
    churning_nm: float = 0.0
    churning_velocity_rad_s: float = 1.0
    churning_width_rad_s: float = 1.0
    seal_nm: float = 0.0
    seal_period_s: float = 1.0

    # What the drive makes of it when it reports.
    torque_factor: float = 1.0
    torque_factor_per_k: float = 0.0
    torque_factor_degc: float = 25.0
    torque_offset_nm: float = 0.0
    torque_delay_s: float = 0.0
    motion_delay_s: float = 0.0
    mains_nm: float = 0.0
    mains_hz: float = 50.0
    mains_phase_rad: float = 0.0

    @property
    def inertia_kg_m2(self) -> float:
        """Return what a rigid body would have."""
        return self.motor_inertia_kg_m2 + self.arm_inertia_kg_m2 + self.tool_inertia_kg_m2

    @property
    def dry_nm(self) -> float:
        """Return the dry friction of motor and arm together."""
        return self.coulomb_nm + self.arm_coulomb_nm


class RunState(NamedTuple):
    """How the joint is found when a recording starts.

    `age_runs` counts the recordings since the first; `phase_rad` is where whatever runs by itself,
    such as another axis, is found.
    """

    oil_degc: float
    winding_degc: float
    sensor_degc: float
    ambient_degc: float
    age_runs: float
    phase_rad: float
