"""What each effect adds to a twin's torque, by hand; and what is refused by name."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from agent.physics.effects import ADDED, AROUND
from agent.physics.twin import Effect, Twin, TwinError

N = 400
TIME = np.linspace(0.0, 2.0, N)
POSITION = 40.0 * np.sin(3.0 * TIME)
VELOCITY = 120.0 * np.cos(3.0 * TIME)
ACCELERATION = -360.0 * np.sin(3.0 * TIME)
TEMPERATURE = np.linspace(20.0, 60.0, N)
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
    )


GRAVITY = 0.2 * np.sin(ARM) - 0.1 * np.cos(ARM)
BY_HAND: dict[str, tuple[dict[str, float], Any]] = {
    "stribeck": (
        {"static_extra_nm": 0.3, "stribeck_velocity_rad_s": 7.0, "exponent": 1.3},
        0.3 * SIGN * np.exp(-((np.abs(VELOCITY) / 7.0) ** 1.3)),
    ),
    "viscous-nonlinear": (
        {"power_nm": -0.2, "reference_velocity_rad_s": 50.0, "exponent": 2.0},
        -0.2 * SIGN * (VELOCITY / 50.0) ** 2,
    ),
    "direction-asymmetry": (
        {"coulomb_difference_nm": 0.1, "viscous_difference_nm_s_per_rad": 0.002},
        0.05 + 0.001 * np.abs(VELOCITY),
    ),
    "load-dependent-friction": ({"load_coefficient": 0.1}, 0.1 * np.abs(GRAVITY) * SIGN),
    "temperature-dependent-friction": (
        {"viscous_thermal_nm_s_per_rad": 0.01, "reference_degc": 30.0, "decay_k": 20.0},
        0.01 * (np.exp(-(TEMPERATURE - 30.0) / 20.0) - 1.0) * VELOCITY,
    ),
    "position-dependent-friction": (
        {"cos_nm": 0.1, "sin_nm": 0.0, "order_per_arm_rev": 3.0},
        0.1 * np.cos(3.0 * ARM) * SIGN,
    ),
    "torque-ripple": (
        {"cos_nm": 0.0, "sin_nm": 0.1, "order_per_motor_rev": 14.0},
        0.1 * np.sin(14.0 * POSITION),
    ),
    "torque-offset": ({"torque_offset_nm": -0.04}, np.full(N, -0.04)),
    "inertia-error": ({"inertia_extra_kg_m2": 0.004}, 0.004 * ACCELERATION),
    "wrong-number": ({"coulomb_extra_nm": 0.1}, 0.1 * SIGN),
    "gravity-imbalance": (
        {"gravity_sin_nm": 0.3, "gravity_cos_nm": 0.1},
        0.3 * np.sin(ARM) + 0.1 * np.cos(ARM),
    ),
    "cable-force": ({"stiffness_nm_per_arm_rad": 0.5, "neutral_arm_rad": 0.1}, 0.5 * (ARM - 0.1)),
    "local-fault": (
        {"height_nm": 0.2, "center_arm_rad": 0.1, "width_arm_rad": 0.02},
        0.2 * np.exp(-0.5 * ((ARM - 0.1) / 0.02) ** 2),
    ),
}


@pytest.mark.parametrize("effect", BY_HAND)
def test_an_effect_adds_its_law_and_nothing_else(effect: str) -> None:
    parameters, added = BY_HAND[effect]
    assert predicted(Effect(effect, parameters)) - predicted() == pytest.approx(added, abs=1e-12)


def test_no_law_in_the_table_is_left_without_a_test() -> None:
    elsewhere = {"presliding-hysteresis", "kinematic-error", "joint-flexibility", "backlash"}
    assert set(ADDED) == set(BY_HAND) | elsewhere


def test_a_stiff_presliding_spring_is_coulomb_friction() -> None:
    stiff = predicted(Effect("presliding-hysteresis", {"stiffness_nm_per_rad": 1e5}))
    assert stiff[10:] == pytest.approx(predicted()[10:], abs=1e-6)
    soft = predicted(Effect("presliding-hysteresis", {"stiffness_nm_per_rad": 0.1}))
    assert np.max(np.abs(soft - predicted())[10:]) > 0.5


def test_an_arm_behind_a_spring_answers_as_the_oscillator_that_it_is() -> None:
    arm = {"arm_inertia_kg_m2": 0.016, "stiffness_nm_per_rad": 8.0, "damping_nm_s_per_rad": 0.1}
    law = Twin("r", 1, 100.0, 0.018, 0.0, 0.0, effects=(Effect("joint-flexibility", arm),))
    time = np.arange(0.0, 6.0, 1e-3)
    w = 9.0
    position, velocity, acceleration = np.sin(w * time), w * np.cos(w * time), 0.0 * time
    acceleration -= w * w * position
    torque = law.predict_torque(position, velocity, acceleration, time_s=time)
    shaft = (8.0 + 0.1j * w) * 0.016 / (8.0 + 0.1j * w - 0.016 * w * w)
    settled = np.imag(-w * w * (0.002 + shaft) * np.exp(1j * w * time))
    assert torque[4000:] == pytest.approx(settled[4000:], abs=0.02 * np.max(settled))
    gap = Effect("backlash", {**arm, "half_gap_rad": 0.05})
    lost = Twin("r", 1, 100.0, 0.018, 0.0, 0.0, effects=(gap,))
    parted = lost.predict_torque(position, velocity, acceleration, time_s=time)
    # Where the teeth have parted the motor moves itself alone.
    alone = np.isclose(parted, 0.002 * acceleration, atol=1e-12)
    assert 0.02 < np.mean(alone) < 0.9


def test_kinematic_error_grows_with_the_square_of_speed() -> None:
    numbers = {"cos_rad": 1e-3, "sin_rad": 0.0, "order_per_motor_rev": 2.0}
    wobble = twin(Effect("kinematic-error", {**numbers, "arm_inertia_kg_m2": 0.01}))
    still = np.zeros(N)
    amplitude = [
        float(
            np.ptp(
                wobble.predict_torque(POSITION, np.full(N, speed), still)
                - twin().predict_torque(POSITION, np.full(N, speed), still)
            )
        )
        for speed in (20.0, 60.0)
    ]
    assert amplitude[1] == pytest.approx(9.0 * amplitude[0])


def test_measurement_effects_act_on_the_sum() -> None:
    offset = Effect("torque-offset", {"torque_offset_nm": 1.0})
    constant = Effect("torque-constant-error", {"factor": 0.8})
    assert predicted(constant, offset) == pytest.approx(predicted(offset) / 0.8)
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
    assert set(AROUND) == {"resolver-error", "torque-constant-error", "torque-saturation"}


@pytest.mark.parametrize(
    ("effect", "parameters", "named"),
    [
        ("friction-drift", {}, "friction-drift"),
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


def test_one_arm_is_carried_by_one_effect() -> None:
    both = (Effect("joint-flexibility", {}), Effect("backlash", {}))
    with pytest.raises(TwinError, match="carry the same arm"):
        predicted(*both)


def test_a_missing_column_is_named() -> None:
    numbers, _ = BY_HAND["temperature-dependent-friction"]
    law = twin(Effect("temperature-dependent-friction", numbers))
    with pytest.raises(TwinError, match="gearbox_temperature_degc"):
        law.predict_torque(POSITION, VELOCITY, ACCELERATION)
