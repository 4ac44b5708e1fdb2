"""Springs, gaps, periodic effects and heat: conservation, limits, and the thesis' numbers."""

from __future__ import annotations

import numpy as np
import pytest

from agent.physics.backlash import DeadZone, NordinGutman
from agent.physics.flexibility import ThreeMass, TwoMass
from agent.physics.periodic import KinematicError, ResolverError, TorqueRipple
from agent.physics.thermal import (
    THESIS_OILS,
    GearboxTemperature,
    Oil,
    WindingResistance,
    followed_k,
    friction_integral,
    integral_slope,
    relaxation_columns,
    relaxation_time_s,
)

TWO = TwoMass(0.002, 0.016, 8.0, 0.0, 300.0)
THREE = ThreeMass(0.004, 0.009, 0.02, 20.59, 20.23, 0.06, 0.01)


def test_undamped_cubic_spring_keeps_its_energy() -> None:
    state = np.array([0.2, 0.0, 0.0])
    before, step = TWO.energy_j(state), 2e-5
    for _ in range(5000):
        k1 = TWO.derivative(state, 0.0)
        k2 = TWO.derivative(state + 0.5 * step * k1, 0.0)
        k3 = TWO.derivative(state + 0.5 * step * k2, 0.0)
        k4 = TWO.derivative(state + step * k3, 0.0)
        state = state + step / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4)
    assert abs(state[0]) < 0.2 + 1e-9
    assert TWO.energy_j(state) == pytest.approx(before, rel=1e-8)


@pytest.mark.parametrize("law", [TwoMass(0.002, 0.016, 8.0, 0.01), THREE])
def test_matrices_are_the_derivative_of_small_motion(law: TwoMass | ThreeMass) -> None:
    space = law.state_space()
    state = np.random.default_rng(1).normal(size=len(space.A))
    assert law.derivative(state, 0.7) == pytest.approx(space.A @ state + space.B * 0.7)


def test_slow_motion_sees_all_inertia_and_fast_motion_the_motors() -> None:
    for law, motor, whole in ((TWO, 0.002, 0.018), (THREE, 0.004, 0.033)):
        slow, fast = 0.01, 1e5
        response = law.state_space().response(np.array([slow, fast]))
        inertia = 1.0 / (2.0 * np.pi * np.array([slow, fast]) * np.abs(response))
        assert inertia == pytest.approx([whole, motor], rel=2e-3)


def test_resonances_are_poles_and_antiresonances_zeros_of_the_response() -> None:
    two = TwoMass(0.002, 0.016, 8.0)
    three = ThreeMass(0.004, 0.009, 0.02, 20.59, 20.23)
    for space, poles, zeros in (
        (two.state_space(), [two.resonance_hz()], [two.antiresonance_hz()]),
        (three.state_space(), three.resonances_hz(), three.antiresonances_hz()),
    ):
        swinging = np.unique(np.round(np.abs(np.linalg.eigvals(space.A).imag), 6))
        assert swinging[swinging > 1.0] == pytest.approx(2 * np.pi * np.asarray(poles), rel=1e-6)
        assert np.abs(space.response(np.asarray(zeros))) == pytest.approx(0.0, abs=1e-9)


def test_a_stiff_arm_makes_three_masses_two() -> None:
    stiff = ThreeMass(0.004, 0.009, 0.02, 20.0, 1e9)
    assert stiff.resonances_hz()[0] == pytest.approx(TwoMass(0.004, 0.029, 20.0).resonance_hz())


def test_dead_zone_bears_outside_the_gap_only() -> None:
    law = DeadZone(0.1, 50.0)
    torque = law.torque_nm(np.array([-0.3, -0.1, 0.05, 0.1, 0.2]))
    assert torque == pytest.approx([-10.0, 0.0, 0.0, 0.0, 5.0])


def test_parted_teeth_never_pull_and_slow_twist_is_the_dead_zone() -> None:
    gap = NordinGutman(0.1, 50.0, 0.5)
    time = np.linspace(0.0, 4.0, 8001)
    for hertz in (0.01, 3.0):
        twist = 0.3 * np.sin(2 * np.pi * hertz * time)
        rate = 2 * np.pi * hertz * 0.3 * np.cos(2 * np.pi * hertz * time)
        torque, angle = gap.torque_nm(time, twist, rate), gap.gap_rad(time, twist)
        assert np.all(torque * angle >= 0.0)
        assert np.all(np.abs(angle) <= 0.1)
        if hertz < 1.0:
            # The damper alone, k c/k * rate, stands between the two laws.
            assert torque == pytest.approx(DeadZone(0.1, 50.0).torque_nm(twist), abs=0.5 * 0.02)
    without = NordinGutman(0.0, 50.0, 0.5).torque_nm(time, twist, rate)
    assert without == pytest.approx(50.0 * twist + 0.5 * rate)


def test_ripple_has_its_order_and_grows_with_load() -> None:
    ripple = TorqueRipple(0.3, 0.4, 14.0, 0.5)
    angle = 2.0 * np.pi * np.arange(256) / 256
    lines = np.abs(np.fft.rfft(ripple.torque_nm(angle))) / 128
    assert np.flatnonzero(lines > 1e-9).tolist() == [14]
    assert lines[14] == pytest.approx(0.5)
    assert ripple.torque_nm(angle, -2.0) == pytest.approx(2.0 * ripple.torque_nm(angle))


def test_wobbling_gear_gives_back_what_it_takes() -> None:
    law = KinematicError(2e-3, 1e-3, 2.0, 0.01)
    time = np.linspace(0.0, 1.0, 20001)
    # From rest to rest, so that no kinetic energy is left in the arm.
    position = 5.0 * (1.0 - np.cos(2 * np.pi * time))
    velocity = 10.0 * np.pi * np.sin(2 * np.pi * time)
    acceleration = 20.0 * np.pi**2 * np.cos(2 * np.pi * time)
    torque = law.torque_nm(position, velocity, acceleration)
    assert np.trapezoid(np.abs(torque * velocity), time) > 0.1
    assert np.trapezoid(torque * velocity, time) == pytest.approx(0.0, abs=1e-5)
    arm_rate = np.gradient(law.arm_rad(position), time, edge_order=2)
    kinetic = 0.5 * 0.01 * (arm_rate**2 - velocity**2)
    power = np.gradient(kinetic, time)
    assert power[10:-10] == pytest.approx((torque * velocity)[10:-10], abs=2e-3)
    assert law.torque_nm(position, 2.0 * velocity, 0.0 * velocity) == pytest.approx(
        4.0 * law.torque_nm(position, velocity, 0.0 * velocity)
    )


def test_resolver_error_leaves_the_derivatives_of_the_true_angle() -> None:
    law = ResolverError((1e-3, 0.0), (0.0, 2e-3), (1.0, 2.0))
    time = np.linspace(0.0, 1.0, 20001)
    q, v, a = 3.0 * time**2, 6.0 * time, np.full(20001, 6.0)
    true, rate, bend = law.true_motion(q, v, a)
    assert np.gradient(true, time)[1:-1] == pytest.approx(rate[1:-1], abs=1e-6)
    assert np.gradient(rate, time)[1:-1] == pytest.approx(bend[1:-1], abs=1e-5)


def test_cooling_halves_as_the_thesis_constant_says_and_the_cycle_lifts_the_end() -> None:
    rate = 6.2122e-5  # thesis A.1, the mean of its three oils
    cooling = GearboxTemperature(rate, 22.0)
    half = np.log(2.0) / rate  # about three hours
    assert cooling.temperature_degc(np.array([0.0, half]), 50.0) == pytest.approx([50, 36])
    # The error of the thesis' model in the end, about 4 K, is what the cycles add.
    assert GearboxTemperature(rate, 22.0, 4.0).temperature_degc(np.array(1e6), 50.0) == (
        pytest.approx(26.0)
    )


def test_winding_by_hand_and_back() -> None:
    copper = WindingResistance(2.0)
    assert copper.resistance_ohm(np.array([20.0, 275.0])) == pytest.approx([2.0, 4.0])
    assert copper.temperature_degc(copper.resistance_ohm(np.array(87.0))) == pytest.approx(87.0)


def test_oils_pass_through_their_data_sheets_and_keep_their_order() -> None:
    temperature = np.linspace(20.0, 110.0, 91)
    curves = [oil.viscosity_mm2_s(temperature) for oil in THESIS_OILS.values()]
    sheets = ((150.0, 18.0), (220.0, 34.4), (320.0, 52.7))
    for curve, sheet in zip(curves, sheets, strict=True):
        assert curve[[20, 80]] == pytest.approx(sheet)
        assert np.all(np.diff(curve) < 0.0)
    assert np.all(curves[0] < curves[1])
    assert np.all(curves[1] < curves[2])


def test_an_oil_thins_as_it_warms() -> None:
    with pytest.raises(ValueError, match="fall"):
        Oil(18.0, 150.0)


def test_friction_integral_falls_linearly_with_a_linear_viscosity() -> None:
    velocity = np.linspace(1.0, 250.0, 50)
    temperature = np.linspace(24.0, 50.0, 6)
    slopes = 0.01 - 1e-4 * (temperature - 24.0)
    curves = 0.6 + slopes[:, np.newaxis] * velocity
    found = integral_slope(temperature, friction_integral(velocity, curves))
    assert found == pytest.approx(-1e-4 * (250.0**2 - 1.0) / 2.0)
    with pytest.raises(ValueError, match="different"):
        integral_slope(np.ones(3), np.ones(3))


def test_cooling_in_arrays_is_the_gearbox_law() -> None:
    time_s = np.linspace(0.0, 9e4, 40)
    for start in (62.0, 21.0):
        law = GearboxTemperature(6.4e-5, 21.5, 14.0)
        one = law.temperature_degc(time_s, start)
        columns = relaxation_columns(law.rate_per_s, time_s)
        assert columns @ np.array([law.final_degc, start]) == pytest.approx(one, rel=1e-12)
        reached = relaxation_time_s(law.rate_per_s, law.final_degc, start, one)
        assert reached == pytest.approx(time_s, abs=1e-6)
        beyond = np.array([law.final_degc, start + (start - law.final_degc)])
        assert np.isinf(relaxation_time_s(law.rate_per_s, law.final_degc, start, beyond)).all()


def test_a_step_of_the_environment_is_followed_as_newton_cools() -> None:
    time_s = np.linspace(0.0, 5e4, 30)
    followed = followed_k(6.4e-5, time_s, np.full_like(time_s, 3.0))
    expected = GearboxTemperature(6.4e-5, 3.0).temperature_degc(time_s, 0.0)
    assert followed == pytest.approx(expected, rel=1e-12, abs=1e-12)
