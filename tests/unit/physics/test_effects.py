"""What each effect adds to a twin's torque, by hand; and what is refused by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from agent.physics.twin import Effect, Twin, TwinError

N = 400
TIME = np.linspace(0.0, 2.0, N)
POSITION = 40.0 * np.sin(3.0 * TIME)
VELOCITY = 120.0 * np.cos(3.0 * TIME)
ACCELERATION = -360.0 * np.sin(3.0 * TIME)
TEMPERATURE = np.linspace(20.0, 60.0, N)
CLAMPED = np.maximum(TEMPERATURE, 30.0)
SIGN = np.sign(VELOCITY)
ARM = POSITION / 100.0


def twin(*effects: Effect) -> Twin:
    return Twin("r", 1, 100.0, 0.02, 0.6, 0.01, 0.2, -0.1, effects)


def predicted(*effects: Effect) -> Any:
    return twin(*effects).predict_torque(
        POSITION,
        VELOCITY,
        ACCELERATION,
        time_s=TIME,
        gearbox_temperature_degc=TEMPERATURE,
        motor_temperature_degc=TEMPERATURE,
        started_at_unix_s=3.0 * 3600.0,
        run=7.0,
        payload_kg=3.0,
    )


SPEED = np.abs(VELOCITY)
PATH = np.append(0.0, np.cumsum(0.5 * (SPEED[1:] + SPEED[:-1]) * np.diff(TIME)))
ODOMETER = {
    "reference_operating_h": 0.0,
    "recorded_from": ["1970-01-01T00:00:00Z", "1970-01-01T01:00:00Z"],
}
GRAVITY = 0.2 * np.sin(ARM) - 0.1 * np.cos(ARM)
BY_HAND: list[tuple[str, dict[str, Any], Any]] = [
    (
        "stribeck",
        {"static_extra_nm": 0.3, "stribeck_velocity_rad_s": 7.0, "exponent": 1.3},
        0.3 * SIGN * np.exp(-((np.abs(VELOCITY) / 7.0) ** 1.3)),
    ),
    (
        "viscous-nonlinear",
        {"power_nm": -0.2, "reference_velocity_rad_s": 50.0, "exponent": 2.0},
        -0.2 * SIGN * (VELOCITY / 50.0) ** 2,
    ),
    (
        "viscous-nonlinear",
        {"shear_nm": 0.1, "shear_velocity_rad_s": 5.0},
        0.1 * np.arcsinh(VELOCITY / 5.0),
    ),
    (
        "viscous-nonlinear",
        {"plateau_nm": 0.2, "plateau_velocity_rad_s": 5.0},
        0.2 * VELOCITY / (np.abs(VELOCITY) + 5.0),
    ),
    (
        "direction-asymmetry",
        {"coulomb_difference_nm": 0.1, "viscous_difference_nm_s_per_rad": 0.002},
        0.05 + 0.001 * np.abs(VELOCITY),
    ),
    ("load-dependent-friction", {"load_coefficient": 0.1}, 0.1 * np.abs(GRAVITY) * SIGN),
    (
        "load-dependent-friction",
        {"load_coefficient": 0.1, "arm_inertia_kg_m2": 0.01},
        0.1 * np.abs(0.01 * ACCELERATION + GRAVITY) * SIGN,
    ),
    (
        "temperature-dependent-friction",
        {"viscous_thermal_nm_s_per_rad": 0.01, "reference_degc": 30.0, "decay_k": 20.0},
        0.01 * (np.exp(-(TEMPERATURE - 30.0) / 20.0) - 1.0) * VELOCITY,
    ),
    (
        "temperature-dependent-friction",
        {
            "viscous_thermal_nm_s_per_rad": 0.01,
            "reference_degc": 30.0,
            "decay_k": 20.0,
            "coulomb_nm_per_k": 0.002,
        },
        0.01 * (np.exp(-(TEMPERATURE - 30.0) / 20.0) - 1.0) * VELOCITY
        + 0.002 * (TEMPERATURE - 30.0) * SIGN,
    ),
    (
        "temperature-dependent-friction",
        {"coulomb_nm_per_k": -0.004, "reference_degc": 30.0},
        -0.004 * (TEMPERATURE - 30.0) * SIGN,
    ),
    (
        "temperature-dependent-friction",
        {
            "static_nm": -0.5,
            "static_nm_per_k": 0.03,
            "stribeck_velocity_rad_s": -20.0,
            "stribeck_velocity_rad_s_per_k": 1.0,
            "exponent": 1.3,
            "viscous_thermal_nm_s_per_rad": 0.02,
            "decay_k": 21.0,
        },
        # Below 30 degC the published law is clamped.
        SIGN
        * (
            (-0.5 + 0.03 * CLAMPED) * np.exp(-((np.abs(VELOCITY) / (CLAMPED - 20.0)) ** 1.3))
            + 0.02 * np.exp(-CLAMPED / 21.0) * np.abs(VELOCITY)
        ),
    ),
    (
        "position-dependent-friction",
        {"cos_nm": 0.1, "sin_nm": 0.0, "order_per_arm_rev": 3.0},
        0.1 * np.cos(3.0 * ARM) * SIGN,
    ),
    (
        "position-dependent-friction",
        {"cos_nm": 0.0, "sin_nm": 0.1, "order_per_motor_rev": 2.0},
        0.1 * np.sin(2.0 * POSITION) * SIGN,
    ),
    (
        "position-dependent-friction",
        {"height_nm": 0.2, "center_arm_rad": 0.1, "width_arm_rad": 0.02},
        0.2 * np.exp(-0.5 * ((ARM - 0.1) / 0.02) ** 2) * SIGN,
    ),
    (
        "friction-drift",
        {
            "coulomb_nm_per_h": 0.02,
            "viscous_nm_s_per_rad_per_h": 1e-4,
            "reference_started_at": "1970-01-01T02:00:00Z",
        },
        (0.02 * SIGN + 1e-4 * VELOCITY) * (3.0 - 2.0 + TIME / 3600.0),
    ),
    (
        "friction-drift",
        {"coulomb_nm_per_run": -0.03, "reference_run": 2.0},
        -0.03 * (7.0 - 2.0) * SIGN,
    ),
    (
        "friction-drift",
        {
            "coulomb_change_nm": -0.2,
            "viscous_change_nm_s_per_rad": 1e-3,
            "settling_h": 5.0,
            "reference_started_at": "1970-01-01T01:00:00+01:00",
        },
        (-0.2 * SIGN + 1e-3 * VELOCITY) * (1.0 - np.exp(-(3.0 + TIME / 3600.0) / 5.0)),
    ),
    (
        "friction-drift",
        {
            "coulomb_step_nm": 0.2,
            "viscous_step_nm_s_per_rad": -1e-3,
            "changed_at": "1970-01-01T03:00:01Z",
        },
        (0.2 * SIGN - 1e-3 * VELOCITY) * (TIME >= 0.5),  # half a second for a rounded instant
    ),
    (
        "gravity-imbalance",
        {
            "inertia_kg_m2_per_kg": 0.002,
            "gravity_sin_nm_per_kg": 0.1,
            "gravity_cos_nm_per_kg": -0.05,
            "reference_payload_kg": 1.0,
        },
        2.0 * (0.002 * ACCELERATION + 0.1 * np.sin(ARM) - 0.05 * np.cos(ARM)),
    ),
    (
        "friction-drift",
        {
            "coulomb_nm_per_operating_h": 0.5,
            "viscous_nm_s_per_rad_per_operating_h": 1e-3,
            "reference_operating_h": 0.1,
            "recorded_from": [f"1970-01-01T{hour}:00:00Z" for hour in ("00", "03", "05")],
            "operating_h": [0.0, 0.2, 0.9],
        },
        (0.5 * SIGN + 1e-3 * VELOCITY) * (0.2 - 0.1 + TIME / 3600.0),
    ),
    (
        "friction-drift",
        {
            "coulomb_change_nm": 0.3,
            "settling_1000_turns": 2.0,
            "recorded_from": ["1970-01-01T00:00:00Z", "1970-01-01T01:00:00Z"],
            "motor_1000_turns": [0.0, 4.0],
        },
        0.3 * SIGN * (1.0 - np.exp(-0.5 * (4.0 + PATH / (2000.0 * np.pi)))),
    ),
    (
        "torque-ripple",
        {"cos_nm": 0.0, "sin_nm": 0.1, "order_per_motor_rev": 5.0},
        0.1 * np.sin(5.0 * POSITION),
    ),
    (
        "torque-ripple",
        {"cos_nm": 0.1, "sin_nm": 0.0, "order_per_arm_rev": 202.0},
        0.1 * np.cos(202.0 * ARM),
    ),
    ("torque-offset", {"torque_offset_nm": -0.04}, np.full(N, -0.04)),
    ("inertia-error", {"inertia_extra_kg_m2": 0.004}, 0.004 * ACCELERATION),
    ("wrong-number", {"coulomb_extra_nm": 0.1}, 0.1 * SIGN),
    (
        "wrong-number",
        {"viscous_extra_nm_s_per_rad": -0.001},
        -0.001 * VELOCITY,
    ),
    (
        "gravity-imbalance",
        {"gravity_sin_nm": 0.3, "gravity_cos_nm": 0.1},
        0.3 * np.sin(ARM) + 0.1 * np.cos(ARM),
    ),
    ("cable-force", {"stiffness_nm_per_arm_rad": 0.5, "neutral_arm_rad": 0.1}, 0.5 * (ARM - 0.1)),
    (
        "cable-force",
        {"stiffness_nm_per_arm_rad": 0.5, "cubic_nm_per_arm_rad3": 2.0, "neutral_arm_rad": 0.1},
        0.5 * (ARM - 0.1) + 2.0 * (ARM - 0.1) ** 3,
    ),
    (
        "cable-force",
        {"stiffness_nm_per_arm_rad": 0.5, "neutral_arm_rad": 0.1, "stiffening_arm_rad": 0.4},
        0.2 * np.sinh((ARM - 0.1) / 0.4),
    ),
    (
        "cable-force",
        {"balancer_nm": 0.5, "lever_ratio": 0.6, "dead_center_arm_rad": 0.1},
        0.5 * np.sin(ARM - 0.1) / np.sqrt(1.36 - 1.2 * np.cos(ARM - 0.1)),
    ),
    (
        "local-fault",
        {"height_nm": 0.2, "center_arm_rad": 0.1, "width_arm_rad": 0.02},
        0.2 * np.exp(-0.5 * ((ARM - 0.1) / 0.02) ** 2),
    ),
]


@pytest.mark.parametrize(("effect", "parameters", "added"), BY_HAND)
def test_an_effect_adds_its_law_and_nothing_else(
    effect: str, parameters: dict[str, Any], added: Any
) -> None:
    assert predicted(Effect(effect, parameters)) - predicted() == pytest.approx(added, abs=1e-12)


def test_kinematic_error_grows_with_the_square_of_speed() -> None:
    numbers = {"cos_rad": 1e-3, "sin_rad": 0.0, "order_per_motor_rev": 2.0}
    wobble = twin(Effect("kinematic-error", {**numbers, "arm_inertia_kg_m2": 0.01}))
    wobble, plain = (replace(t, gravity_sin_nm=0.0, gravity_cos_nm=0.0) for t in (wobble, twin()))
    still = np.zeros(N)
    amplitude = [
        float(
            np.ptp(
                wobble.predict_torque(POSITION, np.full(N, speed), still)
                - plain.predict_torque(POSITION, np.full(N, speed), still)
            )
        )
        for speed in (20.0, 60.0)
    ]
    assert amplitude[1] == pytest.approx(9.0 * amplitude[0])


def test_a_wobble_shakes_the_arm_through_the_gears_spring() -> None:
    inertia, angle, speed, order, hertz, damping = 0.01, 1e-4, 20.0, 2.0, 10.0, 0.2
    numbers = {"cos_rad": angle, "sin_rad": 0.0, "order_per_motor_rev": order}
    numbers |= {"arm_inertia_kg_m2": inertia, "antiresonance_hz": hertz, "damping_ratio": damping}
    wobble = Twin("r", 1, 100.0, 0.0, 0.0, 0.0, effects=(Effect("kinematic-error", numbers),))
    time = np.arange(0.0, 8.0, 2e-3)
    motion = speed * time, np.full(time.shape, speed), np.zeros(time.shape)
    added = wobble.predict_torque(*motion, time_s=time)[time > 4.0]
    turns = order * speed / (2.0 * np.pi * hertz)  # of the wave over the arm's own swing
    follows = (1.0 + 2j * damping * turns) / (1.0 - turns**2 + 2j * damping * turns)
    wave = -inertia * angle * (order * speed) ** 2 * follows * np.exp(1j * order * motion[0])
    assert added == pytest.approx(wave.real[time > 4.0], abs=2e-3 * np.abs(wave[0]))


def test_a_wobbling_gear_bears_weight_and_friction_by_the_ratio_of_the_moment() -> None:
    numbers = {"cos_rad": 0.0, "sin_rad": 0.02, "order_per_motor_rev": 2.0}
    numbers |= {"arm_inertia_kg_m2": 0.0, "arm_coulomb_nm": 0.15}
    added = predicted(Effect("kinematic-error", numbers)) - predicted()
    assert added == pytest.approx(0.04 * np.cos(2.0 * POSITION) * (GRAVITY + 0.15 * SIGN))


@pytest.mark.parametrize(
    "pull",
    [
        Effect("cable-force", {"stiffness_nm_per_arm_rad": 0.7, "neutral_arm_rad": 0.1}),
        Effect("local-fault", {"height_nm": 0.5, "center_arm_rad": 0.1, "width_arm_rad": 0.2}),
    ],
)
def test_what_pulls_at_the_arm_is_a_load_that_the_gear_bears(pull: Effect) -> None:
    """An extended twin had left 5.0 times the noise: beside a cable its load was gravity alone."""
    rubbing = Effect("load-dependent-friction", {"load_coefficient": 0.2})
    pulled = predicted(pull) - predicted()
    added = predicted(pull, rubbing) - predicted(pull)
    assert added == pytest.approx(0.2 * np.abs(GRAVITY + pulled) * SIGN)
    assert predicted(rubbing, pull) == pytest.approx(predicted(pull, rubbing))


def test_measurement_effects_act_on_the_sum() -> None:
    offset = Effect("torque-offset", {"torque_offset_nm": 1.0})
    constant = Effect("torque-constant-error", {"factor": 0.8})
    # The sensor's zero is added to what is reported, whatever the magnets give.
    assert predicted(offset, constant) == pytest.approx(predicted() / 0.8 + 1.0)
    limited = predicted(Effect("torque-saturation", {"limit_nm": 1.5}), constant)
    assert limited == pytest.approx(np.clip(predicted(constant), -1.5, 1.5))
    cooling = Effect("torque-constant-error", {"factor_per_k": -0.001, "reference_degc": 20.0})
    assert predicted(cooling) == pytest.approx(predicted() / (1.0 - 0.001 * (TEMPERATURE - 20.0)))
    resolver = Effect(
        "resolver-error", {"cos_rad": 1e-3, "sin_rad": 0.0, "order_per_motor_rev": 1.0}
    )
    # Inertia alone, at constant speed: the measured wobble is no torque of the joint.
    difference = predicted(resolver) - predicted()
    assert 0.0 < np.max(np.abs(difference)) < 2.0


@pytest.mark.parametrize(
    ("effect", "parameters", "named"),
    [
        ("rust", {}, "no torque law predicts rust"),
        ("friction-drift", {}, "reference_started_at"),
        ("friction-drift", {"reference_started_at": "2026-01-01T00:00:00"}, "with its zone"),
        ("friction-drift", {"reference_started_at": 7.0}, "with its zone"),
        (
            "friction-drift",
            {"coulomb_nm_per_run": -0.2, "reference_run": 0.0},
            "friction below zero",
        ),
        (
            "friction-drift",
            {"settling_h": 5.0, "reference_started_at": "2026-01-01T00:00:00Z"},
            "starts after reference_started_at",
        ),
        ("friction-drift", {**ODOMETER, "operating_h": [0.0]}, "a reading for each of 2 instants"),
        ("friction-drift", {**ODOMETER, "operating_h": [1.0, 0.5]}, "do not fall"),
        ("friction-drift", {**ODOMETER, "operating_h": 1.0}, "expected a list"),
        ("friction-drift", {**ODOMETER, "operating_h": [0.0, "x"]}, r"operating_h\[1\]"),
        ("local-fault", {"height_nm": 1.0, "center_arm_rad": 0.0, "width_arm_rad": 0.0}, "above 0"),
        ("cable-force", {"stiffness_nm_per_arm_rad": -1.0}, "at least 0"),
        ("torque-offset", {}, "torque_offset_nm"),
        ("torque-offset", {"torque_offset_nm": "much"}, "torque_offset_nm"),
        ("torque-offset", {"torque_offset_nm": 1.0, "colour": 2.0}, "colour"),
        ("torque-saturation", {"limit_nm": 0.0}, "limit_nm"),
        ("presliding-hysteresis", {"stiffness_nm_per_rad": -1.0}, "stiffness_nm_per_rad"),
    ],
)
def test_what_cannot_be_predicted_is_refused_by_name(
    effect: str, parameters: dict[str, Any], named: str
) -> None:
    with pytest.raises(TwinError, match=named):
        predicted(Effect(effect, parameters))


def test_a_missing_column_is_named() -> None:
    numbers = {"coulomb_nm_per_k": -0.004, "reference_degc": 30.0}
    law = twin(Effect("temperature-dependent-friction", numbers))
    with pytest.raises(TwinError, match="gearbox_temperature_degc"):
        law.predict_torque(POSITION, VELOCITY, ACCELERATION)
