from __future__ import annotations

import copy
import dataclasses
import json
import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trajectories import Segment, SetPoint, Trajectory, TrajectoryError

BOUNDS = (800.0, 15_000.0)


@st.composite
def trajectories(draw: st.DrawFn) -> Trajectory:
    """Any walk through velocities, with dwells, transfers and rests, from rest to rest."""
    level = st.floats(-250.0, 250.0).map(lambda v: round(v, 3))
    length = st.floats(1e-3, 5.0)
    segments: list[Segment] = []
    velocity = 0.0
    for target in [*draw(st.lists(level, max_size=6)), 0.0]:
        if target != velocity:
            segments.append(Segment.ramp(velocity, target, *BOUNDS))
        velocity = target
        if draw(st.booleans()):
            kind = Segment.steady if draw(st.booleans()) else Segment.transfer
            hold = draw(length)
            segments.append(kind(velocity, hold) if velocity else Segment.rest(hold))
    values = st.floats(-1e6, 1e6) | st.integers() | st.booleans() | st.text(max_size=5)
    lists = st.lists(st.floats(-10.0, 10.0), max_size=3)
    parameters = draw(st.dictionaries(st.text(max_size=8), values | lists, max_size=4))
    return Trajectory("walk", parameters, draw(st.floats(-400.0, 400.0)), tuple(segments))  # type: ignore[arg-type]  # a value of a mixed mapping


def walk() -> Trajectory:
    return Trajectory(
        "walk",
        {"speeds_rad_s": (10.0, -20.0), "note": "by hand"},
        5.0,
        (
            Segment.rest(0.5),
            Segment.ramp(0.0, 10.0, *BOUNDS),
            Segment.steady(10.0, 1.0),
            Segment.ramp(10.0, -20.0, *BOUNDS),
            Segment.steady(-20.0, 0.5),
            Segment.ramp(-20.0, 0.0, *BOUNDS),
        ),
    )


@given(trajectories())
@settings(deadline=None)
def test_json_round_trip_is_the_identity(trajectory: Trajectory) -> None:
    text = json.dumps(trajectory.to_json(), allow_nan=False)
    back = Trajectory.from_json(json.loads(text))
    assert back == trajectory
    assert back.pieces == trajectory.pieces
    assert json.dumps(back.to_json()) == text


@given(trajectories())
@settings(deadline=None)
def test_position_and_velocity_are_continuous_everywhere(trajectory: Trajectory) -> None:
    for piece in trajectory.pieces:
        for instant in (piece.start_s, piece.start_s + piece.duration_s):
            before, after = (
                trajectory.at(math.nextafter(instant, side)) for side in (-math.inf, math.inf)
            )
            assert before.position_rad == pytest.approx(after.position_rad, abs=1e-8)
            assert before.velocity_rad_s == pytest.approx(after.velocity_rad_s, abs=1e-8)
            assert before.acceleration_rad_s2 == pytest.approx(after.acceleration_rad_s2, abs=1e-6)


@given(trajectories())
@settings(deadline=None)
def test_sampling_says_the_same_as_asking_one_by_one(trajectory: Trajectory) -> None:
    times = np.linspace(-1.0, trajectory.duration_s + 1.0, 97)
    sampled = trajectory.sample(times)
    one_by_one = [trajectory.at(t) for t in times.tolist()]
    for n, t in enumerate(times):
        assert sampled.time_s[n] == t
        assert one_by_one[n] == SetPoint(
            float(sampled.position_rad[n]),
            float(sampled.velocity_rad_s[n]),
            float(sampled.acceleration_rad_s2[n]),
            str(sampled.phase[n]),  # type: ignore[arg-type]  # a value of a mixed mapping
        )


@given(trajectories())
@settings(deadline=None)
def test_reversing_runs_the_path_backward_in_time(trajectory: Trajectory) -> None:
    back = trajectory.reversed()
    total = trajectory.duration_s
    assert back.duration_s == pytest.approx(total)
    assert back.start_position_rad == trajectory.end_position_rad
    for t in np.linspace(0.0, total, 23).tolist():
        assert back.at(total - t).position_rad == pytest.approx(
            trajectory.at(t).position_rad, abs=1e-8
        )
        assert back.at(total - t).velocity_rad_s == pytest.approx(
            -trajectory.at(t).velocity_rad_s, abs=1e-6
        )
    again = back.reversed()
    assert again.segments == trajectory.segments
    assert again.start_position_rad == pytest.approx(trajectory.start_position_rad, abs=1e-9)


@given(trajectories())
@settings(deadline=None)
def test_reversing_keeps_every_steady_window_at_its_positions(trajectory: Trajectory) -> None:
    windows = trajectory.position_windows()
    mirrored = trajectory.reversed().position_windows()
    assert len(windows) == len(mirrored)
    for there, back in zip(windows, reversed(mirrored), strict=True):
        assert back.velocity_rad_s == -there.velocity_rad_s
        assert back.low_rad == pytest.approx(there.low_rad, abs=1e-9)
        assert back.high_rad == pytest.approx(there.high_rad, abs=1e-9)


def test_reversed_is_noted_among_the_parameters_once() -> None:
    forward = walk()
    back = forward.reversed()
    assert back.name == "walk"
    assert back.parameters["reversed"] is True
    assert dict(back.reversed().parameters) == dict(forward.parameters)


def test_set_points_by_hand() -> None:
    trajectory = walk()
    assert trajectory.at(0.25) == SetPoint(5.0, 0.0, 0.0, "rest")
    ramp = trajectory.segments[1]
    middle = trajectory.at(0.5 + 0.5 * ramp.duration_s)
    assert middle.velocity_rad_s == pytest.approx(5.0)
    assert middle.phase == "ramp"
    dwell = trajectory.at(0.5 + ramp.duration_s + 0.5)
    assert dwell == pytest.approx((5.0 + ramp.displacement_rad + 5.0, 10.0, 0.0, "steady"))
    start, end, velocity = trajectory.steady_windows()[0]
    assert (start, end) == pytest.approx((0.5 + ramp.duration_s, 1.5 + ramp.duration_s))
    assert velocity == 10.0
    low, high, velocity = trajectory.position_windows()[1]
    assert high - low == pytest.approx(10.0)
    assert velocity == -20.0


def test_the_first_and_last_state_hold_outside_and_nan_stays_nan() -> None:
    trajectory = walk()
    end = SetPoint(trajectory.end_position_rad, 0.0, 0.0, "rest")
    assert trajectory.at(-3.0) == SetPoint(5.0, 0.0, 0.0, "rest")
    assert trajectory.at(trajectory.duration_s) == end
    assert trajectory.at(1e6) == end
    lost = trajectory.at(math.nan)
    assert math.isnan(lost.position_rad)
    assert math.isnan(lost.velocity_rad_s)
    assert np.isnan(trajectory.sample([math.nan]).velocity_rad_s).all()


def test_no_segments_means_stay() -> None:
    stay = Trajectory("stay", {}, 3.0, ())
    assert stay.duration_s == 0.0
    assert stay.at(0.0) == SetPoint(3.0, 0.0, 0.0, "rest")
    assert Trajectory.from_json(stay.to_json()) == stay
    assert stay.reversed().segments == ()


def test_a_trajectory_is_frozen_through_and_through() -> None:
    speeds = [1.0, 2.0]
    given_parameters: dict[str, Any] = {"speeds_rad_s": speeds}
    trajectory = Trajectory("stay", given_parameters, 0.0, ())
    speeds.append(3.0)
    given_parameters["more"] = 1.0
    assert dict(trajectory.parameters) == {"speeds_rad_s": (1.0, 2.0)}
    with pytest.raises(TypeError):
        trajectory.parameters["more"] = 1.0  # type: ignore[index]  # frozen: refused
    with pytest.raises(dataclasses.FrozenInstanceError):
        trajectory.name = "go"  # type: ignore[misc]  # frozen: refused


def test_a_trajectory_travels_between_processes_and_into_sets() -> None:
    trajectory = walk()
    twin = pickle.loads(pickle.dumps(trajectory))
    assert twin == trajectory == copy.deepcopy(trajectory)
    assert twin.at(1.0) == trajectory.at(1.0)
    assert len({trajectory, twin}) == 1


@pytest.mark.parametrize(
    ("name", "parameters", "start", "segments", "sentence"),
    [
        (" ", {}, 0.0, (), "name must be a word, got ' '"),
        ("go", [], 0.0, (), "parameters must be a mapping, got []"),
        ("go", {1: 1.0}, 0.0, (), "a parameter's name must be text, got 1"),
        ("go", {"a": None}, 0.0, (), "parameter a must be a number, got None"),
        ("go", {"a": math.inf}, 0.0, (), "parameter a must be finite, got inf"),
        ("go", {"a": (1.0, math.nan)}, 0.0, (), "parameter a[1] must be finite, got nan"),
        ("go", {}, math.nan, (), "start_position_rad must be finite, got nan"),
        ("go", {}, 0.0, ("x",), "segment 1 must be a Segment, got 'x'"),
        (
            "go",
            {},
            0.0,
            (Segment.steady(1.0, 1.0),),
            "the trajectory starts at rest, but segment 1 begins with 1 rad/s",
        ),
        (
            "go",
            {},
            0.0,
            (Segment.rest(1.0), Segment.steady(2.0, 1.0)),
            "segment 1 ends with 0 rad/s, but segment 2 begins with 2 rad/s",
        ),
        (
            "go",
            {},
            0.0,
            (Segment.ramp(0.0, 2.0, *BOUNDS),),
            "must end at rest; segment 1, the last, ends with 2 rad/s",
        ),
        ("go", {}, 0.0, (Segment.rest(1e308), Segment.rest(1e308)), "must stay finite"),
    ],
)
def test_what_is_not_a_motion_is_refused(
    name: Any, parameters: Any, start: float, segments: Any, sentence: str
) -> None:
    with pytest.raises(TrajectoryError) as caught:
        Trajectory(name, parameters, start, segments)
    assert sentence in str(caught.value)


def _without(document: dict[str, Any], key: str) -> dict[str, Any]:
    return {k: v for k, v in document.items() if k != key}


@pytest.mark.parametrize("key", ["name", "parameters", "start_position_rad", "segments"])
def test_a_document_without_one_of_its_keys_is_refused(key: str) -> None:
    with pytest.raises(TrajectoryError, match=f"a trajectory lacks {key}"):
        Trajectory.from_json(_without(walk().to_json(), key))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"schema": "stribeck.trajectory/2"}, "expected schema 'stribeck.trajectory/1', got"),
        ({"spin": 1}, "a trajectory has unknown keys: spin (known: schema"),
        ({"segments": {}}, "segments must be a list, got {}"),
        ({"segments": [3]}, "segment 1 must be a JSON object, got 3"),
        ({"segments": [{"phase": "rest"}]}, "segment 1 lacks duration_s"),
        ({"start_position_rad": None}, "start_position_rad must be a number, got None"),
        ({"start_position_rad": "0"}, "start_position_rad must be a number, got '0'"),
        ({"name": 7}, "name must be a word, got 7"),
        ({"parameters": {"a": {}}}, "parameter a must be a number, got {}"),
    ],
)
def test_a_document_that_is_wrong_somewhere_is_refused_with_the_place(
    change: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(TrajectoryError) as caught:
        Trajectory.from_json({**walk().to_json(), **change})
    assert sentence in str(caught.value)


def test_a_bad_segment_in_a_document_is_named_by_its_number() -> None:
    document = walk().to_json()
    document["segments"][2]["duration_s"] = -1
    with pytest.raises(TrajectoryError, match="segment 3: duration_s must be above zero, got -1"):
        Trajectory.from_json(document)
    document["segments"][2]["duration_s"] = 1
    document["segments"][2]["jerk"] = 1
    with pytest.raises(TrajectoryError, match="segment 3 has unknown keys: jerk"):
        Trajectory.from_json(document)


@pytest.mark.parametrize("document", [None, [], "x", 3])
def test_what_is_not_an_object_is_refused(document: object) -> None:
    with pytest.raises(TrajectoryError, match="a trajectory must be a JSON object"):
        Trajectory.from_json(document)
    with pytest.raises(ValueError, match="JSON object"):  # callers may catch the built-in
        Trajectory.from_json(document)
