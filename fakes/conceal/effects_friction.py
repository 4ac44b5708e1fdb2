"""How each friction effect of contract section 4 is drawn and concealed."""

from __future__ import annotations

import math

import numpy as np

from fakes.conceal.concealment import (
    Concealment,
    Region,
    angle,
    either_sign,
    heaviest_nm,
    numbers,
    scaled,
    speeds,
    stroke,
    stroke_ends,
    time_to_travel_s,
    wave_numbers,
    whole_axis,
)
from fakes.conceal.robot import Robot
from fakes.conceal.truth import Truth

_VISIBLE = 0.2  # a region ends where an effect has this share of its amplitude left


def stribeck(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal friction that falls with speed: a stretched exponential, or a rational fall."""
    velocity = robot.top_rad_s * rng.uniform(0.03, 0.1)
    rational = bool(rng.random() < 0.3)
    exponent = rng.uniform(1.5, 2.5) if rational else rng.uniform(0.8, 2.0)
    far = (1.0 / _VISIBLE - 1.0) if rational else math.log(1.0 / _VISIBLE)
    reach = velocity * far ** (1.0 / exponent)
    fixed = {
        "stribeck_velocity_rad_s": velocity,
        "stribeck_exponent": exponent,
        "stribeck_is_rational": float(rational),
    }
    return Concealment(
        "stribeck",
        "rational" if rational else "exponential",
        scaled({"stribeck_nm": 1.0}, fixed),
        4.0 * robot.floor_nm,
        2.0 * robot.truth.dry_nm,
        whole_axis("velocity_rad_s", -reach, reach),
        numbers(
            static_extra_nm="stribeck_nm",
            stribeck_velocity_rad_s="stribeck_velocity_rad_s",
            exponent="stribeck_exponent",
        ),
    )


def viscous_nonlinear(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal sliding friction that bends: Cross or Eyring shear thinning, or a power law."""
    form = str(rng.choice(("cross", "eyring", "power")))
    exponent = {"cross": 0.0, "eyring": -1.0}.get(form) if form != "power" else None
    if exponent is None:
        exponent = float(rng.choice((rng.uniform(0.35, 0.7), rng.uniform(1.6, 2.2))))
    fixed = {
        "bend_exponent": exponent,
        "bend_velocity_rad_s": robot.top_rad_s * rng.uniform(0.1, 0.3),
    }
    return Concealment(
        "viscous-nonlinear",
        form,
        scaled({"bend_nm": 1.0}, fixed),
        3.0 * robot.floor_nm,
        3.0 * robot.truth.dry_nm,
        speeds(robot),
        numbers(
            power_nm="bend_nm",
            reference_velocity_rad_s="bend_velocity_rad_s",
            exponent="bend_exponent",
        )
        if form == "power"
        else numbers(bend_nm="bend_nm", bend_velocity_rad_s="bend_velocity_rad_s"),
    )


def direction_asymmetry(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a Coulomb or viscous level that differs between the directions."""
    sign = either_sign(rng)
    if rng.random() < 0.6:
        return Concealment(
            "direction-asymmetry",
            "coulomb",
            scaled({"asymmetry_nm": sign}),
            robot.floor_nm,
            0.8 * robot.truth.dry_nm,
            speeds(robot),
            lambda truth: {"coulomb_difference_nm": 2.0 * truth.asymmetry_nm},
            also=("torque-offset",),
        )
    return Concealment(
        "direction-asymmetry",
        "viscous",
        scaled({"asymmetry_nm_s_per_rad": sign}),
        2.0 * robot.floor_nm / robot.top_rad_s,
        0.8 * robot.truth.viscous_nm_s_per_rad,
        speeds(robot),
        lambda truth: {"viscous_difference_nm_s_per_rad": 2.0 * truth.asymmetry_nm_s_per_rad},
    )


def load_dependent_friction(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal friction that grows with the torque in the gear's shaft."""
    del rng
    heaviest = heaviest_nm(robot)
    return Concealment(
        "load-dependent-friction",
        "proportional to the shaft's torque",
        scaled({"load_friction": 1.0}),
        0.1,
        0.5,
        whole_axis("load_torque_nm", -heaviest, heaviest),
        numbers(load_coefficient="load_friction"),
    )


def temperature_dependent_friction(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal viscosity that falls with the oil's temperature: exponential, or Andrade's law."""
    del robot
    andrade = bool(rng.random() < 0.4)
    fixed = {"oil_scale_k": rng.uniform(15.0, 30.0), "oil_is_andrade": float(andrade)}
    return Concealment(
        "temperature-dependent-friction",
        "andrade" if andrade else "exponential",
        scaled({"oil_share": 1.0}, fixed),
        0.3,
        1.3,
        whole_axis("gearbox_temperature_degc", 20.0, 60.0),
        lambda truth: {
            "viscous_thermal_nm_s_per_rad": truth.oil_share * truth.viscous_nm_s_per_rad,
            "reference_degc": 40.0,
            "decay_k": truth.oil_scale_k,
        },
    )


def position_dependent_friction(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a friction level that waves along the stroke, or one tight spot in it."""
    low, high = stroke_ends(robot)
    if rng.random() < 0.6:
        fixed = {
            "tight_order_per_arm_rev": float(rng.integers(2, 8)),
            "tight_phase_rad": angle(rng),
        }
        return Concealment(
            "position-dependent-friction",
            "wave",
            scaled({"tight_nm": 1.0}, fixed),
            2.0 * robot.floor_nm,
            0.8 * robot.truth.dry_nm,
            stroke(robot),
            wave_numbers(
                "tight_nm", "tight_order_per_arm_rev", "tight_phase_rad", "nm", turn="arm"
            ),
        )
    half = rng.uniform(0.1, 0.25) * (high - low)
    centre = 0.5 * (low + high) + rng.uniform(-0.2, 0.2) * (high - low)
    fixed = {"tight_center_arm_rad": centre, "tight_half_width_arm_rad": half}
    return Concealment(
        "position-dependent-friction",
        "tight spot",
        scaled({"tight_nm": 1.0}, fixed),
        2.0 * robot.floor_nm,
        2.0 * robot.truth.dry_nm,
        whole_axis("arm_position_rad", centre - 0.7 * half, centre + 0.7 * half),
        numbers(
            height_nm="tight_nm",
            center_arm_rad="tight_center_arm_rad",
            half_width_arm_rad="tight_half_width_arm_rad",
        ),
    )


def presliding_hysteresis(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal contacts that yield far before they slip: the Maxwell elements grow soft."""
    del rng

    def where(truth: Truth) -> tuple[Region, ...]:
        # Elements that slip after half, one, two and four times this distance: a fifth of what the
        # turned friction lacks at first is left after 1.6 times.
        slipped = time_to_travel_s(robot, 1.6 * truth.presliding_rad)
        return (Region("after_reversal_s", 0.0, slipped),)

    return Concealment(
        "presliding-hysteresis",
        "four Maxwell elements",
        lambda truth, rad: truth._replace(presliding_rad=truth.presliding_rad + rad),
        0.1,
        6.0,
        where,
        lambda truth: {"sliding_travel_rad": 2.0 * truth.presliding_rad},
    )


def friction_drift(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal wear, which grows from run to run, or run-in, which settles."""
    del robot
    run_in = bool(rng.random() < 0.5)
    fixed = {"drift_runs": rng.uniform(1.5, 3.0) if run_in else 0.0}
    return Concealment(
        "friction-drift",
        "run-in" if run_in else "wear",
        scaled({"drift_share": 1.0}, fixed),
        0.05,
        0.6,
        whole_axis("recording", 0.0, 8.0),
        numbers(coulomb_share="drift_share", settles_over_runs="drift_runs")
        if run_in
        else lambda truth: {
            "coulomb_nm_per_run": truth.drift_share * truth.dry_nm,
            "reference_run": 0.0,
        },
    )
