"""A joint with an arm behind a gear, integrated in small steps, apart from the product's laws.

Friction of motor and arm is a smooth Dahl state each, the gear is a spring and damper behind a gap,
and the drive is a position loop over a velocity loop with a torque limit. What is measured is noisy
and may be late.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from agent.explain.rows.run import Run

Floats = NDArray[np.float64]

GEAR = 100.0
RATE_HZ = 500.0
_STEP_S = 5e-5
_PER_SAMPLE = round(1.0 / (RATE_HZ * _STEP_S))


class Joint(NamedTuple):
    """Motor side, SI; what a recording does not show is zero or far away."""

    motor_inertia: float = 0.003
    arm_inertia: float = 0.003
    stiffness: float = 430.0  # the arm's locked frequency is 60 Hz: as good as rigid
    damping: float = 0.25
    half_gap: float = 0.0
    film: float = 0.0  # N m s/rad, between the teeth, apart or not
    gravity_sin: float = 0.5
    gravity_cos: float = 0.2
    motor_coulomb: float = 0.35
    motor_reach: float = 0.002
    arm_coulomb: float = 0.15
    arm_reach: float = 0.01
    viscous: float = 0.004
    limit: float = 1e9
    stiff_loop: float = 25.0
    loop: float = 0.35
    arm_viscous: float = 0.0
    wobble: float = 0.0  # rad of the motor, of the gear: by its sine, twice a turn
    misread: float = 0.0  # rad, of the motor's angle, likewise
    misread_once: float = 0.0  # rad, once a turn
    rubbing_wave: float = 0.0  # N m, of the motor's dry friction along its turn
    rubbing_order: float = 9.0
    cubic: float = 0.0  # N m/rad3, of the gear: its spring stiffens
    held: float = 0.0  # N m, what the gear's inner friction holds: half of it early, half later
    held_over: float = 0.01  # rad of twist, and three times that
    parting: float = 0.0  # share of the damping that holds parting teeth back; 1: a plain damper


def moves(seed: int, duration_s: float, *, hardest_rad_s2: float = 150.0) -> Floats:
    """Return smooth moves there and back as set-points of angle and speed, shape (m, 2).

    Each ramps up, holds a speed, and ramps down; stops between them are short or none.
    """
    rng = np.random.default_rng(seed)
    speeds: list[Floats] = []
    here = 0.0
    while sum(part.shape[0] for part in speeds) * _STEP_S < duration_s:
        top = 80.0 * 10.0 ** rng.uniform(-1.3, 0.0)
        ramp_s = 1.5 * top / (hardest_rad_s2 * rng.uniform(0.3, 1.0))
        hold_s = rng.uniform(0.5, 1.2)
        u = np.arange(0.0, ramp_s, _STEP_S) / ramp_s
        rise = u**2 * (3.0 - 2.0 * u)
        rest = np.zeros(round(rng.choice((0.0, 0.06)) / _STEP_S))
        shape = np.concatenate((rise, np.ones(round(hold_s / _STEP_S)), rise[::-1], rest))
        sign = -1.0 if here > 0.0 else 1.0
        speeds.append(sign * top * shape)
        here += sign * top * float(shape.sum()) * _STEP_S
    speed = np.concatenate(speeds)
    return np.column_stack((np.cumsum(speed) * _STEP_S, speed))


def waves(seed: int, duration_s: float, *, fastest_hz: float = 2.0, top: float = 60.0) -> Floats:
    """Return a sum of sines as set-points of angle and speed, shape (m, 2): it begins in motion."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration_s / _STEP_S)) * _STEP_S
    angle, speed = np.zeros_like(time), np.zeros_like(time)
    for hertz in np.linspace(0.1, fastest_hz, 12):
        size, phase = rng.uniform(0.3, 1.0) / hertz**0.6, rng.uniform(0.0, 2.0 * math.pi)
        turned = 2.0 * math.pi * hertz * time + phase
        angle += size * np.sin(turned) / (2.0 * math.pi * hertz)
        speed += size * np.cos(turned)
    return top / float(np.max(np.abs(speed))) * np.column_stack((angle, speed))


@njit(cache=True)
def _driven(j: Joint, command: Floats, every: int) -> Floats:
    dt = _STEP_S
    q, v = command[0]
    held = j.gravity_sin * math.sin(q / GEAR) + j.gravity_cos * math.cos(q / GEAR)
    arm = q - held / j.stiffness - (math.copysign(j.half_gap, held) if held != 0.0 else 0.0)
    speed, dry, arm_dry, integral, early, later = v, 0.0, 0.0, held, 0.0, 0.0
    out = np.empty((command.shape[0] // every, 5))
    for i in range(out.shape[0] * every):
        sine, slope = math.sin(2.0 * q), 2.0 * math.cos(2.0 * q)
        read = q + j.misread * sine + j.misread_once * math.sin(q)
        speed_read = v * (1.0 + j.misread * slope + j.misread_once * math.cos(q))
        error = command[i, 1] + j.stiff_loop * (command[i, 0] - read) - speed_read
        torque = j.loop * error + integral
        if abs(torque) > j.limit:
            torque = math.copysign(j.limit, torque)
        else:
            integral += dt * 8.0 * j.loop * error
        if i % every == 0:
            out[i // every, 0], out[i // every, 1] = read, speed_read
            out[i // every, 2], out[i // every, 3] = torque, command[i, 1]
            out[i // every, 4] = arm
        geared = 1.0 + j.wobble * slope
        twist = q + j.wobble * sine - arm
        open_ = abs(twist) - j.half_gap
        shaft = 0.0
        if open_ > 0.0:
            spring = (j.stiffness + j.cubic * open_**2) * open_
            drag = j.damping * (geared * v - speed)
            shaft = math.copysign(spring, twist) + drag
            least = math.copysign(j.parting * drag, -twist)
            if j.half_gap > 0.0 and (shaft - least) * twist < 0.0:
                shaft = least
        shaft += j.film * (geared * v - speed) + 0.5 * j.held * (early + later)
        wound = dt * (geared * v - speed) / j.held_over
        early = min(max(early + wound, -1.0), 1.0)
        later = min(max(later + wound / 3.0, -1.0), 1.0)
        dry += dt * (v - abs(v) * dry) / j.motor_reach
        arm_dry += dt * (speed - abs(speed) * arm_dry) / j.arm_reach
        weight = j.gravity_sin * math.sin(arm / GEAR) + j.gravity_cos * math.cos(arm / GEAR)
        level = j.motor_coulomb + j.rubbing_wave * math.cos(j.rubbing_order * q)
        rubbing = level * dry + j.viscous * v
        v += dt * (torque - geared * shaft - rubbing) / j.motor_inertia
        rubbed = j.arm_coulomb * arm_dry + j.arm_viscous * speed
        speed += dt * (shaft - weight - rubbed) / j.arm_inertia
        q += dt * v
        arm += dt * speed
    return out


def record(
    joint: Joint,
    seed: int,
    *,
    duration_s: float = 30.0,
    torque_late_s: float = 0.0,
    torque_step_nm: float = 0.0,
    noise_nm: float = 0.01,
    hardest_rad_s2: float = 150.0,
    has_command: bool = True,
    arm_late_s: float = math.nan,
    every: int = 1,
    command: Floats | None = None,
) -> Run:
    """Return one noisy recording; torque that is late by less than zero makes the motion late.

    Of its samples only one in `every` is recorded.

    With `arm_late_s` the arm has an encoder of its own, late by so much. `command` are other
    set-points than those of `moves`.
    """
    if command is None:
        command = moves(seed, duration_s, hardest_rad_s2=hardest_rad_s2)
    raw = _driven(joint, command, _PER_SAMPLE)
    rng = np.random.default_rng(seed + 1000)
    time = np.arange(raw.shape[0]) / RATE_HZ
    position, velocity, torque, wanted, arm = raw.T
    late_s = max(-torque_late_s, 0.0)
    position, velocity = (np.interp(time - late_s, time, x) for x in (position, velocity))
    torque = np.interp(time - max(torque_late_s, 0.0), time, torque)
    torque = torque + noise_nm * rng.standard_normal(time.shape)
    if torque_step_nm:
        torque = torque_step_nm * np.round(torque / torque_step_nm)
    columns = {
        "time_s": time,
        "position_rad": 2.0 * np.pi / 2**17 * np.round(position * 2**17 / (2.0 * np.pi)),
        "velocity_rad_s": velocity + 0.01 * rng.standard_normal(time.shape),
        "torque_nm": torque,
    }
    if math.isfinite(arm_late_s):
        # 2^22 counts a turn of the arm; wherever it was homed, it does not read the motor's angle.
        seen = np.interp(time - arm_late_s, time, arm) / GEAR + 0.3
        columns["position_arm_rad"] = 2.0 * np.pi / 2**22 * np.round(seen * 2**22 / (2.0 * np.pi))
    if has_command:
        columns["velocity_command_rad_s"] = wanted
    columns = {name: column[::every] for name, column in columns.items()}
    return Run.from_columns(columns, GEAR, name=f"run-{seed}", started_s=100.0 * seed)
