"""The triangle wave: equal periods, exact corners, bounds kept, and plain JSON."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from trajectories import Trajectory, TrajectoryError, triangle, triangle_period_s

WAVE: dict[str, Any] = {
    "peak_velocity_rad_s": 60.0,
    "acceleration_rad_s2": 200.0,
    "jerk_rad_s3": 4000.0,
    "periods": 4,
    "rest_s": 0.25,
}


def test_every_period_is_the_same_motion() -> None:
    wave = triangle(3.0, **WAVE)
    period_s = triangle_period_s(60.0, 200.0, 4000.0)
    first_s = float(str(wave.parameters["first_period_s"]))
    grid_s = first_s + np.linspace(0.0, period_s, 997)
    one = wave.sample(grid_s)
    for k in range(1, 4):
        other = wave.sample(grid_s + k * period_s)
        np.testing.assert_allclose(other.velocity_rad_s, one.velocity_rad_s, atol=1e-9)
        np.testing.assert_allclose(other.position_rad, one.position_rad, atol=1e-8)


@pytest.mark.parametrize("offset", [0.0, 12.5, -75.0, 60.0])
def test_it_swings_between_its_corners_and_keeps_its_bounds(offset: float) -> None:
    wave = triangle(0.0, offset_velocity_rad_s=offset, **WAVE)
    points = wave.sample(np.linspace(0.0, wave.duration_s, 200_001))
    assert points.velocity_rad_s.max() == pytest.approx(max(offset + 60.0, 0.0), abs=1e-3)
    assert points.velocity_rad_s.min() == pytest.approx(min(offset - 60.0, 0.0), abs=1e-3)
    assert np.abs(points.acceleration_rad_s2).max() <= 200.0 * (1.0 + 1e-12)
    jerk = np.diff(points.acceleration_rad_s2) / np.diff(points.time_s)
    assert np.abs(jerk).max() <= 4000.0 * (1.0 + 1e-6)


def test_a_period_takes_the_motor_on_by_the_offset_alone() -> None:
    wave = triangle(0.0, offset_velocity_rad_s=5.0, **WAVE)
    period_s = float(str(wave.parameters["period_s"]))
    start_s = float(str(wave.parameters["first_period_s"]))
    moved = wave.at(start_s + period_s).position_rad - wave.at(start_s).position_rad
    assert moved == pytest.approx(5.0 * period_s)


def test_it_survives_json_and_runs_backward() -> None:
    wave = triangle(-1.0, **WAVE)
    again = Trajectory.from_json(json.loads(json.dumps(wave.to_json())))
    assert again == wave
    back = wave.reversed()
    assert back.duration_s == pytest.approx(wave.duration_s)
    assert back.end_position_rad == pytest.approx(-1.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"peak_velocity_rad_s": 0.0},
        {"peak_velocity_rad_s": -1.0},
        {"acceleration_rad_s2": float("nan")},
        {"jerk_rad_s3": 0.0},
        {"periods": 0},
        {"periods": 10_001},
        {"periods": 2.5},
        {"rest_s": -0.1},
        {"offset_velocity_rad_s": float("inf")},
        {"peak_velocity_rad_s": 1e-9, "offset_velocity_rad_s": 1e9},
    ],
)
def test_what_cannot_be_a_triangle_is_refused_by_name(wrong: dict[str, Any]) -> None:
    with pytest.raises(TrajectoryError, match=r"must|lost"):
        triangle(0.0, **{**WAVE, **wrong})
