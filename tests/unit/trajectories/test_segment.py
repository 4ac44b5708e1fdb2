from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from trajectories import Segment, TrajectoryError
from trajectories.segment import ramp_times_s

speeds = st.floats(-500.0, 500.0).map(lambda v: round(v, 6))
accelerations = st.floats(0.1, 1e5)
jerks = st.floats(0.1, 1e8)


@st.composite
def ramps(draw: st.DrawFn) -> tuple[Segment, float, float]:
    start, end = draw(speeds), draw(speeds)
    assume(start != end)
    acceleration, jerk = draw(accelerations), draw(jerks)
    return Segment.ramp(start, end, acceleration, jerk), acceleration, jerk


@given(ramps())
@settings(deadline=None)
def test_a_ramp_respects_its_bounds_and_uses_one_of_them_up(
    case: tuple[Segment, float, float],
) -> None:
    ramp, acceleration, jerk = case
    times = np.linspace(0.0, ramp.duration_s, 301)
    reached = np.array([ramp.acceleration_rad_s2(t) for t in times.tolist()])
    assert np.max(np.abs(reached)) <= acceleration * (1.0 + 1e-9)
    slopes = np.diff(reached) / np.diff(times)
    assert np.max(np.abs(slopes)) <= jerk * (1.0 + 1e-6)
    # Jerk at its bound throughout the bends; the acceleration's bound where it holds.
    assert abs(ramp.jerk_rad_s3) == pytest.approx(jerk, rel=1e-9)
    if len(ramp.pieces()) == 3:
        assert abs(ramp.peak_acceleration_rad_s2) == pytest.approx(acceleration, rel=1e-9)


@given(ramps())
@settings(deadline=None)
def test_a_ramp_integrates_exactly(case: tuple[Segment, float, float]) -> None:
    ramp, _, _ = case
    # Three-point Gauss is exact for the polynomials of one piece: an independent integral.
    nodes, weights = np.polynomial.legendre.leggauss(3)
    position, velocity = 0.0, ramp.velocity_start_rad_s
    for piece in ramp.pieces():
        inner = piece.start_s + 0.5 * piece.duration_s * (nodes + 1.0)
        scale = 0.5 * piece.duration_s * weights
        assert ramp.position_rad(piece.start_s) == pytest.approx(position, rel=1e-9, abs=1e-9)
        assert ramp.velocity_rad_s(piece.start_s) == pytest.approx(velocity, rel=1e-9, abs=1e-9)
        position += float(scale @ [ramp.velocity_rad_s(t) for t in inner.tolist()])
        velocity += float(scale @ [ramp.acceleration_rad_s2(t) for t in inner.tolist()])
    scale_rad = 500.0 * ramp.duration_s
    assert ramp.displacement_rad == pytest.approx(position, rel=1e-9, abs=1e-12 * scale_rad)
    assert ramp.position_rad(ramp.duration_s) == pytest.approx(
        position, rel=1e-9, abs=1e-12 * scale_rad
    )
    assert ramp.velocity_rad_s(ramp.duration_s) == pytest.approx(velocity, rel=1e-9, abs=1e-9)
    assert velocity == pytest.approx(ramp.velocity_end_rad_s, rel=1e-9, abs=1e-9)


@given(ramps(), st.floats(0.0, 1.0))
@settings(deadline=None)
def test_velocity_between_the_ends_is_monotone_and_symmetric_about_the_middle(
    case: tuple[Segment, float, float], share: float
) -> None:
    ramp, _, _ = case
    t = share * ramp.duration_s
    both = ramp.velocity_rad_s(t) + ramp.velocity_rad_s(ramp.duration_s - t)
    ends = ramp.velocity_start_rad_s + ramp.velocity_end_rad_s
    assert both == pytest.approx(ends, rel=1e-9, abs=1e-7)
    low, high = sorted((ramp.velocity_start_rad_s, ramp.velocity_end_rad_s))
    assert low - 1e-9 <= ramp.velocity_rad_s(t) <= high + 1e-9


@given(ramps())
@settings(deadline=None)
def test_reversing_twice_gives_the_same_segment_and_once_the_opposite_path(
    case: tuple[Segment, float, float],
) -> None:
    ramp, _, _ = case
    back = ramp.reversed()
    assert back.reversed() == ramp
    assert back.displacement_rad == -ramp.displacement_rad
    t = 0.3 * ramp.duration_s
    assert back.velocity_rad_s(t) == pytest.approx(
        -ramp.velocity_rad_s(ramp.duration_s - t), rel=1e-9, abs=1e-7
    )


def test_the_least_time_of_a_ramp_by_hand() -> None:
    # 200 rad/s at 1000 rad/s^2, 20 000 rad/s^3: 0.05 s of jerk at either end, 0.25 s in all.
    assert ramp_times_s(-200.0, 1000.0, 20_000.0) == pytest.approx((0.25, 0.05))
    # 8 rad/s never get beyond 400 rad/s^2: two bends of 20 ms.
    assert ramp_times_s(8.0, 1000.0, 20_000.0) == pytest.approx((0.04, 0.02))
    assert ramp_times_s(0.0, 1000.0, 20_000.0) == (0.0, 0.0)
    assert len(Segment.ramp(0.0, 8.0, 1000.0, 20_000.0).pieces()) == 2


def test_a_dwell_and_a_rest() -> None:
    dwell = Segment.steady(-3.0, 2.0)
    assert dwell.displacement_rad == -6.0
    assert dwell.position_rad(0.5) == -1.5
    assert dwell.position_rad(99.0) == -6.0  # clipped into the segment
    assert (dwell.acceleration_rad_s2(1.0), dwell.jerk_rad_s3) == (0.0, 0.0)
    rest = Segment.rest(1.0)
    assert (rest.velocity_rad_s(0.5), rest.displacement_rad) == (0.0, 0.0)
    assert math.copysign(1.0, rest.reversed().velocity_start_rad_s) == 1.0  # no minus zero
    assert Segment.transfer(5.0, 1.0).phase == "ramp"


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (("crawl", 1.0, 0.0, 0.0, 0.0), "phase must be one of rest, ramp, steady, got 'crawl'"),
        (("rest", 0.0, 0.0, 0.0, 0.0), "duration_s must be above zero, got 0"),
        (("rest", math.nan, 0.0, 0.0, 0.0), "duration_s must be finite, got nan"),
        (("rest", True, 0.0, 0.0, 0.0), "duration_s must be a number, got True"),
        (("rest", "1", 0.0, 0.0, 0.0), "duration_s must be a number, got '1'"),
        (("rest", 10**400, 0.0, 0.0, 0.0), "duration_s must be finite, got inf"),
        (("rest", 1.0, 2.0, 2.0, 0.0), "a rest must have velocity zero, got 2 rad/s"),
        (("steady", 1.0, 0.0, 0.0, 0.0), "a steady segment must move"),
        (("steady", 1.0, 1.0, 2.0, 0.1), "only a ramp changes velocity; this steady segment"),
        (("steady", 1.0, 1.0, 1.0, 0.1), "jerk_time_s must be zero where"),
        (("ramp", 1.0, 0.0, math.inf, 0.1), "velocity_end_rad_s must be finite, got inf"),
        (("ramp", 1.0, 0.0, 1.0, 0.0), "at most half the duration (0.5 s), got 0"),
        (("ramp", 1.0, 0.0, 1.0, 0.6), "at most half the duration (0.5 s), got 0.6"),
        (("ramp", 1.0, 0.0, 1.0, -0.1), "jerk_time_s must not be negative, got -0.1"),
        (("ramp", 1e-200, 0.0, 1.0, 4e-201), "has no finite jerk"),
    ],
)
def test_a_segment_that_contradicts_itself_is_refused(
    values: tuple[object, ...], sentence: str
) -> None:
    with pytest.raises(TrajectoryError) as caught:
        Segment(*values)  # type: ignore[arg-type]  # wrong on purpose
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ((1.0, 1.0, 5.0, 5.0), "a ramp must change the velocity, got 1 rad/s twice"),
        ((0.0, 1.0, 0.0, 5.0), "acceleration_rad_s2 must be above zero, got 0"),
        ((0.0, 1.0, 5.0, -5.0), "jerk_rad_s3 must be above zero, got -5"),
        ((math.nan, 1.0, 5.0, 5.0), "velocity_start_rad_s must be finite, got nan"),
    ],
)
def test_a_ramp_without_sense_is_refused(values: tuple[float, ...], sentence: str) -> None:
    with pytest.raises(TrajectoryError) as caught:
        Segment.ramp(*values)
    assert sentence in str(caught.value)
