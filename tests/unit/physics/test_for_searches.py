"""What searches try is the laws' own equation: without checks, per unit, or in another step."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agent.physics.flexibility import apparent_inertia_kg_m2, lag_share
from agent.physics.friction_drift import RunIn, come_share, coming_share
from agent.physics.friction_dynamic import Dahl, LuGre, dahl_share
from agent.physics.friction_oil import (
    CrossShear,
    EyringShear,
    NonlinearViscous,
    cross_nm,
    eyring_nm,
    power_law_nm,
    thinned_share,
    thinning_share,
)
from agent.physics.kernels_arm import shaft_rad_s2
from agent.physics.kernels_carried import carried_arms
from agent.physics.periodic import KinematicError, ResolverError, wave_rates
from agent.physics.reported import TorqueSaturation, limited_nm
from agent.physics.rigid_body import gravity_columns, weight_nm
from agent.physics.thermal import THESIS_OILS, Oil

TIME = np.arange(0.0, 4.0, 0.002)
VELOCITY = 30.0 * np.sin(3.0 * TIME + 0.4)
DIRECTION = np.sign(VELOCITY)


def test_oil_that_bends_friction_is_its_law_times_the_direction() -> None:
    for law, unit in (
        (NonlinearViscous(0.7, 20.0, 0.6), power_law_nm(DIRECTION, VELOCITY, 20.0, 0.6)),
        (EyringShear(0.7, 4.0), eyring_nm(DIRECTION, VELOCITY, 4.0)),
        (CrossShear(0.7, 4.0), cross_nm(DIRECTION, VELOCITY, 4.0)),
    ):
        assert law.torque_nm(VELOCITY) == pytest.approx(0.7 * unit, rel=1e-14)


def test_a_search_may_try_what_no_oil_does() -> None:
    with pytest.raises(ValueError, match="exponent"):
        NonlinearViscous(1.0, 20.0, -0.1)
    assert power_law_nm(1.0, np.array([5.0, 20.0]), 20.0, -0.1)[1] == 1.0


def test_what_has_come_and_what_is_still_to_come_are_all_of_a_change() -> None:
    since = np.geomspace(1e-9, 50.0, 40)
    assert come_share(since, 7.0) + coming_share(since, 7.0) == pytest.approx(1.0, abs=1e-15)
    law = RunIn(0.3, 0.0, 7.0).torque_nm(np.ones(40), np.ones(40), since)
    assert law == pytest.approx(0.3 * come_share(since, 7.0), rel=1e-14)


@pytest.mark.parametrize("oil", THESIS_OILS.values(), ids=THESIS_OILS)
def test_a_film_thins_as_the_oils_do(oil: Oil) -> None:
    degc = np.linspace(20.0, 50.0, 31)
    viscosity = oil.viscosity_mm2_s(degc)
    decay_k = -1.0 / float(np.gradient(np.log(viscosity), degc)[15])
    left = 1.0 - thinned_share((degc - 35.0) / decay_k)
    assert left == pytest.approx(viscosity / viscosity[15], rel=0.03)
    # Close by it is the exponential.
    near = np.array([-0.01, 0.01])
    assert 1.0 - thinned_share(near) == pytest.approx(thinning_share(near, 0.0, 1.0), rel=2e-5)


def test_dahls_share_is_dahls_torque_over_its_level() -> None:
    law = Dahl(0.7, 0.7 / 0.8)
    share = dahl_share(TIME, VELOCITY, 0.8, 1.0)
    assert law.torque_nm(TIME, VELOCITY, 0.7) / 0.7 == pytest.approx(share, abs=0.02)
    assert share.min() < -0.99 < 0.99 < share.max()


def test_bristles_rate_is_what_their_damping_multiplies() -> None:
    damped = LuGre(0.7, 0.0, 0.2, 3.0, 9.0, 0.05)
    bristles = LuGre(0.7, 0.0, 0.2, 3.0, 9.0).torque_nm(TIME, VELOCITY)
    rate = damped.rate_rad_s(VELOCITY, bristles)
    assert damped.torque_nm(TIME, VELOCITY) == pytest.approx(bristles + 0.05 * rate, abs=1e-12)
    # dz/dt of z, which the bristles hold by their stiffness.
    slope = np.gradient(bristles / 9.0, TIME)
    assert rate[1:-1] == pytest.approx(slope[1:-1], abs=0.2)


def test_rates_of_waves_are_those_of_the_laws_of_an_angle() -> None:
    position, acceleration = np.cumsum(VELOCITY) * 0.002, 90.0 * np.cos(3.0 * TIME + 0.4)
    motion, order, cos, sin = (position, VELOCITY, acceleration), 7.0, 2e-3, -1e-3
    waves = np.cos(order * position), np.sin(order * position)
    rates = wave_rates(order, *waves, VELOCITY, acceleration)
    total = cos * rates[0] + sin * rates[1]
    gear = KinematicError(cos, sin, order, 0.01)
    assert gear.shaking(*motion)[2] == pytest.approx(total, rel=1e-9, abs=1e-9)
    true = ResolverError((cos,), (sin,), (order,)).true_motion(*motion)[2]
    assert acceleration - true == pytest.approx(total, rel=1e-9, abs=1e-9)


def test_a_limit_and_a_weight_of_plain_numbers_are_the_laws() -> None:
    torque = np.array([-3.0, -0.5, 0.0, 2.0])
    assert np.array_equal(limited_nm(torque, 1.5), TorqueSaturation(1.5).reported_nm(torque))
    columns = gravity_columns(np.array([20.0]), 35.0) @ np.array([1.7, -0.9])
    assert weight_nm(20.0 / 35.0, 1.7, -0.9) == pytest.approx(float(columns[0]), rel=1e-15)


@pytest.mark.parametrize(
    ("half_gap", "stiffening", "holds", "heavy_nm", "parting"),
    [
        (0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 3.0, 0.0, 0.0, 0.0),
        (0.05, 0.0, 0.0, 0.0, 0.0),
        (0.05, 3.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 60.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.9, 0.0),
        (0.05, 0.0, 0.0, 0.9, 0.0),
        (0.05, 0.0, 0.0, 0.9, 1.0),
        (0.05, 0.0, 0.0, 0.0, 0.4),
    ],
)
def test_the_arm_of_searches_is_the_arm_of_the_twin(
    half_gap: float, stiffening: float, holds: float, heavy_nm: float, parting: float
) -> None:
    """A heavy arm hangs where it is, and not where the motor is: a hundredth of its weight."""
    inertia, omega, damping, reach, film = 0.004, 2.0 * math.pi * 8.0, 0.15, 0.02, 2.0
    friction, stiffness = 30.0, 0.004 * omega**2
    speed = 12.0 * np.sin(4.0 * TIME)
    position = 3.0 * (1.0 - np.cos(4.0 * TIME))
    dry, angle = np.full_like(TIME, friction), position / 10.0
    weight, lighter = (heavy_nm / inertia * x for x in (np.sin(angle), np.cos(angle) / 10.0))
    (found,) = paths = np.empty((1, TIME.size))
    one = np.array([0]), np.array([TIME.size]), np.array([0.002])
    shaft_rad_s2(
        speed,
        weight,
        lighter,
        dry,
        *one,
        omega,
        damping,
        reach,
        np.array([half_gap]),
        film,
        parting,
        stiffening,
        (holds, 0.03) if holds else None,
        40,
        paths,
    )
    (law,) = carried_arms(
        TIME,
        position,
        speed,
        inertia,
        stiffness,
        stiffening * stiffness,
        2.0 * damping * inertia * omega,
        np.array([half_gap]),
        heavy_nm,
        0.0,
        10.0,
        40,
        48.0,
        0.0,
        inertia * dry,
        reach,
        film * inertia,
        0.0,
        inertia * holds,
        0.03,
        parting,
    )
    # The starts differ: one arm follows the motor's speed, the other its acceleration as well.
    settled = TIME > 1.0
    missed = (inertia * found - law)[settled]
    assert float(np.std(missed)) < 0.02 * float(np.std((law - inertia * weight)[settled]))


def test_a_mass_lags_by_what_the_motor_does_not_feel_of_it() -> None:
    omega = 2.0 * np.pi * np.geomspace(0.1, 300.0, 50)
    felt = apparent_inertia_kg_m2([0.004], [9.7], [0.03], omega)
    assert 1.0 - lag_share(0.004, 9.7, 0.03, omega) == pytest.approx(felt / 0.004, rel=1e-9)
