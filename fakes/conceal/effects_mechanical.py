"""How effects of contract section 4 in masses, springs, gears and cables are concealed."""

from __future__ import annotations

import math

import numpy as np

from fakes.conceal.concealment import (
    Concealment,
    Region,
    UnreachableError,
    angle,
    either_sign,
    heaviest_nm,
    numbers,
    scaled,
    speeds,
    stroke,
    stroke_ends,
    wave_numbers,
    whole_axis,
)
from fakes.conceal.robot import Robot
from fakes.conceal.truth import Truth


def torque_ripple(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal torque that waves with the motor's position."""
    order = float(rng.choice((1, 2, 3, 4, 6)))
    return Concealment(
        "torque-ripple",
        "sine",
        scaled({"ripple_nm": 1.0}, {"ripple_order": order, "ripple_phase_rad": angle(rng)}),
        1.5 * robot.floor_nm,
        0.6 * robot.truth.dry_nm,
        whole_axis("order_per_motor_rev", order - 0.5, order + 0.5),
        wave_numbers("ripple_nm", "ripple_order", "ripple_phase_rad", "nm"),
    )


def kinematic_error(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a gear whose ratio wobbles with position; the spring turns it into torque."""
    del robot
    order = float(rng.choice((1, 2)))
    return Concealment(
        "kinematic-error",
        "sine before the spring",
        scaled({"wobble_rad": 1.0}, {"wobble_order": order, "wobble_phase_rad": angle(rng)}),
        1e-3,
        0.1,
        whole_axis("order_per_motor_rev", order - 0.5, order + 0.5),
        wave_numbers("wobble_rad", "wobble_order", "wobble_phase_rad", "rad"),
    )


def inertia_error(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal masses that are not what the twin says."""
    known, top = robot.truth.inertia_kg_m2, robot.acceleration_rad_s2
    sign = either_sign(rng)

    def put(truth: Truth, share: float) -> Truth:
        extra = sign * share * known
        return truth._replace(arm_inertia_kg_m2=truth.arm_inertia_kg_m2 + extra)

    return Concealment(
        "inertia-error",
        "arm",
        put,
        0.05,
        0.25,
        whole_axis("acceleration_rad_s2", -top, top),
        lambda truth: {"inertia_extra_kg_m2": truth.inertia_kg_m2 - known},
        basis="as-given",
    )


def wrong_number(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal that the twin's Coulomb or viscous value is off."""
    name = str(rng.choice(("coulomb_nm", "viscous_nm_s_per_rad")))
    known, sign = robot.truth, either_sign(rng)

    def put(truth: Truth, share: float) -> Truth:
        return truth._replace(**{name: getattr(known, name) * (1.0 + sign * share)})

    def parameters(truth: Truth) -> dict[str, float]:
        return {
            "coulomb_extra_nm": truth.dry_nm - known.dry_nm,
            "viscous_extra_nm_s_per_rad": truth.viscous_nm_s_per_rad - known.viscous_nm_s_per_rad,
        }

    return Concealment(
        "wrong-number", name, put, 0.05, 0.9, speeds(robot), parameters, basis="as-given"
    )


def gravity_imbalance(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a mass that the twin does not know; only an axis that gravity loads can have one."""
    known = robot.truth
    if known.gravity_sin_nm == 0.0 and known.gravity_cos_nm == 0.0:
        raise UnreachableError("gravity-imbalance: gravity does not load this axis")
    phase = angle(rng)

    def put(truth: Truth, amplitude: float) -> Truth:
        return truth._replace(
            gravity_sin_nm=known.gravity_sin_nm + amplitude * math.cos(phase),
            gravity_cos_nm=known.gravity_cos_nm + amplitude * math.sin(phase),
        )

    def parameters(truth: Truth) -> dict[str, float]:
        return {
            "gravity_sin_nm": truth.gravity_sin_nm - known.gravity_sin_nm,
            "gravity_cos_nm": truth.gravity_cos_nm - known.gravity_cos_nm,
        }

    return Concealment(
        "gravity-imbalance",
        "unknown mass",
        put,
        2.0 * robot.floor_nm,
        2.0 * known.dry_nm,
        stroke(robot),
        parameters,
        basis="as-given",
    )


def cable_force(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a hose that pulls back like a spring, straight or stiffening."""
    low, high = stroke_ends(robot)
    stiffening = float(rng.choice((0.0, rng.uniform(0.5, 2.0))))
    neutral = 0.5 * (low + high) + rng.uniform(-0.3, 0.3) * (high - low)
    fixed = {"cable_neutral_arm_rad": neutral, "cable_cubic_per_arm_rad2": stiffening}
    return Concealment(
        "cable-force",
        "stiffening" if stiffening else "straight",
        scaled({"cable_nm_per_arm_rad": 1.0}, fixed),
        4.0 * robot.floor_nm,
        8.0 * robot.truth.dry_nm,
        stroke(robot),
        numbers(
            stiffness_nm_per_arm_rad="cable_nm_per_arm_rad",
            neutral_arm_rad="cable_neutral_arm_rad",
            cubic_per_arm_rad2="cable_cubic_per_arm_rad2",
        ),
    )


def joint_flexibility(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a soft gear: the arm's locked frequency falls."""
    del rng
    known = robot.truth

    def put(truth: Truth, softer: float) -> Truth:
        lower = 1.0 + softer
        return truth._replace(
            stiffness_nm_per_rad=known.stiffness_nm_per_rad / lower**2,
            damping_nm_s_per_rad=known.damping_nm_s_per_rad / lower,
        )

    def locked_hz(truth: Truth) -> float:
        moved = truth.arm_inertia_kg_m2 + truth.tool_inertia_kg_m2
        return math.sqrt(truth.stiffness_nm_per_rad / moved) / (2.0 * math.pi)

    return Concealment(
        "joint-flexibility",
        "linear spring",
        put,
        2.0,
        15.0,
        lambda truth: (Region("frequency_hz", 0.5 * locked_hz(truth), 2.0 * locked_hz(truth)),),
        numbers(
            stiffness_nm_per_rad="stiffness_nm_per_rad",
            damping_nm_s_per_rad="damping_nm_s_per_rad",
            arm_inertia_kg_m2="arm_inertia_kg_m2",
        ),
    )


def backlash(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal clearance in the gear; damper and spring act in contact only.

    Where it is crossed follows from the motion: the label reads it off that.
    """
    del rng
    anywhere = whole_axis("load_torque_nm", -heaviest_nm(robot), heaviest_nm(robot))
    return Concealment(
        "backlash",
        "dead zone",
        scaled({"half_gap_rad": 1.0}),
        0.05,
        1.5,
        anywhere,
        numbers(half_gap_rad="half_gap_rad"),
    )


def local_fault(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a bump at one place: a dent, which pushes, or something that rubs."""
    low, high = stroke_ends(robot)
    half = rng.uniform(0.02, 0.06) * (high - low)
    centre = 0.5 * (low + high) + rng.uniform(-0.2, 0.2) * (high - low)
    rubs = bool(rng.random() < 0.5)
    fixed = {
        "bump_center_arm_rad": centre,
        "bump_half_width_arm_rad": half,
        "bump_follows_velocity": float(rubs),
    }
    return Concealment(
        "local-fault",
        "rubs" if rubs else "pushes",
        scaled({"bump_nm": 1.0 if rubs else either_sign(rng)}, fixed),
        5.0 * robot.floor_nm,
        3.0 * robot.truth.dry_nm,
        whole_axis("arm_position_rad", centre - 0.7 * half, centre + 0.7 * half),
        numbers(
            height_nm="bump_nm",
            center_arm_rad="bump_center_arm_rad",
            half_width_arm_rad="bump_half_width_arm_rad",
        ),
    )
