"""The gate on positions and moves: step, window and speed, at their boundaries."""

from __future__ import annotations

import dataclasses
import math

import pytest

from agent.cycle.gate import Asked, SetPoint, move_refusals, refusals
from drivers.ports import Move
from tests.safety.test_gate import LIMITS, NOW_S, sample

STEP_S = 0.004
LEAP_RAD = LIMITS.velocity_max_rad_s * STEP_S


def asked(position_rad: float, previous_rad: float | None, velocity_rad_s: float = 0.0) -> SetPoint:
    return SetPoint(velocity_rad_s, position_rad, velocity_rad_s, STEP_S, previous_rad)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_position_may_step_as_far_as_the_velocity_limit_goes(sign: float) -> None:
    measured = sample(position_rad=0.0, velocity_rad_s=0.0)
    for share in (0.0, 0.5, 1.0):
        assert refusals(LIMITS, asked(sign * share * LEAP_RAD, 0.0), measured, NOW_S) == ()
    for share in (1.0 + 1e-6, 2.0, 100.0):
        found = refusals(LIMITS, asked(sign * share * LEAP_RAD, 0.0), measured, NOW_S)
        assert any("position set-point would jump" in reason for reason in found), share


def test_no_time_allows_no_step() -> None:
    still = SetPoint(0.0, 1.0, 0.0, 0.0, 1.0)
    here = sample(position_rad=1.0, velocity_rad_s=0.0)
    assert refusals(LIMITS, still, here, NOW_S) == ()
    assert refusals(LIMITS, dataclasses.replace(still, position_rad=1.001), here, NOW_S)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_position_leads_no_further_out_of_the_window(sign: float) -> None:
    edge = LIMITS.position_max_rad
    assert LIMITS.position_min_rad == -edge
    for beyond, passes in ((-0.01, True), (0.0, True), (1e-6, False)):
        at = sign * (edge + beyond)
        measured = sample(position_rad=at, velocity_rad_s=0.0)
        found = refusals(LIMITS, asked(at, at - sign * 1e-3), measured, NOW_S)
        assert (found == ()) is passes, (beyond, found)
        # Back in is always allowed, and so is to stand.
        assert refusals(LIMITS, asked(at, at + sign * 1e-3), measured, NOW_S) == ()
        assert refusals(LIMITS, asked(at, at), measured, NOW_S) == ()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_window_holds_the_stopping_distance_of_what_is_commanded(sign: float) -> None:
    """The measured joint lags: what counts is the position that it is told to be at."""
    speed = 20.0
    limits = dataclasses.replace(LIMITS, velocity_error_max_rad_s=math.inf)
    last = limits.position_max_rad - limits.stopping_distance_rad(speed)
    lag = sample(position_rad=sign * (last - 1.0), velocity_rad_s=0.0)
    for beyond, passes in ((-1e-6, True), (1e-6, False)):
        at = sign * (last + beyond)
        found = refusals(limits, asked(at, at - sign * speed * STEP_S, sign * speed), lag, NOW_S)
        assert (found == ()) is passes, found


def test_the_position_error_counts_as_for_velocities() -> None:
    off = LIMITS.following_error_max_rad
    here = sample(position_rad=0.0, velocity_rad_s=0.0)
    assert refusals(LIMITS, asked(off, off), here, NOW_S) == ()
    assert refusals(LIMITS, asked(off * (1 + 1e-6), off), here, NOW_S)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_position_that_is_no_number_never_passes(bad: float) -> None:
    here = sample(position_rad=0.0, velocity_rad_s=0.0)
    assert refusals(LIMITS, asked(bad, 0.0), here, NOW_S)
    assert refusals(LIMITS, asked(0.0, bad), here, NOW_S)
    for move in (Move(1, bad, 1.0), Move(1, 0.0, bad)):
        (reason,) = move_refusals(LIMITS, move)
        assert "is no move" in reason


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_move_ends_inside_the_window(sign: float) -> None:
    edge = LIMITS.position_max_rad
    assert move_refusals(LIMITS, Move(1, sign * edge, 1.0)) == ()
    found = move_refusals(LIMITS, Move(1, sign * math.nextafter(edge, math.inf), 1.0))
    assert any("would end at" in reason for reason in found)


def test_a_move_has_a_speed_within_the_limit() -> None:
    fastest = LIMITS.velocity_max_rad_s
    for speed, passes in (
        (1e-9, True),
        (fastest, True),
        (fastest * (1 + 1e-6), False),
        (0.0, False),
        (-1.0, False),
    ):
        assert (move_refusals(LIMITS, Move(1, 0.0, speed)) == ()) is passes, speed


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_sample_is_compared_with_what_it_answers_and_with_nothing_later(sign: float) -> None:
    """Ten ticks late on a ramp is no following error; the same distance from what it answers is."""
    later = SetPoint(0.0, 20.0, 0.0, STEP_S)
    lag = sample(position_rad=0.0, velocity_rad_s=sign * 60.0)
    assert refusals(LIMITS, later, lag, NOW_S)
    for error, what in (
        (LIMITS.velocity_error_max_rad_s, "velocity"),
        (LIMITS.following_error_max_rad, "position"),
    ):
        for share, passes in ((1.0, True), (1.0 + 1e-6, False)):
            off = sign * error * share
            answered = Asked(
                sign * 60.0 + (off if what == "velocity" else 0.0),
                off if what == "position" else 0.0,
            )
            wanted = dataclasses.replace(later, answered=answered)
            found = refusals(LIMITS, wanted, lag, NOW_S)
            assert (found == ()) is passes, found
            assert passes or (len(found) == 1 and f"measured {what}" in found[0])


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_a_sample_answers_is_a_number(bad: float) -> None:
    still, here = SetPoint(0.0, 0.0, 0.0, STEP_S), sample(position_rad=0.0, velocity_rad_s=0.0)
    for answered, name in ((Asked(bad, 0.0), "velocity"), (Asked(0.0, bad), "position")):
        found = refusals(LIMITS, dataclasses.replace(still, answered=answered), here, NOW_S)
        assert len(found) == 1
        assert f"the answered {name} set-point is not a number" in found[0]
