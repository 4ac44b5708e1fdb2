from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from trajectories import Trajectory, TrajectoryError, point_to_point, summarise, warm_up
from trajectories.point_to_point import move_time_s, peak_speed_for_distance, peak_speed_for_time

velocities = st.floats(0.1, 500.0)
accelerations = st.floats(1.0, 5000.0)
jerks = st.floats(10.0, 1e6)
distances = st.floats(1e-9, 1000.0) | st.sampled_from([1e-12, 1e-6, 1e-3, 1.0])


def go(distance: float, velocity: float, acceleration: float, jerk: float) -> Trajectory:
    return point_to_point(
        0.0,
        distance,
        velocity_rad_s=velocity,
        acceleration_rad_s2=acceleration,
        jerk_rad_s3=jerk,
    )


@given(
    start=st.floats(-500.0, 500.0),
    distance=distances,
    direction=st.sampled_from([-1.0, 1.0]),
    velocity=velocities,
    acceleration=accelerations,
    jerk=jerks,
)
@settings(deadline=None)
def test_a_move_ends_where_it_should_within_its_bounds(
    start: float,
    distance: float,
    direction: float,
    velocity: float,
    acceleration: float,
    jerk: float,
) -> None:
    end = start + direction * distance
    trajectory = point_to_point(
        start, end, velocity_rad_s=velocity, acceleration_rad_s2=acceleration, jerk_rad_s3=jerk
    )
    assert trajectory.end_position_rad == pytest.approx(end, rel=1e-13, abs=1e-13 * distance)
    dry_run = summarise(trajectory)
    assert dry_run.peak_speed_rad_s <= velocity * (1.0 + 1e-9)
    assert dry_run.peak_acceleration_rad_s2 <= acceleration * (1.0 + 1e-9)
    assert dry_run.peak_jerk_rad_s3 <= jerk * (1.0 + 1e-9)
    assert dry_run.position_min_rad >= min(start, end) - 1e-9
    assert dry_run.position_max_rad <= max(start, end) + 1e-9
    exact = move_time_s(abs(end - start), velocity, acceleration, jerk)
    assert trajectory.duration_s == pytest.approx(exact, rel=1e-9)


def farthest(time_s: float, velocity: float, acceleration: float, jerk: float) -> float:
    """Return the farthest that any profile gets from rest to rest, jerk constant on 120 steps.

    A linear programme that knows nothing of ramps: maximise position over the jerks, subject to
    the bounds at every node.
    """
    steps = 120
    h = time_s / steps
    a = np.zeros((steps + 1, steps))  # rows: node; columns: the jerk's share in its state
    v, x = np.zeros_like(a), np.zeros_like(a)
    for k in range(steps):
        unit = np.eye(steps)[k]
        a[k + 1] = a[k] + h * unit
        v[k + 1] = v[k] + h * a[k] + 0.5 * h**2 * unit
        x[k + 1] = x[k] + h * v[k] + 0.5 * h**2 * a[k] + h**3 / 6.0 * unit
    result = linprog(
        -x[-1] / x[-1].max(),
        A_ub=np.vstack([a / acceleration, -a / acceleration, v / velocity]),
        b_ub=np.ones(3 * (steps + 1)),
        A_eq=np.vstack([a[-1] / acceleration, v[-1] / velocity]),
        b_eq=np.zeros(2),
        bounds=(-jerk, jerk),
    )
    assert result.success, result.message
    return float(x[-1] @ result.x)


@pytest.mark.parametrize(
    ("distance", "velocity", "acceleration", "jerk"),
    [
        (100.0, 100.0, 1000.0, 20_000.0),  # all seven parts
        (20.0, 200.0, 1000.0, 20_000.0),  # top speed not reached
        (3.0, 200.0, 1000.0, 20_000.0),  # nor the acceleration
        (30.0, 20.0, 1000.0, 5_000.0),  # top speed reached, the acceleration not
    ],
)
def test_no_profile_whatever_is_faster(
    distance: float, velocity: float, acceleration: float, jerk: float
) -> None:
    least_s = go(distance, velocity, acceleration, jerk).duration_s
    assert farthest(0.985 * least_s, velocity, acceleration, jerk) < distance
    assert farthest(1.015 * least_s, velocity, acceleration, jerk) > distance


@given(st.floats(1e-6, 1e3), accelerations, jerks)
@settings(deadline=None)
def test_the_two_peak_speeds_agree(distance: float, acceleration: float, jerk: float) -> None:
    peak = peak_speed_for_distance(distance, acceleration, jerk)
    time_s = move_time_s(distance, 2.0 * peak, acceleration, jerk)  # never at its top speed
    assert peak * 0.5 * time_s == pytest.approx(distance, rel=1e-9)
    assert peak_speed_for_time(time_s, acceleration, jerk) == pytest.approx(peak, rel=1e-9)


def test_the_parts_of_a_move() -> None:
    whole = go(-100.0, 100.0, 1000.0, 20_000.0)
    assert [s.phase for s in whole.segments] == ["ramp", "steady", "ramp"]
    assert whole.steady_windows()[0].velocity_rad_s == -100.0
    short = go(3.0, 100.0, 1000.0, 20_000.0)
    assert [s.phase for s in short.segments] == ["ramp", "ramp"]
    assert short.steady_windows() == ()


def test_rests_frame_a_move_and_no_distance_means_stay() -> None:
    bounds = {"velocity_rad_s": 1.0, "acceleration_rad_s2": 1.0, "jerk_rad_s3": 1.0}
    framed = point_to_point(1.0, 2.0, **bounds, rest_s=0.5)
    assert [s.phase for s in framed.segments][:: len(framed.segments) - 1] == ["rest", "rest"]
    stay = point_to_point(2.0, 2.0, **bounds)
    assert (stay.duration_s, stay.at(0.0).position_rad) == (0.0, 2.0)
    assert point_to_point(0.0, 5e-324, **bounds).segments == ()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"velocity_rad_s": 0.0}, "velocity_rad_s must be above zero, got 0"),
        ({"acceleration_rad_s2": -1.0}, "acceleration_rad_s2 must be above zero, got -1"),
        ({"jerk_rad_s3": math.nan}, "jerk_rad_s3 must be finite, got nan"),
        ({"rest_s": -1.0}, "rest_s must not be negative, got -1"),
        ({"to_rad": math.inf}, "to_rad must be finite, got inf"),
        ({"from_rad": None}, "from_rad must be a number, got None"),
        (
            {
                "to_rad": 1e200,
                "velocity_rad_s": 1e250,
                "acceleration_rad_s2": 1e200,
                "jerk_rad_s3": 1e300,
            },
            "velocity_end_rad_s must be finite, got nan",
        ),
    ],
)
def test_bad_arguments_of_a_move_are_refused(changes: dict[str, Any], sentence: str) -> None:
    arguments: dict[str, Any] = {
        "from_rad": 0.0,
        "to_rad": 1.0,
        "velocity_rad_s": 1.0,
        "acceleration_rad_s2": 1.0,
        "jerk_rad_s3": 1.0,
        **changes,
    }
    with pytest.raises(TrajectoryError) as caught:
        point_to_point(arguments.pop("from_rad"), arguments.pop("to_rad"), **arguments)
    assert sentence in str(caught.value)


def warm(**changes: Any) -> Trajectory:
    arguments: dict[str, Any] = {
        "from_rad": -100.0,
        "to_rad": 150.0,
        "duration_s": 60.0,
        "top_speed_rad_s": 200.0,
        "acceleration_rad_s2": 1000.0,
        "jerk_rad_s3": 20_000.0,
        **changes,
    }
    return warm_up(arguments.pop("from_rad"), arguments.pop("to_rad"), **arguments)


@given(
    duration=st.floats(0.5, 60.0),
    fraction=st.floats(0.05, 1.0),
    rest=st.floats(0.0, 0.2),
    end=st.floats(-400.0, -101.0) | st.floats(-99.0, 400.0),
)
@settings(deadline=None)
def test_a_warm_up_lasts_as_long_as_asked_and_keeps_speed_and_stroke(
    duration: float, fraction: float, rest: float, end: float
) -> None:
    trajectory = warm(duration_s=duration, fraction=fraction, rest_s=rest, to_rad=end)
    dry_run = summarise(trajectory)
    assert trajectory.duration_s == pytest.approx(duration, rel=1e-9)
    assert trajectory.end_position_rad == pytest.approx(-100.0, abs=1e-7)
    assert dry_run.peak_speed_rad_s <= 200.0 * fraction * (1.0 + 1e-9)
    assert dry_run.position_min_rad >= min(-100.0, end) - 1e-7
    assert dry_run.position_max_rad <= max(-100.0, end) + 1e-7


def test_a_long_warm_up_runs_at_its_speed_over_nearly_the_whole_stroke() -> None:
    trajectory = warm(fraction=0.25)
    dry_run = summarise(trajectory)
    assert dry_run.peak_speed_rad_s == pytest.approx(50.0)
    assert {w.velocity_rad_s for w in trajectory.steady_windows()} == {50.0, -50.0}
    assert dry_run.position_max_rad > 100.0
    # A duration of exactly so many round trips uses the stroke to its end.
    trip_s = 2.0 * (move_time_s(250.0, 50.0, 1000.0, 20_000.0) + 0.2)
    for trips in range(1, 30):
        fitting = warm(fraction=0.25, duration_s=trips * trip_s)
        assert len(fitting.steady_windows()) == 2 * trips
        assert summarise(fitting).position_max_rad == pytest.approx(150.0)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"to_rad": -100.0}, "a warm-up needs two positions, got -100 rad twice"),
        ({"fraction": 1.5}, "fraction must be at most 1, got 1.5"),
        ({"fraction": 0.0}, "fraction must be above zero, got 0"),
        ({"duration_s": 0.4}, "duration_s must exceed the rests of one round trip, 0.4 s"),
        ({"duration_s": 1e7}, "at most 10000 are made"),
        ({"duration_s": math.nan}, "duration_s must be finite, got nan"),
        ({"top_speed_rad_s": 0.0}, "top_speed_rad_s must be above zero, got 0"),
        ({"acceleration_rad_s2": 0.0}, "acceleration_rad_s2 must be above zero, got 0"),
        ({"jerk_rad_s3": 0.0}, "jerk_rad_s3 must be above zero, got 0"),
        ({"rest_s": -1.0}, "rest_s must not be negative, got -1"),
    ],
)
def test_bad_arguments_of_a_warm_up_are_refused(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(TrajectoryError) as caught:
        warm(**changes)
    assert sentence in str(caught.value)
