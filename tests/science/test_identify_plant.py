"""The estimators on the fake joint: two masses, a drive loop and an encoder, written by others."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from agent.identify.estimate import estimate
from agent.identify.signals.arrays import Signals
from fakes.friction import FrictionParameters
from fakes.joint import JointParameters
from fakes.plant import Plant
from trajectories.stair import stair_between

RATE_HZ = 500.0
HALF_STROKE_RAD = math.radians(50.0)
JOINT = JointParameters(initial_arm_position_rad=-HALF_STROKE_RAD)


def drive(joint: JointParameters) -> tuple[Signals, Plant]:
    """Drive the thesis's stair (-50 to 50 degrees in 40 s) and record it as a drive would."""
    end = HALF_STROKE_RAD * joint.gear_ratio
    stair = stair_between(
        -end,
        end,
        duration_s=40.0,
        acceleration_rad_s2=200.0,
        jerk_rad_s3=2000.0,
        speeds_rad_s=[1.0, 2.0, 3.5, 6.0, 9.0, 14.0, 20.0, 30.0, 45.0, 70.0],
        scale_speeds=True,
    )
    plant = Plant(joint)
    plant.power_on()
    plant.rise_rad_s2 = plant.fall_rad_s2 = 1e6
    # The set-point moves at the drive's own pace: in steps of the sampling period it would make
    # a sawtooth of the torque, of which every sample catches the same tooth's end.
    steps = round(1.0 / (RATE_HZ * plant.servo.step_s))
    samples = int(stair.duration_s * RATE_HZ)
    commands = stair.sample(np.arange(samples * steps) * plant.servo.step_s).velocity_rad_s
    time_s = (np.arange(samples) + 1) / RATE_HZ
    rows = []
    for part in commands.reshape(samples, steps).tolist():
        for command in part:
            plant.target_rad_s = command
            plant.advance(1)
        turns = plant.counts / plant.servo.encoder_counts_per_rev
        rows.append((2.0 * math.pi * turns, plant.velocity_measured_rad_s, plant.torque_nm))
    position, velocity, torque = np.array(rows).T
    torque = torque + 0.02 * np.random.default_rng(1).standard_normal(torque.size)
    signals = Signals.from_columns(
        {
            "time_s": time_s,
            "position_rad": position,
            "velocity_rad_s": np.round(velocity, 2),
            "torque_nm": np.round(torque / 0.002) * 0.002,
        },
        joint.gear_ratio,
    )
    return signals, plant


@pytest.mark.parametrize("gravity_nm", [0.0, 1.0])
def test_the_friction_curve_is_the_plants_own(gravity_nm: float) -> None:
    signals, plant = drive(replace(JOINT, gravity_sin_nm=gravity_nm))
    result = estimate([signals])
    curve, body, law = result.friction_curve, result.rigid_body, result.selected_model
    assert curve is not None
    assert body is not None
    assert law is not None
    truth = np.array([plant.friction.torque_nm(v) for v in curve.velocity_rad_s])
    assert curve.velocity_rad_s.size == 10
    np.testing.assert_allclose(curve.friction_nm, truth, atol=0.004)
    assert np.mean((curve.ci95_nm[:, 0] <= truth) & (truth <= curve.ci95_nm[:, 1])) >= 0.9
    assert law.model == "stribeck"
    for name in ("coulomb_nm", "viscous_nm_s_per_rad", "static_extra_nm"):
        assert law.parameters[name].value == pytest.approx(getattr(plant.friction, name), rel=0.05)
    gravity = body.parameters["gravity_sin_nm"]
    assert gravity.ci95 is not None
    assert gravity.ci95[0] <= gravity_nm <= gravity.ci95[1]


def test_without_stribeck_the_twin_is_the_plants_own() -> None:
    joint = replace(JOINT, friction=FrictionParameters(static_extra_nm=0.0))
    signals, plant = drive(joint)
    result = estimate([signals])
    assert result.selected_model is not None
    assert result.selected_model.model == "coulomb-viscous"
    assert result.rigid_body is not None
    found = result.rigid_body.parameters
    assert found["coulomb_nm"].value == pytest.approx(plant.friction.coulomb_nm, rel=0.01)
    viscous = plant.friction.viscous_nm_s_per_rad
    assert found["viscous_nm_s_per_rad"].value == pytest.approx(viscous, rel=0.02)
    assert found["inertia_kg_m2"].value == pytest.approx(joint.inertia_kg_m2, rel=0.005)


@pytest.mark.parametrize(("gravity_nm", "static_extra_nm"), [(0.0, 0.15), (1.0, 0.0)])
@pytest.mark.parametrize("resonance_hz", [5.0, 8.0, 12.0, 20.0])
def test_intervals_cover_the_truth_below_any_resonance(
    resonance_hz: float, gravity_nm: float, static_extra_nm: float
) -> None:
    joint = replace(
        JOINT,
        spring_nm_per_rad=JOINT.arm_inertia_kg_m2 * (2.0 * math.pi * resonance_hz) ** 2,
        gravity_sin_nm=gravity_nm,
        gravity_cos_nm=0.3 * gravity_nm,
        friction=FrictionParameters(static_extra_nm=static_extra_nm),
    )
    body = estimate([drive(joint)[0]]).rigid_body
    assert body is not None
    inertia = body.parameters["inertia_kg_m2"]
    assert inertia.value == pytest.approx(joint.inertia_kg_m2, rel=0.035)
    for name in ("inertia_kg_m2", "gravity_sin_nm", "gravity_cos_nm", "torque_offset_nm"):
        found = body.parameters[name]
        truth = 0.0 if name == "torque_offset_nm" else getattr(joint, name)
        assert found.ci95 is not None
        assert found.ci95[0] <= truth <= found.ci95[1], (name, found, truth)


def test_a_cutoff_near_the_resonance_shows_why_it_is_halved() -> None:
    signals, _ = drive(replace(JOINT, friction=FrictionParameters(static_extra_nm=0.0)))
    held = []
    for cutoff_hz in (2.0, 6.0):
        body = estimate([signals], cutoff_hz=cutoff_hz).rigid_body
        assert body is not None
        low, high = body.parameters["inertia_kg_m2"].ci95 or (math.nan, math.nan)
        held.append(low <= JOINT.inertia_kg_m2 <= high)
    assert held == [True, False]
