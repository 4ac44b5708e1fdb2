"""Reversals: amplitudes halve about the centre, and what cannot be told apart is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from trajectories import Trajectory, TrajectoryError, reversals

Floats = NDArray[np.float64]
BOUNDS: dict[str, Any] = {
    "velocity_rad_s": 4.0,
    "acceleration_rad_s2": 50.0,
    "jerk_rad_s3": 2000.0,
}


def turning_points(motion: Trajectory) -> Floats:
    at = motion.sample(np.linspace(0.0, motion.duration_s, 40_001))
    moving = at.velocity_rad_s != 0.0
    velocity, position = at.velocity_rad_s[moving], at.position_rad[moving]
    return np.asarray(position[:-1][np.diff(np.sign(velocity)) != 0.0])


@pytest.mark.parametrize("rest_s", [0.0, 0.2])
def test_amplitudes_halve_about_the_centre_to_either_side(rest_s: float) -> None:
    motion = reversals(10.0, 8.0, halvings=5, rest_s=rest_s, **BOUNDS)
    expected = [10.0 + side * 8.0 / 2**k for k in range(6) for side in (1, -1)]
    np.testing.assert_allclose(turning_points(motion), expected, atol=2e-3)
    assert motion.start_position_rad == 10.0
    assert motion.end_position_rad == pytest.approx(10.0, abs=1e-9)
    at = motion.sample(np.linspace(0.0, motion.duration_s, 5001))
    assert np.abs(at.velocity_rad_s).max() <= 4.0 * (1 + 1e-9)
    assert np.abs(at.acceleration_rad_s2).max() <= 50.0 * (1 + 1e-9)


def test_each_amplitude_may_be_swung_more_than_once() -> None:
    motion = reversals(0.0, 2.0, halvings=1, swings=2, **BOUNDS)
    np.testing.assert_allclose(turning_points(motion), [2, -2, 2, -2, 1, -1, 1, -1], atol=2e-3)


def test_it_round_trips_and_keeps_what_it_was_made_from() -> None:
    motion = reversals(0.0, 2.0, halvings=3, **BOUNDS)
    assert Trajectory.from_json(motion.to_json()) == motion
    assert motion.parameters["halvings"] == 3


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"amplitude_rad": 0.0}, "amplitude_rad must be above zero"),
        ({"halvings": -1}, "halvings must be a whole number"),
        ({"swings": 0}, "swings must be a whole number"),
        ({"centre_rad": 1e6, "halvings": 60}, "cannot be told apart"),
        ({"velocity_rad_s": float("nan")}, "velocity_rad_s must be finite"),
    ],
)
def test_what_cannot_be_driven_is_refused(changes: dict[str, Any], says: str) -> None:
    arguments = {"centre_rad": 0.0, "amplitude_rad": 1.0, "halvings": 3, **BOUNDS} | changes
    with pytest.raises(TrajectoryError, match=says):
        reversals(**arguments)
