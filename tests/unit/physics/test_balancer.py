"""A balancer's torque is the slope of what its spring stores, whatever its levers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.physics.balancer import Balancer, Floats

LEVERS = st.floats(0.1, 2.0)
FORCES = st.floats(-50.0, 50.0)


@given(LEVERS, st.floats(0.05, 0.95), FORCES, st.floats(0.0, 80.0), st.floats(-3.0, 3.0))
def test_it_is_the_slope_of_the_springs_energy(
    longer_m: float, ratio: float, at_no_length_n: float, stiffness: float, center: float
) -> None:
    shorter_m, arm = ratio * longer_m, np.linspace(-2.0, 2.0, 41)

    def energy(arm_rad: Floats) -> Floats:
        levers = 2.0 * shorter_m * longer_m * np.cos(arm_rad - center)
        square = shorter_m**2 + longer_m**2 - levers
        return np.asarray(at_no_length_n * np.sqrt(square) + 0.5 * stiffness * square)

    law = Balancer(shorter_m * at_no_length_n, ratio, center, shorter_m * longer_m * stiffness)
    slope = (energy(arm + 1e-5) - energy(arm - 1e-5)) / 2e-5
    np.testing.assert_allclose(law.torque_nm(arm), slope, atol=1e-4 * (1.0 + np.abs(slope).max()))


@pytest.mark.parametrize(
    ("ratio", "stiffness", "reason"),
    [(1.0, 0.0, "below 1"), (0.0, 0.0, "above 0"), (0.5, -1.0, "0 or more")],
)
def test_levers_that_are_none_and_springs_that_give_way_are_refused(
    ratio: float, stiffness: float, reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        Balancer(1.0, ratio, 0.0, stiffness)
