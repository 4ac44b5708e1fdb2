"""A wobbling gear that turns slowly under gravity: the weight that it bears tells its order."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.physics.twin import Twin
from tests.science.explain_plant import RATE_HZ, waves

GEAR, MOTOR, ARM, WEIGHT, COULOMB, VISCOUS = 9.0, 2e-4, 5.6e-4, 0.55, 0.11, 0.002
WOBBLE_RAD = 0.02
TWIN = Twin("hip", 1, GEAR, MOTOR + ARM, COULOMB, VISCOUS, WEIGHT, 0.0)


def recorded(seed: int) -> Run:
    """Return what a stiff joint's motor bears whose gear wobbles once a turn of it."""
    command = waves(seed, 20.0, fastest_hz=1.0, top=14.0)[:: round(20_000 / RATE_HZ)]
    time = np.arange(command.shape[0]) / RATE_HZ
    angle, velocity = command.T
    acceleration = np.gradient(velocity, time)
    slope, bend = WOBBLE_RAD * np.cos(angle), -WOBBLE_RAD * np.sin(angle)
    arm = angle + WOBBLE_RAD * np.sin(angle)
    shaft = ARM * ((1.0 + slope) * acceleration + bend * velocity**2)
    shaft += WEIGHT * np.sin(arm / GEAR)
    torque = MOTOR * acceleration + COULOMB * np.sign(velocity) + VISCOUS * velocity
    torque += (1.0 + slope) * shaft
    columns = {
        "time_s": time,
        "position_rad": angle,
        "velocity_rad_s": velocity,
        "torque_nm": torque + 0.003 * np.random.default_rng(seed).standard_normal(time.shape),
    }
    return Run.from_columns(columns, GEAR, name=f"run-{seed}", started_s=100.0 * seed)


def test_a_wobble_that_the_weight_shows_is_no_row_of_bumps() -> None:
    """Two or three other laws, or bumps a turn of the motor apart, each for certain."""
    runs = [recorded(seed) for seed in range(4)]
    answer = explain(TWIN, runs[:3], runs[3:])
    assert [finding.effect for finding in answer.findings] == ["kinematic-error"]
    found = answer.findings[0].parameters
    assert found["order_per_motor_rev"].value == pytest.approx(1.0, abs=0.01)
    assert np.hypot(found["cos_rad"].value, found["sin_rad"].value) == pytest.approx(
        WOBBLE_RAD, rel=0.15
    )
