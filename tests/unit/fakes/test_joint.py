"""The plant: sticking, steady motion, resonance, gravity, energy."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fakes.friction import FrictionParameters
from fakes.joint import JointParameters
from fakes.plant import Plant, ServoParameters
from fakes.thermal import ThermalParameters

FRICTIONLESS = FrictionParameters(coulomb_nm=0.0, viscous_nm_s_per_rad=0.0, static_extra_nm=0.0)
MILLISECOND = 4  # steps


def with_torque(torque_nm: float, joint: JointParameters | None = None) -> Plant:
    """Return a plant whose drive gives a constant torque, velocity loop open."""
    plant = Plant(joint)
    plant.power_on()
    plant.torque_reference_nm = torque_nm
    return plant


def test_the_default_is_the_robot_of_the_thesis() -> None:
    joint = JointParameters()
    assert joint.inertia_kg_m2 == pytest.approx(0.0184)
    assert joint.gear_ratio == 224.0
    assert 8.0 <= joint.locked_frequency_hz < joint.resonance_frequency_hz <= 15.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_below_breakaway_nothing_moves_and_above_it_does(sign: float) -> None:
    breakaway = FrictionParameters().truth(25.0).breakaway_nm
    below = with_torque(sign * 0.999 * breakaway)
    below.advance(2000 * MILLISECOND)
    assert below.motor_velocity_rad_s == 0.0
    assert below.motor_position_rad == 0.0
    above = with_torque(sign * 1.001 * breakaway)
    above.advance(2000 * MILLISECOND)
    excess_speed = 0.001 * breakaway * 2.0 / above.joint.inertia_kg_m2
    assert sign * above.motor_velocity_rad_s == pytest.approx(excess_speed, rel=0.3)


def test_it_stops_for_good_and_does_not_chatter() -> None:
    plant = with_torque(3.0)
    plant.advance(500 * MILLISECOND)
    plant.power_off()
    velocities = []
    for _ in range(16000):
        plant.advance(1)
        velocities.append(plant.motor_velocity_rad_s)
    assert velocities[0] > 10.0
    stopped = velocities.index(0.0)
    reversals = np.count_nonzero(np.diff(np.sign(velocities[stopped:])) < -1)
    assert reversals == 0
    assert velocities[-4000:] == [0.0] * 4000


@pytest.mark.parametrize("velocity", [0.5, 2.0, 6.0, 20.0, 100.0, -100.0])
def test_in_steady_motion_torque_is_friction(velocity: float) -> None:
    plant = Plant()
    plant.power_on()
    plant.target_rad_s = velocity
    plant.advance(2500 * MILLISECOND)
    torque = []
    for _ in range(1000):
        plant.advance(MILLISECOND)
        torque.append(plant.torque_nm)
    assert plant.motor_velocity_rad_s == pytest.approx(velocity, abs=0.02)
    assert np.mean(torque) == pytest.approx(plant.friction.torque_nm(velocity), abs=1e-3)


def ringing(plant: Plant, seconds: float) -> tuple[float, float]:
    """Return frequency and logarithmic decrement of motor against arm."""
    dt = plant.servo.step_s
    twist = []
    for _ in range(round(seconds / dt)):
        plant.advance(1)
        twist.append(plant.motor_position_rad - plant.arm_position_rad)
    x = np.asarray(twist)
    rising = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    instants = rising + x[rising] / (x[rising] - x[rising + 1])
    peaks = [np.max(x[a:b]) for a, b in pairwise(rising)]
    decrement = math.log(peaks[0] / peaks[-1]) / (len(peaks) - 1)
    return float(1.0 / (np.mean(np.diff(instants)) * dt)), decrement


def test_a_free_motor_rings_at_the_two_mass_resonance() -> None:
    joint = JointParameters(friction=FRICTIONLESS)
    plant = Plant(joint)
    plant.motor_position_rad = 0.05
    frequency, decrement = ringing(plant, 1.0)
    natural = 2.0 * math.pi * joint.resonance_frequency_hz
    reduced = joint.motor_inertia_kg_m2 * joint.arm_inertia_kg_m2 / joint.inertia_kg_m2
    damping = joint.damper_nm_s_per_rad / (2.0 * reduced * natural)
    expected = joint.resonance_frequency_hz * math.sqrt(1.0 - damping**2)
    assert frequency == pytest.approx(expected, rel=2e-3)
    assert decrement == pytest.approx(
        2.0 * math.pi * damping / math.sqrt(1.0 - damping**2), rel=0.02
    )


def test_a_stuck_motor_rings_at_the_locked_frequency() -> None:
    joint = JointParameters(damper_nm_s_per_rad=0.0)
    plant = Plant(joint)
    plant.arm_position_rad = 0.02  # 0.5 N m in the spring: below breakaway
    frequency, decrement = ringing(plant, 1.0)
    assert plant.motor_velocity_rad_s == 0.0
    assert frequency == pytest.approx(joint.locked_frequency_hz, rel=2e-3)
    assert decrement == pytest.approx(0.0, abs=1e-3)


def test_the_undamped_spring_neither_gains_nor_loses_energy() -> None:
    joint = JointParameters(friction=FRICTIONLESS, damper_nm_s_per_rad=0.0)
    plant = Plant(joint)
    plant.motor_position_rad = 0.1

    def energy() -> float:
        twist = plant.motor_position_rad - plant.arm_position_rad
        return 0.5 * (
            joint.spring_nm_per_rad * twist**2
            + joint.motor_inertia_kg_m2 * plant.motor_velocity_rad_s**2
            + joint.arm_inertia_kg_m2 * plant.arm_velocity_rad_s**2
        )

    start = energy()
    levels = []
    for _ in range(40_000):
        plant.advance(1)
        levels.append(energy())
    assert np.mean(levels[-4000:]) == pytest.approx(start, rel=0.01)
    assert max(levels) < 1.05 * start


def test_gravity_hangs_at_rest_and_costs_torque_in_motion() -> None:
    joint = JointParameters(
        gravity_sin_nm=0.5, gravity_cos_nm=-0.3, initial_arm_position_rad=0.7, gear_ratio=50.0
    )
    plant = Plant(joint)
    start = plant.motor_position_rad
    plant.advance(1000 * MILLISECOND)
    assert plant.motor_position_rad == start  # less than breakaway: friction holds it
    plant.power_on()
    plant.target_rad_s = 20.0
    plant.advance(500 * MILLISECOND)
    torque, expected = [], []
    for _ in range(500):
        plant.advance(MILLISECOND)
        torque.append(plant.torque_nm)
        arm = plant.arm_position_rad / joint.gear_ratio
        expected.append(joint.gravity_nm(arm) + plant.friction.torque_nm(20.0))
    np.testing.assert_allclose(np.mean(torque), np.mean(expected), atol=0.01)


def test_gravity_beyond_breakaway_drops_the_arm_and_a_brake_holds_it() -> None:
    joint = JointParameters(gravity_cos_nm=2.0)
    falling, held = Plant(joint), Plant(replace(joint, brake_nm=8.0))
    for plant in (falling, held):
        plant.advance(500 * MILLISECOND)
    assert falling.motor_velocity_rad_s < -5.0
    assert held.motor_velocity_rad_s == 0.0


def test_all_work_of_friction_becomes_heat() -> None:
    thermal = ThermalParameters(heat_capacity_j_per_k=500.0, cooling_rate_per_s=1e-9)
    plant = Plant(thermal=thermal)
    plant.power_on()
    plant.target_rad_s = 50.0
    plant.advance(1000 * MILLISECOND)
    before, work = plant.gearbox.temperature_degc, 0.0
    for _ in range(5000):
        plant.advance(MILLISECOND)
        work += plant.torque_nm * plant.motor_velocity_rad_s * 0.001
    assert (plant.gearbox.temperature_degc - before) * 500.0 == pytest.approx(work, rel=0.01)
    assert plant.friction.viscous_nm_s_per_rad < 0.0107


def test_the_partition_of_time_changes_nothing() -> None:
    one, many = with_torque(2.0), with_torque(2.0)
    one.advance(399)
    for _ in range(399):
        many.advance(1)
    assert one.motor_position_rad == many.motor_position_rad
    assert one.arm_velocity_rad_s == many.arm_velocity_rad_s


def test_torque_stays_within_its_limit_without_winding_up() -> None:
    plant = Plant()
    plant.power_on()
    plant.torque_limit_nm = 1.0
    plant.rise_rad_s2 = 1e6
    plant.target_rad_s = 300.0
    for _ in range(2000):
        plant.advance(MILLISECOND)
        assert abs(plant.torque_nm) <= 1.0
    plant.target_rad_s, plant.fall_rad_s2 = 0.0, 1e6
    plant.advance(5 * MILLISECOND)
    assert plant.torque_nm < 0.0  # brakes at once: nothing to unwind first


def test_a_step_too_long_for_the_resonance_is_refused() -> None:
    with pytest.raises(ValueError, match="too long for a resonance"):
        Plant(JointParameters(spring_nm_per_rad=1e7))
    with pytest.raises(ValueError, match="too long for a resonance"):
        Plant(servo=ServoParameters(step_s=0.02))
