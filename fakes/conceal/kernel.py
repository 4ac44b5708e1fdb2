"""The joint's equations and their integration, compiled. Import this late: numba is slow to load.

Three masses in a row (motor, arm, tool), a spring and damper between neighbours, a cascaded drive
in front. Dry friction is ``level * h``, where `h` is the mean of four elastic elements in parallel
that each slip at their own displacement (Maxwell slip, after Iwan, J. Appl. Mech. 33 (1966) 893):
rate-independent, with memory of every reversal, and never a sign of a velocity. The level follows
Bittencourt's exponentials or other forms. Semi-implicit Euler, eight steps a millisecond.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fakes.conceal.truth import RunState, Truth

Floats = NDArray[np.float64]

STEP_S = 0.000125
STEPS_PER_COMMAND = 8
COLUMNS = ("position", "velocity", "torque", "winding", "oil", "sensor", "arm")
_SLOW_RAD_S = 0.2  # below it the contacts count as dwelling
_HEAT_EVERY = 32  # steps: oil warms 10^4 times slower than the joint moves


@njit(cache=True)
def sliding_nm(p: Truth, speed: float) -> float:
    """Return what friction has, at a speed, beyond Coulomb and viscous; always a level."""
    level = 0.0
    if p.stribeck_nm != 0.0:
        ratio = speed / p.stribeck_velocity_rad_s
        if p.stribeck_is_rational != 0.0:
            level += p.stribeck_nm / (1.0 + ratio**p.stribeck_exponent)
        elif ratio < 40.0:
            level += p.stribeck_nm * math.exp(-(ratio**p.stribeck_exponent))
    if p.bend_nm != 0.0:
        ratio = speed / p.bend_velocity_rad_s
        if p.bend_exponent == 0.0:
            level += p.bend_nm * ratio / (1.0 + ratio)
        elif p.bend_exponent < 0.0:
            level += p.bend_nm * math.asinh(ratio)
        else:
            level += p.bend_nm * ratio**p.bend_exponent
    if p.churning_nm != 0.0:
        away = (speed - p.churning_velocity_rad_s) / p.churning_width_rad_s
        level += p.churning_nm * math.exp(-away * away)
    return level


@njit(cache=True)
def raised_cosine(away: float, half_width: float) -> float:
    """Return 1 at no distance, falling smoothly to 0 at `half_width` and beyond."""
    if abs(away) >= half_width:
        return 0.0
    return 0.5 + 0.5 * math.cos(math.pi * away / half_width)


@njit(cache=True)
def place_nm(p: Truth, arm: float) -> float:
    """Return what friction has, at an arm angle, beyond its mean level."""
    if p.tight_order_per_arm_rev != 0.0:
        return p.tight_nm * math.sin(p.tight_order_per_arm_rev * arm + p.tight_phase_rad)
    return p.tight_nm * raised_cosine(arm - p.tight_center_arm_rad, p.tight_half_width_arm_rad)


@njit(cache=True)
def oil_factor(p: Truth, oil_degc: float) -> float:
    """Return viscous friction at a temperature over that at 40 degC."""
    if p.oil_is_andrade != 0.0:
        # Andrade: viscosity goes with exp(B/T); the same slope at 40 degC as the exponential.
        bend = 313.15 * 313.15 / p.oil_scale_k
        thinner = math.exp(bend * (1.0 / (oil_degc + 273.15) - 1.0 / 313.15))
    else:
        thinner = math.exp(-(oil_degc - 40.0) / p.oil_scale_k)
    return 1.0 + p.oil_share * (thinner - 1.0)


@njit(cache=True)
def worn_factor(p: Truth, age_runs: float) -> float:
    """Return the dry level after so many runs over that of the first."""
    if p.drift_runs != 0.0:
        return 1.0 + p.drift_share * math.exp(-age_runs / p.drift_runs)
    return 1.0 + p.drift_share * age_runs


@njit(cache=True)
def arm_load_nm(p: Truth, arm: float, follows: float) -> float:
    """Return what the arm must be held against at an angle; `follows` is the slip state."""
    load = p.gravity_sin_nm * math.sin(arm) + p.gravity_cos_nm * math.cos(arm)
    if p.cable_nm_per_arm_rad != 0.0:
        away = arm - p.cable_neutral_arm_rad
        load += p.cable_nm_per_arm_rad * away * (1.0 + p.cable_cubic_per_arm_rad2 * away * away)
    if p.bump_nm != 0.0:
        bump = p.bump_nm * raised_cosine(arm - p.bump_center_arm_rad, p.bump_half_width_arm_rad)
        load += bump * follows if p.bump_follows_velocity != 0.0 else bump
    return load


@njit(cache=True)
def arm_loads_nm(p: Truth, arm: Floats, follows: Floats) -> Floats:
    """Return `arm_load_nm` at every row, shape (n,)."""
    out = np.empty(arm.shape[0])
    for row in range(arm.shape[0]):
        out[row] = arm_load_nm(p, arm[row], follows[row])
    return out


@njit(cache=True)
def shaft_nm(p: Truth, twist: float, twisting: float) -> float:
    """Return the torque of a spring and damper with clearance; the damper only acts in contact."""
    if p.half_gap_rad > 0.0:
        if abs(twist) <= p.half_gap_rad:
            return 0.0
        twist -= math.copysign(p.half_gap_rad, twist)
    return p.stiffness_nm_per_rad * twist + p.damping_nm_s_per_rad * twisting


@njit(cache=True)
def relaxed(drive: Floats, keep: float, start: float) -> Floats:
    """Return ``x <- keep x + drive``, shape (n,)."""
    out = np.empty(drive.shape[0])
    state = start
    for k in range(drive.shape[0]):
        state = keep * state + drive[k]
        out[k] = state
    return out


@njit(cache=True, nogil=True)
def simulate(  # noqa: C901 - one loop with local names: a call that carries the state doubles it
    p: Truth,
    run: RunState,
    command: Floats,
    samples: int,
    steps_per_sample: int,
) -> Floats:
    """Return what the drive sees, before it is rounded and noisy, shape (samples, 7): `COLUMNS`.

    Parameters
    ----------
    p : Truth
        Joint and drive.
    run : RunState
        How the joint is found.
    command : ndarray, shape (m, 3)
        Position, velocity and acceleration set-points, one a millisecond.
    samples : int
        Rows of the result, the first at time zero.
    steps_per_sample : int
        Steps of 0.125 ms between them.
    """
    dt = STEP_S
    out = np.empty((samples, 7))
    gear = 1.0 / p.gear_ratio
    position = command[0, 0]
    velocity = 0.0
    load = arm_load_nm(p, position * gear, 0.0)
    arm = position
    if load != 0.0:  # the spring carries the arm from the start
        arm -= load / p.stiffness_nm_per_rad + math.copysign(p.half_gap_rad, load)
    tool, arm_velocity, tool_velocity = arm, 0.0, 0.0
    torque, integral = load, load
    reported_velocity, reported_torque = 0.0, load
    report_share = 1.0 if p.report_lag_s <= 0.0 else -math.expm1(-dt / p.report_lag_s)
    current_share = -math.expm1(-dt / p.current_lag_s)
    z0 = z1 = z2 = z3 = arm_z = 0.0
    d2 = p.presliding_rad
    d0, d1, d3 = 0.25 * d2, 0.5 * d2, 2.0 * d2
    dwell, play, acceleration = 1.0, 0.0, 0.0
    oil, winding, sensor = run.oil_degc, run.winding_degc, run.sensor_degc
    viscous = p.viscous_nm_s_per_rad * oil_factor(p, oil)
    heat = copper = 0.0
    worn = worn_factor(p, run.age_runs)
    seal = 0.0
    duration = samples * steps_per_sample * dt
    last = command.shape[0] - 1
    row = 0
    for step in range(samples * steps_per_sample):
        time = step * dt
        read_position, read_velocity = position, velocity
        if p.resolver_rad != 0.0:
            angle = p.resolver_order * position + p.resolver_phase_rad
            read_position += p.resolver_rad * math.sin(angle)
            read_velocity *= 1.0 + p.resolver_rad * p.resolver_order * math.cos(angle)

        k = min(step // STEPS_PER_COMMAND, last)
        ahead = time - k * STEPS_PER_COMMAND * dt if k < last else 0.0
        wanted_velocity = command[k, 1] + ahead * command[k, 2]
        wanted = command[k, 0] + ahead * (command[k, 1] + 0.5 * ahead * command[k, 2])
        error = (
            wanted_velocity + p.position_gain_per_s * (wanted - read_position) - read_velocity
        ) * p.velocity_gain_nm_s_per_rad
        asked = error + integral + p.feedforward_kg_m2 * command[k, 2]
        if abs(asked) > p.torque_limit_nm:  # at its limit the integrator only moves back
            asked = math.copysign(p.torque_limit_nm, asked)
            if error * asked < 0.0:
                integral += p.integral_per_s * error * dt
        else:
            integral += p.integral_per_s * error * dt
        torque += current_share * (asked - torque)
        reported_velocity += report_share * (read_velocity - reported_velocity)
        reported_torque += report_share * (torque - reported_torque)

        if step % steps_per_sample == 0:
            out[row, 0] = read_position
            out[row, 1] = reported_velocity
            out[row, 2] = reported_torque
            out[row, 3] = winding
            out[row, 4] = oil
            out[row, 5] = sensor
            out[row, 6] = arm
            row += 1

        # Shaft, with the gear's wobble: what the motor feels is the wobble's slope times it.
        lead, slope = 0.0, 1.0
        if p.wobble_rad != 0.0:
            angle = p.wobble_order * position + p.wobble_phase_rad
            lead = p.wobble_rad * math.sin(angle)
            slope += p.wobble_rad * p.wobble_order * math.cos(angle)
        shaft = shaft_nm(p, position + lead - arm, slope * velocity - arm_velocity)
        angle = arm * gear

        travelled = velocity * dt
        z0 = min(max(z0 + travelled, -d0), d0)
        z1 = min(max(z1 + travelled, -d1), d1)
        z2 = min(max(z2 + travelled, -d2), d2)
        z3 = min(max(z3 + travelled, -d3), d3)
        slip = 0.25 * (z0 / d0 + z1 / d1 + z2 / d2 + z3 / d3)
        speed = abs(velocity)
        forward = slip > 0.0
        level = p.coulomb_nm * worn + sliding_nm(p, speed) + p.load_friction * abs(shaft)
        if p.tight_nm != 0.0:
            level += place_nm(p, angle)
        slope_nm_s = viscous
        if p.asymmetry_nm != 0.0:
            level += p.asymmetry_nm if forward else -p.asymmetry_nm
        if p.asymmetry_nm_s_per_rad != 0.0:
            slope_nm_s += p.asymmetry_nm_s_per_rad if forward else -p.asymmetry_nm_s_per_rad
        if p.dwell_nm != 0.0:
            if speed < _SLOW_RAD_S:
                dwell += (1.0 - dwell) * dt / p.dwell_time_s
            else:
                dwell -= dwell * min(speed * dt / p.dwell_travel_rad, 1.0)
            level += p.dwell_nm * dwell
        if p.settling_nm != 0.0:
            share = 1.0 if forward else p.settling_backward
            level += share * p.settling_nm * math.exp(-time / p.settling_time_s)
        if p.speeding_up_nm != 0.0:
            along = acceleration if forward else -acceleration
            level += p.speeding_up_nm * along / (abs(along) + p.speeding_up_rad_s2)
        if p.seal_nm != 0.0:
            seal = math.sin(2.0 * math.pi * time / p.seal_period_s + run.phase_rad)
            seal += math.sin(2.0 * math.pi * time / (1.618 * p.seal_period_s) + 2.0 * run.phase_rad)
            level += p.seal_nm if seal > 0.0 else -p.seal_nm
        level = max(level, 0.0)
        push = 0.0
        if p.ripple_nm != 0.0:
            push += p.ripple_nm * math.sin(p.ripple_order * position + p.ripple_phase_rad)
        if p.play_nm != 0.0:
            play = min(max(play + travelled, -p.play_half_width_rad), p.play_half_width_rad)
            push += p.play_nm * play / p.play_half_width_rad * speed / p.play_velocity_rad_s
        if p.neighbour_nm != 0.0:
            beat = math.sin(2.0 * math.pi * p.neighbour_beat_hz * time + run.phase_rad)
            if beat > 0.0:
                wave = math.sin(2.0 * math.pi * p.neighbour_hz * time + 3.0 * run.phase_rad)
                push += p.neighbour_nm * beat * wave

        rest = torque - slope * shaft - level * slip - push
        before = velocity
        # Viscous friction is taken implicitly: in steady motion torque is friction to the last bit.
        velocity = (velocity + dt * rest / p.motor_inertia_kg_m2) / (
            1.0 + dt * slope_nm_s / p.motor_inertia_kg_m2
        )
        acceleration += (dt / 0.01) * ((velocity - before) / dt - acceleration)
        stiff = p.tool_stiffness_nm_per_rad * (arm - tool)
        stiff += p.tool_damping_nm_s_per_rad * (arm_velocity - tool_velocity)
        arm_z = min(max(arm_z + arm_velocity * dt, -d2), d2)
        arm_dry = p.arm_coulomb_nm * worn * arm_z / d2
        held = arm_load_nm(p, angle, slip) + arm_dry
        arm_velocity += dt * (shaft - stiff - held) / p.arm_inertia_kg_m2
        tool_velocity += dt * stiff / p.tool_inertia_kg_m2
        position += dt * velocity
        arm += dt * arm_velocity
        tool += dt * tool_velocity

        heat += (level * slip + slope_nm_s * velocity) * velocity + arm_dry * arm_velocity
        copper += torque * torque
        if step % _HEAT_EVERY == 0:
            span = _HEAT_EVERY * dt
            oil += heat * dt / p.oil_capacity_j_per_k
            oil -= span * p.oil_cooling_per_s * (oil - run.ambient_degc)
            winding += copper * dt * p.winding_k_per_nm2_s
            winding -= span * p.winding_cooling_per_s * (winding - oil)
            sensor += span * (oil - sensor) / p.sensor_lag_s
            heat = copper = 0.0
            viscous = p.viscous_nm_s_per_rad * oil_factor(p, oil)
            worn = worn_factor(p, run.age_runs + time / duration)
    return out
