"""How effects of contract section 4 between the joint and its recording are concealed."""

from __future__ import annotations

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
    wave_numbers,
    whole_axis,
)
from fakes.conceal.robot import Robot
from fakes.conceal.truth import Truth


def torque_constant_error(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a torque constant that is wrong, or that falls as the magnets warm."""
    if rng.random() < 0.3:
        sign, heaviest = either_sign(rng), heaviest_nm(robot)
        return Concealment(
            "torque-constant-error",
            "constant",
            lambda truth, share: truth._replace(torque_factor=1.0 + sign * share),
            0.05,
            0.4,
            whole_axis("torque_nm", -heaviest, heaviest),
            numbers(factor="torque_factor"),
            basis="as-given",
        )
    return Concealment(
        "torque-constant-error",
        "falls with winding temperature",
        scaled({"torque_factor_per_k": -1.0}, {"torque_factor_degc": 25.0}),
        0.001,
        0.006,
        whole_axis("motor_temperature_degc", 20.0, 80.0),
        numbers(
            factor="torque_factor",
            factor_per_k="torque_factor_per_k",
            reference_degc="torque_factor_degc",
        ),
    )


def torque_offset(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a constant that the drive adds to the torque it reports."""
    return Concealment(
        "torque-offset",
        "constant",
        scaled({"torque_offset_nm": either_sign(rng)}),
        robot.floor_nm,
        robot.truth.dry_nm,
        speeds(robot),
        numbers(torque_offset_nm="torque_offset_nm"),
        also=("direction-asymmetry",),
    )


def torque_saturation(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a torque limit below what the motion asks for; it shows against the set-points."""
    del rng
    heaviest = heaviest_nm(robot)

    def where(truth: Truth) -> tuple[Region, ...]:
        limit = truth.torque_limit_nm
        near = 0.02 * limit
        return (
            Region("torque_nm", -limit - near, -limit + near),
            Region("torque_nm", limit - near, limit + near),
        )

    return Concealment(
        "torque-saturation",
        "clipped, with anti-windup",
        lambda truth, share: truth._replace(torque_limit_nm=heaviest / (1.0 + share)),
        0.3,
        3.0,
        where,
        numbers(limit_nm="torque_limit_nm"),
        basis="commanded",
    )


def measurement_delay(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal that torque, or position and velocity, arrive late.

    The label tells by how much a recording's torque comes after its position: what the drive's own
    filter or difference adds, to every recording of the joint, is a part of that.
    """
    late = "torque" if rng.random() < 0.5 else "motion"
    top = robot.acceleration_rad_s2
    return Concealment(
        "measurement-delay",
        f"{late} is late",
        scaled({f"{late}_delay_s": 1.0}),
        0.003,
        0.06,
        whole_axis("acceleration_rad_s2", -top, top),
        lambda truth: {
            "torque_delay_s": truth.torque_delay_s
            - truth.motion_delay_s
            + _reported_s(truth, robot)
        },
    )


def _reported_s(truth: Truth, robot: Robot) -> float:
    """Return by how much torque and velocity are reported later than the position, s."""
    if robot.sensing.velocity == "difference":
        return 0.5 / robot.sensing.sample_rate_hz
    return truth.report_lag_s


def resolver_error(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a periodic error of the measured position, inside the drive's loop."""
    del robot
    order = float(rng.choice((1, 2, 3, 4)))
    return Concealment(
        "resolver-error",
        "sine",
        scaled({"resolver_rad": 1.0}, {"resolver_order": order, "resolver_phase_rad": angle(rng)}),
        3e-4,
        0.05,
        whole_axis("order_per_motor_rev", order - 0.5, order + 0.5),
        wave_numbers("resolver_rad", "resolver_order", "resolver_phase_rad", "rad"),
    )
