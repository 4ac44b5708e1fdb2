"""What a joint may have beyond the plain one: each does what its description says."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from fakes.friction import FrictionParameters
from fakes.imperfections import Imperfections
from fakes.joint import JointParameters
from fakes.plant import Plant, ServoParameters

FRICTIONLESS = FrictionParameters(coulomb_nm=0.0, viscous_nm_s_per_rad=0.0, static_extra_nm=0.0)
DRY = FrictionParameters(coulomb_nm=0.5, viscous_nm_s_per_rad=0.0, static_extra_nm=0.0)
STIFF = JointParameters(spring_nm_per_rad=1500.0, damper_nm_s_per_rad=2.0, friction=DRY)
MILLISECOND = 4  # steps
ON_ALL = Imperfections(
    coulomb_asymmetry_nm=0.01,
    load_share=0.1,
    position_share=0.1,
    bump_nm=0.1,
    thinning_velocity_rad_s=50.0,
    presliding_rad=0.1,
    ripple_nm=0.05,
    wobble_rad=0.001,
    backlash_rad=0.02,
    cable_nm_per_arm_rad=0.2,
    torque_offset_nm=0.05,
    torque_constant_ratio=0.95,
    encoder_error_rad=0.01,
)


def imperfect(joint: JointParameters = STIFF, **numbers: float) -> JointParameters:
    return replace(joint, imperfections=Imperfections(**numbers))


def steady(plant: Plant, velocity_rad_s: float, seconds: float = 1.0) -> tuple[np.ndarray, ...]:
    """Return motor angle, velocity and torque that accelerates nothing, each millisecond."""
    if not plant.powered:
        plant.power_on()
    plant.target_rad_s = velocity_rad_s
    plant.advance(800 * MILLISECOND)
    rows = []
    for _ in range(round(1000 * seconds)):
        plant.advance(MILLISECOND)
        rows.append((plant.motor_position_rad, plant.motor_velocity_rad_s, plant.torque_nm))
    angle, velocity, torque = np.asarray(rows).T
    return angle, velocity, torque - plant.joint.inertia_kg_m2 * np.gradient(velocity, 0.001)


def mean_torque(joint: JointParameters, velocity_rad_s: float) -> float:
    return float(np.mean(steady(Plant(joint), velocity_rad_s)[2]))


def test_none_of_them_is_there_by_default() -> None:
    assert not Imperfections().act_in_the_joint
    assert Plant(imperfect(torque_constant_ratio=1.0)).joint == STIFF


@pytest.mark.parametrize(
    "name",
    [
        f.name
        for f in fields(Imperfections)
        if getattr(ON_ALL, f.name) != getattr(Imperfections(), f.name)
    ],
)
def test_each_of_them_changes_the_motion(name: str) -> None:
    """Alone, each leaves a trace in what is measured of one and the same motion."""
    traces = []
    plain = Imperfections()
    for imperfections in (plain, replace(plain, **{name: getattr(ON_ALL, name)})):
        joint = replace(STIFF, imperfections=imperfections, friction=FrictionParameters())
        plant = Plant(replace(joint, gravity_sin_nm=0.2, initial_arm_position_rad=0.1))
        traces.append([*steady(plant, 40.0, 0.3)[2], *steady(plant, -40.0, 0.3)[2]])
    assert not np.allclose(traces[0], traces[1], atol=1e-4)


def test_the_general_path_is_the_plain_one_where_nothing_is_added() -> None:
    """A number too small to matter takes the other path through the integrator."""
    other = imperfect(torque_offset_nm=1e-15)
    assert other.imperfections.act_in_the_joint
    torque = [steady(Plant(joint), 30.0, 0.2)[2] for joint in (STIFF, other)]
    assert np.allclose(torque[0], torque[1], atol=1e-9)


def test_friction_differs_between_the_directions_and_the_offset_looks_alike() -> None:
    for name in ("coulomb_asymmetry_nm", "torque_offset_nm"):
        joint = replace(STIFF, imperfections=replace(Imperfections(), **{name: 0.08}))
        assert mean_torque(joint, 20.0) == pytest.approx(0.58, abs=2e-3)
        assert mean_torque(joint, -20.0) == pytest.approx(-0.42, abs=2e-3)


def test_friction_grows_with_the_torque_that_the_gear_transmits() -> None:
    held = replace(STIFF, gravity_cos_nm=1.0, gear_ratio=1e4)  # hardly any arm motion
    joint = imperfect(held, load_share=0.3)
    assert mean_torque(joint, 20.0) == pytest.approx(1.0 + 0.5 + 0.3, abs=3e-3)
    assert mean_torque(joint, -20.0) == pytest.approx(1.0 - 0.5 - 0.3, abs=3e-3)


def test_a_drive_with_weak_magnets_reports_more_than_there_is() -> None:
    assert mean_torque(imperfect(torque_constant_ratio=0.8), 20.0) == pytest.approx(0.5 / 0.8, 1e-3)


def test_shear_thins_the_oil() -> None:
    viscous = replace(STIFF, friction=replace(DRY, coulomb_nm=0.0, viscous_nm_s_per_rad=0.01))
    joint = imperfect(viscous, thinning_velocity_rad_s=50.0)
    for speed in (10.0, 50.0, 100.0):
        expected = 0.01 * speed / (1.0 + speed / 50.0)
        assert mean_torque(joint, speed) == pytest.approx(expected, abs=2e-3)


def amplitude_at(angle: np.ndarray, torque: np.ndarray, order: float) -> float:
    waves = np.column_stack([np.sin(order * angle), np.cos(order * angle), np.ones(len(angle))])
    sine, cosine, _ = np.linalg.lstsq(waves, torque, rcond=None)[0]
    return math.hypot(sine, cosine)


def test_ripple_is_periodic_in_the_motor_angle() -> None:
    joint = imperfect(ripple_nm=0.05, ripple_order_per_motor_rev=6.0)
    angle, _, torque = steady(Plant(joint), 3.0, 3.0)
    turn = angle < angle[0] + 2.0 * math.pi
    assert amplitude_at(angle[turn], torque[turn], 6.0) == pytest.approx(0.05, rel=0.05)
    assert amplitude_at(angle[turn], torque[turn], 5.0) < 0.005


def test_a_tight_spot_and_a_wave_of_friction_follow_the_arm() -> None:
    joint = imperfect(
        replace(STIFF, gear_ratio=10.0), position_share=0.2, position_order_per_arm_rev=4.0
    )
    angle, _, torque = steady(Plant(joint), 20.0, 3.0)
    assert amplitude_at(angle, torque, 0.4) == pytest.approx(0.1, rel=0.05)
    joint = imperfect(
        replace(STIFF, gear_ratio=10.0), bump_nm=0.2, bump_arm_rad=4.0, bump_width_arm_rad=0.2
    )
    angle, _, torque = steady(Plant(joint), 20.0, 3.0)
    highest = float(np.argmax(torque))
    assert angle[int(highest)] / 10.0 == pytest.approx(4.0, abs=0.1)
    assert np.max(torque) == pytest.approx(0.7, abs=0.02)


def test_presliding_is_a_spring_that_encloses_a_loop() -> None:
    """Half the torque moves the joint without breaking it away, and not all of it comes back."""
    plant = Plant(imperfect(presliding_rad=0.2))
    plant.power_on()
    positions = []
    for torque_nm in (0.3, 0.0, 0.3):
        plant.torque_reference_nm = torque_nm
        for _ in range(60):  # the bristles have no damping of their own: let go in small steps
            plant.advance(50 * MILLISECOND)
            plant.motor_velocity_rad_s = plant.arm_velocity_rad_s = 0.0
        positions.append(plant.motor_position_rad)
    there, back, again = positions
    assert 0.02 < there < 0.2
    assert 0.1 * there < back < 0.7 * there
    assert again == pytest.approx(there, abs=0.15 * there)
    sliding = Plant(imperfect(presliding_rad=0.2))
    assert np.mean(steady(sliding, 20.0)[2]) == pytest.approx(0.5, abs=2e-3)


def test_within_the_clearance_the_arm_is_alone() -> None:
    plant = Plant(imperfect(replace(STIFF, friction=FRICTIONLESS), backlash_rad=0.1))
    middle = plant.arm_position_rad
    plant.motor_position_rad = middle
    plant.motor_velocity_rad_s = 0.1
    plant.advance(400 * MILLISECOND)
    assert plant.arm_velocity_rad_s == 0.0
    plant.advance(400 * MILLISECOND)
    assert plant.arm_velocity_rad_s > 0.01


def test_an_undamped_gear_with_wobble_and_clearance_keeps_its_energy() -> None:
    joint = imperfect(
        JointParameters(friction=FRICTIONLESS, damper_nm_s_per_rad=0.0),
        wobble_rad=0.02,
        wobble_order_per_motor_rev=10.0,
        backlash_rad=0.02,
    )
    plant = Plant(joint)
    plant.motor_position_rad += 0.3

    def energy() -> float:
        position = plant.motor_position_rad
        twist = position + 0.02 * math.sin(10.0 * position) - plant.arm_position_rad
        twist = max(abs(twist) - 0.01, 0.0)
        return 0.5 * (
            joint.spring_nm_per_rad * twist**2
            + joint.motor_inertia_kg_m2 * plant.motor_velocity_rad_s**2
            + joint.arm_inertia_kg_m2 * plant.arm_velocity_rad_s**2
        )

    start, levels = energy(), []
    for _ in range(40_000):
        plant.advance(1)
        levels.append(energy())
    assert np.mean(levels[-4000:]) == pytest.approx(start, rel=0.03)


def test_a_cable_pulls_the_arm_back_to_where_it_hangs_slack() -> None:
    joint = imperfect(
        replace(STIFF, gear_ratio=20.0), cable_nm_per_arm_rad=0.3, cable_rest_arm_rad=0.5
    )
    angle, _, torque = steady(Plant(joint), 10.0, 2.0)
    slope, level = np.polyfit(angle / 20.0, torque, 1)
    assert slope == pytest.approx(0.3, rel=0.02)
    assert level == pytest.approx(0.5 - 0.3 * 0.5, abs=0.01)


def test_the_encoder_s_error_is_in_what_it_reads_alone() -> None:
    joint = imperfect(encoder_error_rad=0.01, encoder_order_per_motor_rev=2.0)
    plant = Plant(joint, ServoParameters(encoder_counts_per_rev=1 << 22))
    plant.power_on()
    plant.target_rad_s = 5.0
    errors, angles = [], []
    for _ in range(3000):
        plant.advance(1)
        angles.append(plant.motor_position_rad)
        errors.append(plant.counts * 2.0 * math.pi / (1 << 22))
    read, true = np.asarray(errors[1:]), np.asarray(angles[:-1])  # read before the step
    assert np.allclose(read - true, 0.01 * np.sin(2.0 * true), atol=1e-5)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"load_share": -0.1}, "load_share"),
        ({"position_share": 1.5}, "position_share: expected -1 to 1"),
        ({"wobble_rad": 0.3}, "wobble_rad: expected less than"),
        ({"encoder_error_rad": 0.6}, "encoder_error_rad"),
        ({"torque_constant_ratio": 0.0}, "torque_constant_ratio"),
        ({"ripple_nm": math.nan}, "ripple_nm"),
    ],
)
def test_what_no_joint_can_have_is_refused(numbers: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Imperfections(**numbers)


def test_bristles_too_stiff_for_the_step_are_refused() -> None:
    with pytest.raises(ValueError, match="presliding_rad"):
        Plant(imperfect(presliding_rad=1e-4))
