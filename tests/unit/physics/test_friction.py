"""The laws of friction: values by hand, symmetry, and the split that estimators lean on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.physics.friction import COULOMB_VISCOUS, FEENY_MOON, LAWS, STRIBECK

EXAMPLE = {
    "coulomb_nm": 0.6,
    "viscous_nm_s_per_rad": 0.01,
    "static_extra_nm": 0.2,
    "stribeck_velocity_rad_s": 5.0,
    "exponent": 2.0,
    "mu": 0.7,
    "beta_s_per_rad": 0.3,
}


def test_values_by_hand() -> None:
    assert COULOMB_VISCOUS.torque(10.0, EXAMPLE) == pytest.approx(0.7)
    assert STRIBECK.torque(5.0, EXAMPLE) == pytest.approx(0.65 + 0.2 / np.e)
    assert FEENY_MOON.torque(10.0, EXAMPLE) == pytest.approx(0.1 + 0.6 * (0.7 + 0.3 / np.cosh(3.0)))


@given(velocity=st.floats(-1e4, 1e4, allow_subnormal=False))
def test_friction_is_odd_and_zero_at_rest(velocity: float) -> None:
    for each in LAWS.values():
        forward, backward = each.torque(velocity, EXAMPLE), each.torque(-velocity, EXAMPLE)
        assert forward == pytest.approx(-backward)
        assert np.isfinite(forward)
        assert each.torque(0.0, EXAMPLE) == 0.0


def test_columns_broadcast_over_grids() -> None:
    velocity = np.array([1.0, 2.0, 3.0, 4.0])
    grid = STRIBECK.columns(velocity, np.array([1.0, 5.0]), np.array([1.0, 2.0]))
    assert grid.shape == (2, 4, 3)
    np.testing.assert_allclose(grid[1], STRIBECK.columns(velocity, 5.0, 2.0))


def test_missing_parameters_are_named() -> None:
    with pytest.raises(ValueError, match="exponent"):
        STRIBECK.torque(1.0, {k: v for k, v in EXAMPLE.items() if k != "exponent"})


def test_bounds_scale_with_the_unit_of_speed() -> None:
    for law in LAWS.values():
        for entry in law.ranges:
            low, high = entry.bounds(2.0, 50.0)
            low10, high10 = entry.bounds(20.0, 500.0)
            factor = 10.0**entry.per_speed
            assert (low10, high10) == pytest.approx((factor * low, factor * high))
