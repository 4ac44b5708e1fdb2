"""Friction laws beyond Coulomb, viscous and Stribeck: limits, symmetry, dissipation, memory."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.physics.friction import STRIBECK
from agent.physics.friction_dynamic import BlimanSorine, Dahl, LuGre
from agent.physics.friction_extended import ExtendedFriction
from agent.physics.friction_oil import NonlinearViscous, TemperatureViscous
from agent.physics.friction_place import PositionDependent
from agent.physics.friction_static import DirectionDependent, LoadDependent, StaticFriction

SPEEDS = np.linspace(-100.0, 100.0, 201)
LUGRE = LuGre(0.6, 0.01, 0.2, 0.5, 600.0, 1.0)


def test_static_friction_holds_up_to_breakaway_and_slides_at_coulomb() -> None:
    law = StaticFriction(1.0, 0.1, 0.5)
    rest = law.torque_nm(np.zeros(5), np.array([-9.0, -1.2, 0.0, 1.4, 2.0]))
    assert rest == pytest.approx([-1.5, -1.2, 0.0, 1.4, 1.5])
    assert law.torque_nm(np.array([-2.0, 3.0]), np.array([9.0, 9.0])) == pytest.approx([-1.2, 1.3])


def test_direction_dependent_part_is_even_and_gives_the_difference_of_levels() -> None:
    law = DirectionDependent(0.2, 0.01)
    assert law.torque_nm(SPEEDS) == pytest.approx(law.torque_nm(-SPEEDS))
    forward = law.torque_nm(np.array([50.0]))[0]
    # Friction forward is +torque, backward is -torque: the difference is twice the even part.
    assert 2.0 * forward == pytest.approx(0.2 + 0.01 * 50.0)
    assert law.torque_nm(np.zeros(1)) == 0.0


def test_load_friction_grows_with_either_sign_of_load_and_opposes_motion() -> None:
    law = LoadDependent(0.05, 0.1, 9.0, 1.3)
    up, down = law.torque_nm(SPEEDS, np.full(201, 8.0)), law.torque_nm(SPEEDS, np.full(201, -8.0))
    assert up == pytest.approx(down)
    assert np.all(up * SPEEDS >= 0.0)
    assert law.torque_nm(np.array([1e4]), np.array([8.0])) == pytest.approx([0.05 * 8.0])
    assert law.torque_nm(np.array([1e-9]), np.array([8.0])) == pytest.approx([0.15 * 8.0])


@given(st.floats(0.0, 1.0), st.floats(0.0, 0.6), st.floats(-9.0, 9.0), st.sampled_from([-3.0, 3.0]))
def test_friction_that_loads_its_own_gear_is_a_share_of_load_and_friction_together(
    own: float, share: float, load: float, speed: float
) -> None:
    law = LoadDependent(share, driving_excess=own * share)
    friction = law.torque_nm(np.array([speed]), np.array([load]))[0] * np.sign(speed)
    borne = load + own * friction * np.sign(speed)
    # Where it would turn the load about, the gear is locked: no joint is driven through it.
    if load * borne >= 0.0:
        assert friction == pytest.approx(share * abs(borne))


def test_friction_that_no_motor_can_overcome_is_refused() -> None:
    with pytest.raises(ValueError, match="driving_excess"):
        LoadDependent(0.7, 0.4, driving_excess=1.0)


def test_viscosity_falls_by_e_over_its_constant_and_power_one_is_viscous() -> None:
    law = TemperatureViscous(0.002, 0.01, 25.0, 20.0)
    at = law.torque_nm(np.array(10.0), np.array([25.0, 45.0, 2000.0]))
    assert at == pytest.approx([0.12, 0.02 + 0.1 / np.e, 0.02])
    bend = NonlinearViscous(0.5, 40.0, 1.0)
    assert bend.torque_nm(SPEEDS) == pytest.approx(0.5 / 40.0 * SPEEDS)


def test_position_friction_changes_sign_with_direction_and_repeats() -> None:
    law = PositionDependent(0.1, 0.05, 3.0)
    angle = np.linspace(0.0, 2.0, 50)
    forward = law.torque_nm(angle, np.ones(50))
    assert law.torque_nm(angle, -np.ones(50)) == pytest.approx(-forward)
    assert law.torque_nm(angle + 2.0 * np.pi / 3.0, np.ones(50)) == pytest.approx(forward)


def test_extended_law_by_hand_and_clamped_outside_its_range() -> None:
    law = ExtendedFriction()
    torque = law.torque_nm(np.array([1e3]), np.array([40.0]), np.array([13.0]))
    thermal = 1.32e-3 * np.exp(-40.0 / 20.71)
    by_hand = 3.11e-2 + 2.34e-2 * 0.5 + (1.3e-4 + thermal) * 1e3
    assert torque == pytest.approx([26.0 * by_hand])
    cold = law.torque_nm(SPEEDS, np.full(201, 10.0), np.zeros(201))
    assert cold == pytest.approx(law.torque_nm(SPEEDS, np.full(201, 30.0), np.zeros(201)))
    over = law.torque_nm(SPEEDS, np.full(201, 50.0), np.full(201, 99.0))
    assert over == pytest.approx(law.torque_nm(SPEEDS, np.full(201, 50.0), np.full(201, 26.0)))
    outside = law.outside(np.array([10.0, 50.0, 50.0, 90.0]), np.array([0.0, 27.0, 26.0, 0.0]))
    assert outside.tolist() == [True, True, False, True]


@given(st.floats(-20.0, 200.0), st.floats(-100.0, 100.0))
def test_extended_law_opposes_motion_and_is_odd(temperature: float, load: float) -> None:
    law = ExtendedFriction()
    torque = law.torque_nm(SPEEDS, np.array(temperature), np.array(load))
    assert np.all(torque * SPEEDS >= 0.0)
    assert torque == pytest.approx(-torque[::-1])


@pytest.mark.parametrize("velocity", [-30.0, -0.4, 0.05, 0.7, 40.0])
def test_lugre_settles_on_the_stribeck_curve(velocity: float) -> None:
    time = np.arange(0.0, 20.0, 1e-3)
    settled = LUGRE.torque_nm(time, np.full(time.shape, velocity))[-1]
    parameters = {
        "coulomb_nm": 0.6,
        "viscous_nm_s_per_rad": 0.01,
        "static_extra_nm": 0.2,
        "stribeck_velocity_rad_s": 0.5,
        "exponent": 2.0,
    }
    assert settled == pytest.approx(float(STRIBECK.torque(velocity, parameters)), rel=1e-9)


def test_lugre_agrees_with_a_stiff_integration_in_small_steps() -> None:
    time = np.arange(0.0, 1.0, 1e-3)
    velocity = 0.8 * np.sin(7.0 * time) + 0.3 * np.sin(31.0 * time)
    fine = np.arange(0.0, 0.999, 2e-6)
    v = np.interp(fine, time, velocity)
    g = 0.6 + 0.2 * np.exp(-((v / 0.5) ** 2))
    z, bristles = 0.0, np.empty(len(fine))
    for k in range(len(fine)):
        bristles[k] = z
        z += 2e-6 * (v[k] - 600.0 * abs(v[k]) * z / g[k])
    reference = 600.0 * bristles + (v - 600.0 * np.abs(v) * bristles / g) + 0.01 * v
    torque = LUGRE.torque_nm(time, velocity)[:-1]
    assert torque == pytest.approx(reference[::500][: len(torque)], abs=0.01)


@given(
    st.lists(st.floats(-300.0, 300.0), min_size=2, max_size=60),
    st.floats(1e-5, 10.0),
)
def test_no_step_is_too_long_for_the_hidden_state(velocities: list[float], step: float) -> None:
    velocity = np.array(velocities)
    time = np.arange(len(velocity), dtype=np.float64) * np.float64(step)
    assert np.all(np.abs(Dahl(0.6, 1e6).torque_nm(time, velocity)) <= 0.6 * (1 + 1e-12))
    bristles = LuGre(0.6, 0.0, 0.2, 0.5, 1e6).torque_nm(time, velocity)
    assert np.all(np.abs(bristles) <= 0.8 * (1 + 1e-12))
    both = BlimanSorine(1.0, 0.4, 0.2, 1e-3).torque_nm(time, velocity)
    assert np.all(np.abs(both) <= 1.4 * (1 + 1e-12))


@given(st.integers(0, 2**32 - 1))
def test_closed_cycles_dissipate(seed: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 4.0, 5e-4)
    phase = rng.uniform(0.0, 2.0 * np.pi, 3)
    velocity = np.sum([np.sin(2 * np.pi * (k + 1) * time + phase[k]) for k in range(3)], axis=0)
    laws = (Dahl(0.6, 60.0), LuGre(0.6, 0.01, 0.2, 0.5, 60.0), BlimanSorine(1.0, 0.4, 0.2, 0.05))
    for law in laws:
        torque = law.torque_nm(time, velocity)
        last = time >= 3.0
        assert np.trapezoid(torque[last] * velocity[last], time[last]) > 0.0


def test_dahl_is_a_spring_at_first_and_knows_travel_alone() -> None:
    law = Dahl(0.6, 60.0)
    time = np.linspace(0.0, 1.0, 101)
    slow, fast = (
        law.torque_nm(time, np.full(101, 1e-5)),
        law.torque_nm(time / 50, np.full(101, 5e-4)),
    )
    assert slow == pytest.approx(60.0 * 1e-5 * time, rel=1e-3)
    assert slow == pytest.approx(fast, rel=1e-12)
    assert law.torque_nm(time, np.ones(101))[-1] == pytest.approx(0.6)
    assert law.torque_nm(time, np.zeros(101), start_nm=0.3) == pytest.approx(np.full(101, 0.3))


def test_bliman_sorine_overshoots_and_settles_at_the_difference() -> None:
    law = BlimanSorine(1.0, 0.4, 0.2, 0.01, 0.05)
    time = np.linspace(0.0, 1.0, 10001)
    torque = law.torque_nm(time, np.ones(10001))
    assert torque[-1] == pytest.approx(0.6 + 0.05)
    assert torque.max() > 0.75


def test_samples_that_are_not_numbers_have_no_torque_and_move_no_state() -> None:
    time = np.linspace(0.0, 1.0, 101)
    velocity = np.full(101, 0.02)
    holed = velocity.copy()
    holed[40:45] = np.nan
    whole, gap = LUGRE.torque_nm(time, velocity), LUGRE.torque_nm(time, holed)
    assert np.flatnonzero(np.isnan(gap)).tolist() == list(range(40, 45))
    assert gap[45:] == pytest.approx(whole[45:])
    with pytest.raises(ValueError, match="strictly increasing"):
        LUGRE.torque_nm(time[::-1], velocity)


def test_impossible_parameters_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match="stiffness_nm_per_rad"):
        Dahl(0.6, 0.0)
    with pytest.raises(ValueError, match="viscous_nm_s_per_rad"):
        TemperatureViscous(-0.1, 0.0, 25.0, 20.0)
    with pytest.raises(ValueError, match="slow_nm"):
        BlimanSorine(1.0, 1.4, 0.2, 0.01)
    with pytest.raises(ValueError, match="Stribeck velocity"):
        ExtendedFriction(stribeck_velocity_rad_s_per_k=0.5)
    with pytest.raises(ValueError, match="finite"):
        PositionDependent(float("nan"), 0.0, 1.0)
