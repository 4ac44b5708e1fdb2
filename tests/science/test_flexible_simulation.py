"""The compiled simulation against scipy's integrator, and its stick and slip."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agent.identify.flexible.chain import Chain, apparent_inertia, chain_of, shape_of
from agent.identify.flexible.loops import simulate_steps
from agent.identify.flexible.simulation import (
    FlexibleJoint,
    compiled,
    simulate,
    state_space,
)
from agent.physics.flexibility import ThreeMass, TwoMass
from agent.physics.friction import STRIBECK
from agent.physics.rigid_body import gravity_columns

TWO = Chain((0.01,), (25.3,), (0.04,))
THREE = Chain((0.003, 0.008), (60.0, 30.0), (0.05, 0.03))


@pytest.mark.parametrize("chain", [None, TWO, THREE])
def test_without_dry_friction_it_is_the_linear_system(chain: Chain | None) -> None:
    from scipy.signal import lsim

    joint = FlexibleJoint(0.0084, chain, viscous_nm_s_per_rad=0.0107)
    time_s = np.arange(4000) * 0.001
    torque = np.sin(7.0 * time_s) + 0.3 * np.sin(45.0 * time_s)
    a, b, _ = state_space(joint)
    c = np.zeros((1, b.size))
    c[0, 0] = 1.0
    _, expected, _ = lsim((a, b[:, np.newaxis], c, [[0.0]]), torque, time_s)
    np.testing.assert_allclose(simulate(joint, torque, 0.001).velocity_rad_s, expected, atol=1e-9)


def test_with_dry_friction_it_follows_a_fine_integration_between_reversals() -> None:
    from scipy.integrate import solve_ivp

    joint = FlexibleJoint(0.0084, TWO, coulomb_nm=0.6042, viscous_nm_s_per_rad=0.0107)
    time_s = np.arange(2001) * 0.00025
    torque = 2.0 + np.sin(20.0 * time_s)  # the motor never turns back
    a, b, _ = state_space(joint)

    def slope(
        t: float, x: np.ndarray[tuple[int], np.dtype[np.float64]]
    ) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return np.asarray(a @ x + b * (2.0 + np.sin(20.0 * t) - 0.6042), dtype=np.float64)

    fine = solve_ivp(slope, (0.0, time_s[-1]), np.zeros(3), t_eval=time_s, rtol=1e-10, atol=1e-10)
    assert fine.y[0, 1:].min() > 0.0
    np.testing.assert_allclose(
        simulate(joint, torque, 0.00025).velocity_rad_s, fine.y[0], atol=2e-5
    )


@pytest.mark.parametrize("period_s", [1e-5, 1e-3, 0.05])
def test_below_breakaway_it_stands_for_any_step(period_s: float) -> None:
    joint = FlexibleJoint(0.0084, TWO, coulomb_nm=0.6, static_extra_nm=0.2)
    hold = simulate(joint, np.full(500, 0.79), period_s)
    assert not hold.velocity_rad_s.any()
    assert simulate(joint, np.full(500, 0.81), period_s).velocity_rad_s[-1] > 0.0


def test_a_thrown_joint_comes_to_rest_and_stays_for_a_stiff_spring_too() -> None:
    stiff = Chain((0.01,), (1e6,), (1.0,))
    motion = simulate(
        FlexibleJoint(0.0084, stiff, coulomb_nm=0.6), np.zeros(4000), 0.001, velocity_rad_s=50.0
    )
    # Coulomb friction alone stops v in J v / fc seconds.
    stop = 0.0184 * 50.0 / 0.6
    assert abs(motion.velocity_rad_s[int(stop * 1000) + 5 :]).max() < 1e-6
    assert motion.velocity_rad_s[int(0.5 * stop * 1000)] == pytest.approx(25.0, rel=0.01)


@pytest.mark.parametrize("chain", [TWO, THREE])
def test_a_shape_is_its_chain_and_cannot_be_infeasible(chain: Chain) -> None:
    again = chain_of(shape_of(chain), chain.total_kg_m2)
    np.testing.assert_allclose(again.spring_nm_per_rad, chain.spring_nm_per_rad)
    np.testing.assert_allclose(again.damper_nm_s_per_rad, chain.damper_nm_s_per_rad)
    rng = np.random.default_rng(0)
    for _ in range(100):
        wild = chain_of(rng.uniform(-6.0, 6.0, shape_of(chain).size))
        assert min(*wild.spring_nm_per_rad, *wild.inertia_kg_m2, *wild.damper_nm_s_per_rad) > 0.0
    still = apparent_inertia(chain, np.array([1e-6]))
    assert still[0].real == pytest.approx(chain.total_kg_m2)


@pytest.mark.parametrize("fast", [False, True])
@pytest.mark.parametrize("velocity", [0.0, 0.3, 4.0, -9.0])
def test_the_loop_carries_the_friction_and_gravity_of_the_laws(fast: bool, velocity: float) -> None:
    steps = compiled(simulate_steps) if fast else simulate_steps
    one, push = np.array([1.0]), 50.0 if velocity >= 0.0 else -50.0
    position, moved = np.array([20.0, 0.0]), np.empty(2)
    # One step of a state that adds up what acts on it leaves push, friction and load.
    steps(
        np.eye(1),
        one,
        np.zeros(1),
        one,
        one,
        np.array([0.6, 0.25, 3.0, 1.4]),
        np.array([1.7, -0.9, 35.0]),
        0.0,
        0.001,
        np.array([push, push]),
        np.array([velocity]),
        position,
        moved,
    )
    values = {"coulomb_nm": 0.6, "static_extra_nm": 0.25, "viscous_nm_s_per_rad": 0.0}
    values |= {"stribeck_velocity_rad_s": 3.0, "exponent": 1.4}
    # At rest the static law says nothing: the loop's level is the limit from the side of the push.
    friction = STRIBECK.torque(velocity if velocity else 1e-12, values)
    load = gravity_columns(np.array([20.0]), 35.0) @ np.array([1.7, -0.9])
    assert moved[1] == pytest.approx(velocity + push - float(friction) - float(load[0]), abs=1e-10)


@pytest.mark.parametrize("law", [TwoMass, ThreeMass])
def test_the_apparent_inertia_is_that_of_the_state_space(law: type[TwoMass | ThreeMass]) -> None:
    chain = TWO if law is TwoMass else THREE
    jm, hertz = 0.0084, np.geomspace(0.2, 300.0, 60)
    space = law(
        jm, *chain.inertia_kg_m2, *chain.spring_nm_per_rad, *chain.damper_nm_s_per_rad
    ).state_space()
    omega = 2.0 * np.pi * hertz
    whole = 1.0 / (1j * omega * space.response(hertz))
    np.testing.assert_allclose(jm + apparent_inertia(chain, omega), whole, rtol=1e-9)


def test_a_stiffening_spring_follows_a_fine_integration() -> None:
    from scipy.integrate import solve_ivp

    law = TwoMass(0.0084, 0.01, 25.3, 0.04, 300.0)
    joint = FlexibleJoint(0.0084, TWO, cubic_spring_nm_per_rad3=300.0)
    time_s = np.arange(1001) * 0.001
    torque = 2.5 * np.sin(2.0 * np.pi * 9.0 * time_s)

    def slope(
        t: float, x: np.ndarray[tuple[int], np.dtype[np.float64]]
    ) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return law.derivative(x, 2.5 * math.sin(2.0 * math.pi * 9.0 * t))

    fine = solve_ivp(slope, (0.0, 1.0), np.zeros(3), t_eval=time_s, rtol=1e-9, atol=1e-9)
    velocity = simulate(joint, torque, 0.001).velocity_rad_s
    linear = simulate(FlexibleJoint(0.0084, TWO), torque, 0.001).velocity_rad_s
    size = float(np.sqrt(np.mean(fine.y[1] ** 2)))
    assert float(np.sqrt(np.mean((velocity - fine.y[1]) ** 2))) < 0.01 * size
    assert float(np.sqrt(np.mean((linear - fine.y[1]) ** 2))) > 0.2 * size
