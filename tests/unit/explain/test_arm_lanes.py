"""Stretches that are followed side by side do not know of each other."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agent.physics.kernels_arm import shaft_rad_s2


@pytest.mark.parametrize(
    ("half_gaps", "film", "stiffening", "holds", "parting"),
    [
        ([0.0], 0.0, 0.0, 0.0, 0.0),
        ([0.003], 0.0, 0.0, 0.0, 0.0),
        ([0.002, 0.003, 0.005], 40.0, 0.0, 0.0, 0.0),
        ([0.002, 0.003, 0.005], 0.0, 0.0, 0.0, 0.7),
        ([0.0], 0.0, 900.0, 0.0, 0.0),
        ([0.0], 0.0, 0.0, 200.0, 0.0),
    ],
)
def test_every_stretch_of_every_arm_has_the_torque_that_it_has_alone(
    half_gaps: list[float], film: float, stiffening: float, holds: float, parting: float
) -> None:
    rng = np.random.default_rng(0)
    lengths = np.array([400, 371, 5, 1, 222, 300, 40, 399, 120, 77, 310])  # more than lanes
    stops = np.cumsum(lengths)
    starts, periods = stops - lengths, 0.002 + 1e-6 * rng.standard_normal(lengths.size)
    velocity = 10.0 * np.sin(0.05 * np.arange(stops[-1])) + rng.standard_normal(stops[-1])
    weight = 30.0 * np.cos(0.01 * np.arange(stops[-1]))
    lighter = 900.0 * np.sin(0.01 * np.arange(stops[-1]))
    friction = 40.0 + 10.0 * np.sin(0.003 * np.arange(stops[-1]))
    arm, teeth = (2.0 * math.pi * 30.0, 0.2, 0.005), (film, parting, stiffening)
    held = (holds, 0.004) if holds else None
    gaps = np.array(half_gaps)
    together, alone = np.full((2, gaps.size, stops[-1]), np.nan)
    what = velocity, weight, lighter, friction
    shaft_rad_s2(*what, starts, stops, periods, *arm, gaps, *teeth, held, 2, together)
    for k in range(lengths.size):
        of = slice(k, k + 1)
        one = starts[of], stops[of], periods[of]
        for gap in range(gaps.size):
            own = slice(gap, gap + 1)
            shaft_rad_s2(*what, *one, *arm, gaps[own], *teeth, held, 2, alone[own])
    assert np.isfinite(together).all()
    np.testing.assert_array_equal(together, alone)
