"""The slope of sampled values: exact where its order says so, and for uneven time by two points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.physics.derivative import slope, slope_over

NUMBERS = st.lists(st.floats(-3.0, 3.0), min_size=5, max_size=5)


@given(NUMBERS, st.floats(1e-4, 0.1))
def test_a_polynomial_of_fourth_degree_has_its_own_slope_inside(
    numbers: list[float], period_s: float
) -> None:
    time = period_s * np.arange(-10, 11)
    law = np.polynomial.Polynomial(numbers)
    found = slope(law(time), period_s)
    assert found[2:-2] == pytest.approx(law.deriv()(time)[2:-2], abs=1e-9 / period_s)


@pytest.mark.parametrize("share", [0.02, 0.05, 0.1])
def test_a_wave_loses_what_five_points_lose_and_is_not_shifted(share: float) -> None:
    """`share` is the wave's frequency over the sampling rate."""
    turn = 2.0 * np.pi * share
    steps = np.arange(400)
    found = slope(np.sin(turn * steps), 1.0)[2:-2]
    columns = np.stack((turn * np.cos(turn * steps), turn * np.sin(turn * steps)), axis=1)[2:-2]
    gain, lag = np.linalg.lstsq(columns, found, rcond=None)[0]
    assert 1.0 - gain == pytest.approx(turn**4 / 30.0, rel=0.1)
    assert abs(lag) < 1e-12


def test_uneven_time_and_few_samples_are_taken_as_they_are() -> None:
    time = np.array([0.0, 0.1, 0.3, 0.4, 0.45, 0.7])
    assert slope_over(time, 3.0 * time) == pytest.approx(np.full(6, 3.0))
    even = np.linspace(0.0, 1.0, 6)
    assert np.array_equal(slope_over(even, even**3), slope(even**3, 0.2))
    assert slope_over(time[:2], time[:2]) == pytest.approx([1.0, 1.0])
    assert slope_over(time[:1], time[:1]).tolist() == [0.0]
