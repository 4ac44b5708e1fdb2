"""Of a motion that a controller makes by itself, position and velocity bear each other out."""

from __future__ import annotations

import math
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from agent.cycle.continuity import Course
from tests.safety.test_gate import LIMITS, SAMPLE

FASTEST_RAD_S, SWING_HZ = 100.0, 0.5


def position_rad(time_s: float) -> float:
    w = 2.0 * math.pi * SWING_HZ
    return FASTEST_RAD_S / w * math.sin(w * time_s)


def velocity_rad_s(time_s: float) -> float:
    return FASTEST_RAD_S * math.cos(2.0 * math.pi * SWING_HZ * time_s)


@given(st.lists(st.floats(0.01, 0.3), min_size=2, max_size=200))
def test_a_true_motion_contradicts_itself_never_however_it_is_sampled(steps_s: list[float]) -> None:
    course, now_s = Course(LIMITS), 0.0
    for step_s in steps_s:
        now_s += step_s
        course.take(
            SAMPLE._replace(
                time_s=now_s,
                position_rad=position_rad(now_s),
                velocity_rad_s=velocity_rad_s(now_s),
            )
        )
        assert course.contradiction() == ""
        assert abs(course.speed_rad_s) <= FASTEST_RAD_S


def test_a_frozen_position_and_a_velocity_that_is_none_are_found() -> None:
    frozen, silent = Course(LIMITS), Course(LIMITS)
    for k in range(60):
        at_s = 0.02 * k
        frozen.take(
            SAMPLE._replace(time_s=at_s, position_rad=0.0, velocity_rad_s=velocity_rad_s(at_s))
        )
        silent.take(
            SAMPLE._replace(time_s=at_s, position_rad=position_rad(at_s), velocity_rad_s=0.0)
        )
        if k == 30:
            assert "one of them is not the joint's" in frozen.contradiction()
            assert "one of them is not the joint's" in silent.contradiction()
    assert frozen.speed_rad_s == 0.0
    assert silent.speed_rad_s != 0.0
    assert frozen.unlike_rad_s is None  # it may stand: that is told by what its motor does
    assert silent.unlike_rad_s == (silent.speed_rad_s, 0.0)


def test_a_direct_drives_coarse_velocity_contradicts_nothing() -> None:
    """Its following error is less than what whole revolutions a minute add up to in a second."""
    tight = replace(LIMITS, following_error_max_rad=0.005, acceleration_max_rad_s2=50.0)
    rpm = 2.0 * math.pi / 60.0
    course, at_rad = Course(tight), 0.0
    for k in range(3000):
        speed_rad_s = 20.0 * rpm + 0.1
        at_rad += 0.001 * speed_rad_s
        told_rad_s = math.floor(speed_rad_s / rpm) * rpm
        course.take(
            SAMPLE._replace(time_s=0.001 * k, position_rad=at_rad, velocity_rad_s=told_rad_s)
        )
        assert course.contradiction() == ""
