from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from trajectories import (
    PositionWindow,
    Trajectory,
    TrajectoryError,
    arm_deg,
    motor_rad,
    spaced_speeds,
    stair_between,
    stair_paired,
    summarise,
)
from trajectories.speeds import crossing

GEAR_RATIO = 224.0
LOW_RAD, HIGH_RAD = motor_rad(-50.0, GEAR_RATIO), motor_rad(50.0, GEAR_RATIO)
BOUNDS: dict[str, Any] = {"acceleration_rad_s2": 1000.0, "jerk_rad_s3": 20_000.0}
accelerations = st.floats(600.0, 2000.0)
jerks = st.floats(5_000.0, 200_000.0)


def dwells(trajectory: Trajectory) -> list[float]:
    return [end - start for start, end, _ in trajectory.steady_windows()]


def assert_paired(windows: Sequence[PositionWindow]) -> None:
    """Every velocity has its opposite over the same positions, and nothing is left over."""
    by_velocity = {w.velocity_rad_s: w for w in windows}
    assert len(by_velocity) == len(windows)
    for window in windows:
        mirror = by_velocity[-window.velocity_rad_s]
        assert mirror.low_rad == pytest.approx(window.low_rad, abs=1e-8)
        assert mirror.high_rad == pytest.approx(window.high_rad, abs=1e-8)


def assert_within(trajectory: Trajectory, acceleration: float, jerk: float) -> None:
    for piece in trajectory.pieces:
        ends = (0.0, piece.duration_s)
        peak = max(abs(piece.acceleration_rad_s2 + d * piece.jerk_rad_s3) for d in ends)
        assert peak <= acceleration * (1.0 + 1e-9)
        assert abs(piece.jerk_rad_s3) <= jerk * (1.0 + 1e-9)


def refusal(make: Callable[[], Trajectory]) -> str:
    with pytest.raises(TrajectoryError) as caught:
        make()
    return str(caught.value)


# --- the stair between two positions (thesis 4.1.1) ------------------------------------------


def test_the_thesis_stair_goes_from_end_to_end_through_20_velocities_in_40_s() -> None:
    stair = stair_between(LOW_RAD, HIGH_RAD, duration_s=40.0, **BOUNDS)
    dry_run = summarise(stair, gear_ratio=GEAR_RATIO)
    assert stair.duration_s == pytest.approx(40.0, abs=1e-9)
    assert dry_run.steady_velocities == 20
    assert (dry_run.arm_min_deg, dry_run.arm_max_deg) == pytest.approx((-50.0, 50.0), abs=1e-9)
    assert stair.end_position_rad == pytest.approx(LOW_RAD, abs=1e-9)
    out = [v for _, _, v in stair.steady_windows()[:10]]
    np.testing.assert_allclose(np.diff(out), out[0])  # ascending, evenly
    assert [v for _, _, v in stair.steady_windows()[10:]] == [-v for v in reversed(out)]
    assert max(dwells(stair)) - min(dwells(stair)) < 1e-9


@given(
    start=st.floats(-300.0, 300.0),
    stroke=st.floats(20.0, 600.0),
    direction=st.sampled_from([-1.0, 1.0]),
    duration=st.floats(20.0, 90.0),
    steps=st.integers(1, 14),
    acceleration=accelerations,
    jerk=jerks,
)
@settings(deadline=None)
def test_a_scaled_stair_meets_stroke_and_duration_and_is_paired(
    start: float,
    stroke: float,
    direction: float,
    duration: float,
    steps: int,
    acceleration: float,
    jerk: float,
) -> None:
    end = start + direction * stroke
    stair = stair_between(
        start,
        end,
        duration_s=duration,
        acceleration_rad_s2=acceleration,
        jerk_rad_s3=jerk,
        steps=steps,
    )
    assert stair.duration_s == pytest.approx(duration, abs=1e-8)
    dry_run = summarise(stair)
    reached = (dry_run.position_min_rad, dry_run.position_max_rad)
    assert reached == pytest.approx((min(start, end), max(start, end)), abs=1e-7)
    assert len(stair.steady_windows()) == 2 * steps
    assert math.copysign(1.0, stair.steady_windows()[0].velocity_rad_s) == direction
    assert min(dwells(stair)) >= 0.2 - 1e-9
    assert_paired(stair.position_windows())
    assert_within(stair, acceleration, jerk)


@given(
    slowest=st.floats(0.5, 8.0),
    fastest=st.floats(60.0, 220.0),
    count=st.integers(2, 12),
    share=st.floats(0.02, 0.98),
    acceleration=accelerations,
    jerk=jerks,
)
@settings(deadline=None)
def test_given_speeds_are_kept_whatever_the_duration_between_its_ends(
    slowest: float, fastest: float, count: int, share: float, acceleration: float, jerk: float
) -> None:
    speeds = spaced_speeds(slowest, fastest, count)

    def make(duration: float) -> Trajectory:
        return stair_between(
            LOW_RAD,
            HIGH_RAD,
            duration_s=duration,
            speeds_rad_s=speeds,
            acceleration_rad_s2=acceleration,
            jerk_rad_s3=jerk,
            dwell_min_s=0.1,
        )

    try:
        stair = make(1.6)  # too short for any: the refusal says between which ends it may lie
    except TrajectoryError as error:
        assume("lasts between" in str(error))
        words = str(error).split("lasts between ")[1].split()
        shortest, longest = float(words[0]), float(words[3])
    else:
        pytest.fail(f"expected a refusal, got {stair.duration_s} s")
    duration = shortest + share * (longest - shortest)
    stair = make(duration)
    assert stair.duration_s == pytest.approx(duration, abs=1e-6)
    assert tuple(v for _, _, v in stair.steady_windows()[:count]) == speeds
    dry_run = summarise(stair)
    assert dry_run.position_min_rad == pytest.approx(LOW_RAD, abs=1e-6)
    assert dry_run.position_max_rad == pytest.approx(HIGH_RAD, abs=1e-6)
    assert min(dwells(stair)) >= 0.1
    assert_paired(stair.position_windows())
    assert_within(stair, acceleration, jerk)
    for bad in (shortest - 0.01, longest + 0.01):
        assert "lasts between" in refusal(lambda bad=bad: make(bad))  # type: ignore[misc]  # bound in the loop


def test_the_durations_that_a_refusal_names_are_the_ends_of_what_can_be_met() -> None:
    def make(duration: float) -> Trajectory:
        speeds = spaced_speeds(2.0, 200.0, 10)
        return stair_between(LOW_RAD, HIGH_RAD, duration_s=duration, speeds_rad_s=speeds, **BOUNDS)

    words = refusal(lambda: make(3.0)).split("lasts between ")[1].split()
    shortest, longest = float(words[0]), float(words[3])
    for duration in (shortest + 0.05, 0.5 * (shortest + longest), longest - 0.05):
        stair = make(duration)
        assert stair.duration_s == pytest.approx(duration, abs=1e-6)
        assert summarise(stair).position_max_rad == pytest.approx(HIGH_RAD, abs=1e-6)
        assert min(dwells(stair)) >= 0.2
    for duration in (shortest - 0.002, longest + 0.002):
        assert "lasts between" in refusal(lambda d=duration: make(d))  # type: ignore[misc]  # bound in the loop


def test_given_speeds_can_be_a_pattern_and_are_climbed_in_rising_order() -> None:
    stair = stair_between(
        LOW_RAD,
        HIGH_RAD,
        duration_s=40.0,
        speeds_rad_s=(4.0, 1.0, 2.0),
        scale_speeds=True,
        **BOUNDS,
    )
    slow, middle, fast = (v for _, _, v in stair.steady_windows()[:3])
    assert (middle / slow, fast / slow) == pytest.approx((2.0, 4.0))
    assert max(dwells(stair)) - min(dwells(stair)) < 1e-9


def test_a_stair_downward_starts_downward() -> None:
    stair = stair_between(HIGH_RAD, LOW_RAD, duration_s=40.0, **BOUNDS)
    assert stair.start_position_rad == HIGH_RAD
    assert stair.steady_windows()[0].velocity_rad_s < 0.0
    assert_paired(stair.position_windows())


def test_the_duration_that_a_refusal_asks_for_is_enough_and_no_less_is() -> None:
    def make(duration: float) -> Trajectory:
        return stair_between(LOW_RAD, HIGH_RAD, duration_s=duration, **BOUNDS)

    sentence = refusal(lambda: make(5.0))
    needed = float(sentence.split("at least ")[2].split()[0])
    assert "a stair of 10 speeds over 390.954 rad, each held for at least 0.2 s" in sentence
    assert "got 5 s" in sentence
    assert make(needed + 0.002).duration_s == pytest.approx(needed + 0.002)
    assert f"{needed:.3f} s" in refusal(lambda: make(needed - 0.002))
    assert f"{needed:.3f} s" in refusal(lambda: make(1.0))  # not even the rests


# --- the paired stair (thesis 4.4.1) -----------------------------------------------------------


def paired(**changes: Any) -> Trajectory:
    arguments: dict[str, Any] = {
        "speeds_rad_s": spaced_speeds(2.0, 200.0, 11),
        "duration_s": 40.0,
        **BOUNDS,
        **changes,
    }
    return stair_paired(LOW_RAD, HIGH_RAD, **arguments)


@pytest.mark.parametrize("acceleration", [600.0, 1000.0, 2000.0])
def test_the_thesis_stair_of_22_velocities_fits_100_degrees_and_40_s(acceleration: float) -> None:
    stair = paired(acceleration_rad_s2=acceleration)
    dry_run = summarise(stair, gear_ratio=GEAR_RATIO)
    assert stair.duration_s == pytest.approx(40.0, abs=1e-9)
    assert dry_run.steady_velocities == 22
    assert dry_run.arm_min_deg is not None
    assert dry_run.arm_max_deg is not None
    assert dry_run.arm_min_deg >= -50.0 - 1e-9
    assert dry_run.arm_max_deg <= 50.0 + 1e-9
    assert dry_run.peak_speed_rad_s == pytest.approx(200.0)  # transfers keep to it as well
    assert dry_run.shortest_dwell_s is not None
    assert dry_run.shortest_dwell_s > 1.0


@st.composite
def paired_cases(draw: st.DrawFn) -> tuple[Trajectory, float, float, float]:
    low = draw(st.floats(-300.0, 0.0))
    high = low + draw(st.floats(100.0, 500.0))
    centre = low + draw(st.floats(0.25, 0.75)) * (high - low)
    room = min(centre - low, high - centre)
    acceleration, jerk = draw(accelerations), draw(jerks)
    # A speed whose ramps take a third of the room, so that it can be held.
    fastest = min(0.5 * math.sqrt(acceleration * room), 0.2 * (jerk * room * room) ** (1 / 3))
    count = draw(st.integers(2, 12))
    speeds = draw(st.permutations(spaced_speeds(1.0, fastest, count)))
    duration = draw(st.floats(30.0, 120.0))
    ends = (low, high) if draw(st.booleans()) else (high, low)
    stair = stair_paired(
        *ends,
        speeds_rad_s=speeds,
        duration_s=duration,
        acceleration_rad_s2=acceleration,
        jerk_rad_s3=jerk,
        validation_position_rad=centre,
        dwell_min_s=0.05,
    )
    return stair, centre, low, high


# Two speeds, both cut by the stroke: 105 s cannot be used up.
SHORT_OF_ROOM = stair_paired(
    100.0,
    0.0,
    speeds_rad_s=(1.0, 29.240177382128657),
    duration_s=105.0,
    acceleration_rad_s2=600.0,
    jerk_rad_s3=5000.0,
    validation_position_rad=25.0,
    dwell_min_s=0.05,
)


@given(paired_cases())
@example((SHORT_OF_ROOM, 25.0, 0.0, 100.0))
@settings(deadline=None)
def test_paired_windows_are_the_same_and_centred_within_stroke_and_time(
    case: tuple[Trajectory, float, float, float],
) -> None:
    stair, centre, low, high = case
    parameters = stair.parameters
    windows = stair.position_windows()
    assert_paired(windows)
    for window in windows:
        assert 0.5 * (window.low_rad + window.high_rad) == pytest.approx(centre, abs=1e-8)
    for forward, backward in zip(windows[::2], windows[1::2], strict=True):
        assert backward.velocity_rad_s == -forward.velocity_rad_s
    dry_run = summarise(stair)
    assert dry_run.position_min_rad >= low - 1e-8
    assert dry_run.position_max_rad <= high + 1e-8
    assert_within(
        stair,
        float(parameters["acceleration_rad_s2"]),  # type: ignore[arg-type]  # a value of a mixed mapping
        float(parameters["jerk_rad_s3"]),  # type: ignore[arg-type]  # a value of a mixed mapping
    )
    # Every dwell is the common one, or ends where the stroke does.
    common = max(dwells(stair))
    room = min(centre - low, high - centre)
    index = [n for n, s in enumerate(stair.segments) if s.phase == "steady"]
    cuts = []
    for n in index:
        ramp, dwell = stair.segments[n - 1], stair.segments[n]
        half = abs(0.5 * dwell.displacement_rad) + abs(ramp.displacement_rad)
        cuts.append(half == pytest.approx(room, abs=1e-8))
        assert cuts[-1] or dwell.duration_s == pytest.approx(common, abs=1e-9)
    # The time is used up, unless the stroke ends every dwell before.
    asked_s = float(parameters["duration_s"])  # type: ignore[arg-type]  # a value of a mixed mapping
    if all(cuts):
        assert stair.duration_s <= asked_s + 1e-6
    else:
        assert stair.duration_s == pytest.approx(asked_s, abs=1e-6)


def test_fast_passes_are_cut_by_the_stroke_and_slow_ones_by_the_time() -> None:
    stair = paired(duration_s=60.0)
    lengths = dwells(stair)[::2]
    assert stair.duration_s == pytest.approx(60.0, abs=1e-9)
    assert lengths[-1] < lengths[0] - 0.3
    assert lengths[:-1] == pytest.approx([lengths[0]] * 10, abs=1e-9)
    fast = stair.position_windows()[-1]
    assert fast.high_rad < HIGH_RAD
    assert summarise(stair).position_max_rad == pytest.approx(HIGH_RAD, abs=1e-9)


def test_a_budget_that_the_stroke_cannot_fill_is_not_filled() -> None:
    stair = paired(speeds_rad_s=(100.0, 200.0), duration_s=3600.0)
    assert stair.duration_s < 30.0
    half_strokes = [abs(s.duration_s) for s in stair.segments if s.phase == "steady"]
    assert half_strokes[0] > half_strokes[-1]
    # Both speeds start at the end of the stroke: nothing is to be moved between them.
    assert sum(1 for s in stair.segments if s.phase == "ramp") == 8


def test_a_top_speed_out_of_reach_is_refused_with_the_one_that_is_not() -> None:
    sentence = refusal(lambda: paired(speeds_rad_s=(10.0, 700.0)))
    assert sentence.startswith("to reach 700 rad/s and hold it for 0.2 s a pass needs ")
    assert "and there are 390.95 rad" in sentence
    reachable = float(sentence.split("at most ")[1].split()[0])
    assert paired(speeds_rad_s=(10.0, reachable - 0.01)).duration_s <= 40.0 + 1e-9
    assert "a pass needs" in refusal(lambda: paired(speeds_rad_s=(10.0, reachable + 0.01)))


def test_a_duration_too_short_is_refused_with_the_one_that_is_enough() -> None:
    sentence = refusal(lambda: paired(duration_s=9.0))
    assert "11 speeds, each passed twice and held for at least 0.2 s" in sentence
    needed = float(sentence.split("a duration of at least ")[1].split()[0])
    assert min(dwells(paired(duration_s=needed + 0.001))) >= 0.2
    assert f"{needed:.3f} s" in refusal(lambda: paired(duration_s=needed - 0.001))


# --- arguments ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"speeds_rad_s": ()}, "speeds_rad_s must hold at least one speed, got none"),
        ({"speeds_rad_s": "fast"}, "speeds_rad_s must be a sequence of speeds, got 'fast'"),
        ({"speeds_rad_s": (1.0, 0.0)}, "speeds_rad_s[1] must be above zero, got 0"),
        ({"speeds_rad_s": (2.0, 2.0)}, "speeds_rad_s must not repeat a speed"),
        ({"speeds_rad_s": (2.0, math.nan)}, "speeds_rad_s[1] must be finite, got nan"),
        ({"duration_s": 0.0}, "duration_s must be above zero, got 0"),
        ({"acceleration_rad_s2": -1.0}, "acceleration_rad_s2 must be above zero, got -1"),
        ({"jerk_rad_s3": math.inf}, "jerk_rad_s3 must be finite, got inf"),
        ({"dwell_min_s": 0.0}, "dwell_min_s must be above zero, got 0"),
        ({"rest_s": -0.1}, "rest_s must not be negative, got -0.1"),
        ({"validation_position_rad": 200.0}, "must lie between -195.477 and 195.477 rad, got 200"),
        ({"validation_position_rad": LOW_RAD}, "must lie between -195.477 and 195.477 rad"),
        ({"validation_position_rad": math.nan}, "validation_position_rad must be finite, got nan"),
    ],
)
def test_bad_arguments_of_the_paired_stair_are_refused(
    changes: dict[str, Any], sentence: str
) -> None:
    assert sentence in refusal(lambda: paired(**changes))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"to_rad": LOW_RAD}, "a stair needs two positions"),
        ({"from_rad": math.nan}, "from_rad must be finite, got nan"),
        ({"steps": 0}, "steps must be a whole number of at least 1, got 0"),
        ({"steps": 2.5}, "steps must be a whole number of at least 1, got 2.5"),
        ({"duration_s": math.nan}, "duration_s must be finite, got nan"),
        ({"rest_s": -1.0}, "rest_s must not be negative, got -1"),
        ({"speeds_rad_s": (2.0, -3.0)}, "speeds_rad_s[1] must be above zero, got -3"),
        ({"speeds_rad_s": (2.0, 900.0)}, "needs a stroke of more than"),
        ({"speeds_rad_s": (20.0,)}, "(both excluded), got 40 s; change the duration or the speeds"),
    ],
)
def test_bad_arguments_of_the_stair_between_are_refused(
    changes: dict[str, Any], sentence: str
) -> None:
    arguments: dict[str, Any] = {
        "from_rad": LOW_RAD,
        "to_rad": HIGH_RAD,
        "duration_s": 40.0,
        **BOUNDS,
        **changes,
    }
    start, end = arguments.pop("from_rad"), arguments.pop("to_rad")
    assert sentence in refusal(lambda: stair_between(start, end, **arguments))


# --- speeds and angles ------------------------------------------------------------------------


def test_spaced_speeds_hold_their_ends_and_their_spacing() -> None:
    geometric = np.array(spaced_speeds(2.0, 200.0, 11))
    assert (geometric[0], geometric[-1]) == (2.0, 200.0)
    np.testing.assert_allclose(geometric[1:] / geometric[:-1], 100.0**0.1)
    np.testing.assert_allclose(np.diff(spaced_speeds(2.0, 200.0, 12, "linear")), 18.0)
    assert spaced_speeds(5.0, 5.0, 1) == (5.0,)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((2.0, 1.0, 3), "slowest_rad_s must lie below fastest_rad_s"),
        ((2.0, 2.0, 3), "slowest_rad_s must lie below fastest_rad_s"),
        ((1.0, 2.0, 1), "and equal it for a single speed; got 1 and 2 for 1"),
        ((0.0, 2.0, 3), "slowest_rad_s must be above zero, got 0"),
        ((1.0, 2.0, True), "count must be a whole number of at least 1, got True"),
        ((1.0, 2.0, 3, "odd"), "spacing must be geometric or linear, got 'odd'"),
    ],
)
def test_speeds_that_cannot_be_spaced_are_refused(
    arguments: tuple[Any, ...], sentence: str
) -> None:
    with pytest.raises(TrajectoryError) as caught:
        spaced_speeds(*arguments)
    assert sentence in str(caught.value)


@given(st.floats(-1e3, 1e3), st.floats(1e-3, 1e3))
@settings(deadline=None)
def test_crossing_finds_a_root_to_the_last_bits(root: float, slope: float) -> None:
    found = crossing(lambda x: slope * (x - root), -1e4, 1e4)
    assert found == pytest.approx(root, rel=1e-15, abs=1e-300)


def test_arm_degrees_and_motor_radians() -> None:
    assert motor_rad(180.0, 100.0) == pytest.approx(100.0 * math.pi)
    assert arm_deg(motor_rad(-37.0, GEAR_RATIO), GEAR_RATIO) == pytest.approx(-37.0)
    stroke_rad = HIGH_RAD - LOW_RAD
    assert stroke_rad == pytest.approx(390.95, abs=0.01)
    with pytest.raises(TrajectoryError, match="gear_ratio must be above zero, got 0"):
        motor_rad(1.0, 0.0)
    with pytest.raises(TrajectoryError, match="angle_arm_deg must be finite"):
        motor_rad(math.nan, 1.0)
