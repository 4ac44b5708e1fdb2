"""The gate passes what is shown to be safe, up to each limit exactly, and nothing else."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.cycle.gate import GateLimits, SetPoint, move_refusals, refusals
from drivers.ports import DriveState, Move, Sample

LIMITS = GateLimits(
    velocity_max_rad_s=200.0,
    acceleration_max_rad_s2=1000.0,
    position_min_rad=-300.0,
    position_max_rad=300.0,
    stopping_deceleration_rad_s2=1000.0,
    reaction_time_s=0.1,
    velocity_error_max_rad_s=20.0,
    following_error_max_rad=5.0,
    torque_max_nm=10.0,
    temperature_min_degc=5.0,
    temperature_max_degc=70.0,
    temperature_required=True,
    sample_age_max_s=0.05,
)
NOW_S = 100.0
WANTED = SetPoint(velocity_rad_s=50.0, position_rad=0.0, previous_velocity_rad_s=50.0, step_s=0.002)
SAMPLE = Sample(
    time_s=NOW_S - 0.002,
    received_s=NOW_S - 0.001,
    position_rad=0.0,
    velocity_rad_s=50.0,
    torque_nm=1.0,
    gearbox_temperature_degc=30.0,
    state=DriveState.ON,
    internal_limit_active=False,
)


def wanted(**changes: float) -> SetPoint:
    return dataclasses.replace(WANTED, **changes)  # type: ignore[arg-type]  # floats, all of them


def sample(**changes: object) -> Sample:
    return SAMPLE._replace(**changes)  # type: ignore[arg-type]  # the names are checked below


def test_an_ordinary_set_point_passes() -> None:
    assert refusals(LIMITS, WANTED, SAMPLE, NOW_S) == ()


def test_nothing_passes_before_something_was_measured() -> None:
    assert refusals(LIMITS, WANTED, None, NOW_S) == ("nothing has been measured yet",)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("build", "limit", "word"),
    [
        pytest.param(
            lambda x: (
                wanted(velocity_rad_s=x, previous_velocity_rad_s=x),
                sample(velocity_rad_s=x),
            ),
            200.0,
            "exceeds the limit",
            id="velocity",
        ),
        pytest.param(
            lambda x: (wanted(velocity_rad_s=50.0 + x), sample()),
            1000.0 * 0.002,
            "would jump",
            id="rate",
        ),
        pytest.param(
            lambda x: (wanted(), sample(velocity_rad_s=50.0 + x)),
            20.0,
            "from its set-point",
            id="velocity error",
        ),
        pytest.param(
            lambda x: (wanted(position_rad=x), sample()),
            5.0,
            "measured position is",
            id="following error",
        ),
        pytest.param(
            lambda x: (wanted(), sample(torque_nm=x)), 10.0, "measured torque", id="torque"
        ),
    ],
)
def test_each_limit_is_exact(
    build: Callable[[float], tuple[SetPoint, Sample]], limit: float, word: str, sign: float
) -> None:
    for share in (0.0, 0.5, 0.999, 1.0):
        asked, measured = build(sign * limit * share)
        assert refusals(LIMITS, asked, measured, NOW_S) == (), share
    for outside in (1.0 + 1e-6, 1.01, 2.0, 1e6):
        asked, measured = build(sign * limit * outside)
        found = refusals(LIMITS, asked, measured, NOW_S)
        assert any(word in reason for reason in found), (outside, found)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("speed", [1.0, 20.0, 200.0])
@pytest.mark.parametrize("who", ["command", "measured"])
def test_the_window_holds_the_stopping_distance(speed: float, sign: float, who: str) -> None:
    """Command or measurement, whichever is faster, must be stoppable inside the window."""
    limits = dataclasses.replace(LIMITS, velocity_error_max_rad_s=math.inf)
    reach = speed * 0.1 + speed**2 / 2000.0
    velocity = sign * speed
    asked = velocity if who == "command" else 0.0
    measured = velocity if who == "measured" else 0.0
    for offset, safe in ((-1e-6, True), (1e-6, False), (50.0, False)):
        position = sign * (300.0 - reach + offset)
        found = refusals(
            limits,
            wanted(velocity_rad_s=asked, previous_velocity_rad_s=asked, position_rad=position),
            sample(velocity_rad_s=measured, position_rad=position),
            NOW_S,
        )
        assert (found == ()) is safe, found


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_joint_outside_its_window_may_come_back_but_not_go_on(sign: float) -> None:
    outside = sign * 310.0
    back = refusals(
        LIMITS,
        wanted(velocity_rad_s=-sign, previous_velocity_rad_s=-sign, position_rad=outside),
        sample(velocity_rad_s=0.0, position_rad=outside),
        NOW_S,
    )
    onwards = refusals(
        LIMITS,
        wanted(velocity_rad_s=sign, previous_velocity_rad_s=sign, position_rad=outside),
        sample(velocity_rad_s=0.0, position_rad=outside),
        NOW_S,
    )
    assert back == ()
    assert any("outside" in reason for reason in onwards)


@pytest.mark.parametrize(
    ("age_s", "fresh"), [(0.0, True), (0.05, True), (0.0501, False), (10.0, False), (-0.01, False)]
)
def test_a_stale_sample_or_one_from_the_future_refuses(age_s: float, fresh: bool) -> None:
    found = refusals(LIMITS, WANTED, sample(time_s=NOW_S - age_s), NOW_S)
    assert (found == ()) is fresh, found


@pytest.mark.parametrize(
    ("degc", "fine"),
    [(5.0, True), (70.0, True), (4.99, False), (70.01, False), (math.nan, False), (-999.0, False)],
)
def test_gearbox_temperature(degc: float, fine: bool) -> None:
    found = refusals(LIMITS, WANTED, sample(gearbox_temperature_degc=degc), NOW_S)
    assert (found == ()) is fine, found


def test_a_missing_temperature_passes_only_where_none_is_required() -> None:
    without = dataclasses.replace(LIMITS, temperature_required=False)
    missing = sample(gearbox_temperature_degc=math.nan)
    assert refusals(without, WANTED, missing, NOW_S) == ()


@pytest.mark.parametrize("state", [s for s in DriveState if s is not DriveState.ON])
def test_only_an_enabled_drive_moves(state: DriveState) -> None:
    assert refusals(LIMITS, WANTED, sample(state=state), NOW_S)


def test_a_drive_at_its_own_limit_does_not_move() -> None:
    assert refusals(LIMITS, WANTED, sample(internal_limit_active=True), NOW_S)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_not_a_number_never_passes_and_is_named(bad: float) -> None:
    """The comparisons refuse it, too; but the reason must say what was wrong with it."""
    cases = {
        "the velocity set-point": (wanted(velocity_rad_s=bad), SAMPLE, NOW_S),
        "the position set-point": (wanted(position_rad=bad), SAMPLE, NOW_S),
        "the previous velocity set-point": (wanted(previous_velocity_rad_s=bad), SAMPLE, NOW_S),
        "the previous position set-point": (wanted(previous_position_rad=bad), SAMPLE, NOW_S),
        "the time since the previous set-point": (wanted(step_s=bad), SAMPLE, NOW_S),
        "the sample's time": (WANTED, sample(time_s=bad), NOW_S),
        "the measured position": (WANTED, sample(position_rad=bad), NOW_S),
        "the measured velocity": (WANTED, sample(velocity_rad_s=bad), NOW_S),
        "the measured torque": (WANTED, sample(torque_nm=bad), NOW_S),
        "the present time": (WANTED, SAMPLE, bad),
    }
    for name, (asked, measured, now_s) in cases.items():
        found = refusals(LIMITS, asked, measured, now_s)
        assert found == (f"{name} is not a number ({bad})",)


numbers = st.floats(min_value=-500.0, max_value=500.0)


@given(
    velocity=numbers,
    previous=numbers,
    step_s=st.floats(min_value=-0.1, max_value=0.5),
    measured=numbers,
    position=numbers,
    planned=numbers,
    torque=st.floats(min_value=-20.0, max_value=20.0),
)
def test_whatever_passes_satisfies_every_limit(
    velocity: float,
    previous: float,
    step_s: float,
    measured: float,
    position: float,
    planned: float,
    torque: float,
) -> None:
    """The law of the gate, recomputed without it: passing implies every inequality."""
    found = refusals(
        LIMITS,
        SetPoint(velocity, planned, previous, step_s),
        sample(velocity_rad_s=measured, position_rad=position, torque_nm=torque),
        NOW_S,
    )
    if found:
        return
    slack = 1e-6
    assert abs(velocity) <= 200.0 + slack
    assert abs(velocity - previous) <= 1000.0 * step_s + slack
    assert abs(velocity - measured) <= 20.0 + slack
    assert abs(position - planned) <= 5.0 + slack
    assert abs(torque) <= 10.0 + slack
    for v in (velocity, measured):
        end = position + math.copysign(abs(v) * 0.1 + v * v / 2000.0, v)
        assert v == 0.0 or (end <= 300.0 + slack if v > 0 else end >= -300.0 - slack)


def last_that_passes(passes: Callable[[float], bool], inside: float, outside: float) -> float:
    """Return the last float, from `inside` towards `outside`, that the gate lets pass."""
    assert passes(inside)
    assert not passes(outside)
    while math.nextafter(inside, outside) != outside:
        middle = inside + 0.5 * (outside - inside)
        inside, outside = (middle, outside) if passes(middle) else (inside, middle)
    return inside


def at_rest(**changes: object) -> Sample:
    return sample(velocity_rad_s=0.0, **changes)


STILL = wanted(velocity_rad_s=0.0, previous_velocity_rad_s=0.0)
FAST_REACH_RAD = 100.0 * 0.1 + 100.0**2 / 2000.0
ROUNDED = 1.0 + 1e-9
EDGES: dict[str, tuple[Callable[[float], tuple[SetPoint, Sample]], float]] = {
    # what is varied, and the last value that may pass
    "velocity": (
        lambda x: (wanted(velocity_rad_s=x, previous_velocity_rad_s=x), sample(velocity_rad_s=x)),
        200.0 * ROUNDED,
    ),
    "rate": (
        lambda x: (
            wanted(velocity_rad_s=x, previous_velocity_rad_s=0.0, step_s=0.01),
            sample(velocity_rad_s=0.0),
        ),
        10.0 * ROUNDED + 1e-9,
    ),
    "velocity error": (lambda x: (STILL, sample(velocity_rad_s=x)), 20.0),
    "following error": (lambda x: (STILL, at_rest(position_rad=x)), 5.0),
    "torque": (lambda x: (STILL, at_rest(torque_nm=x)), 10.0),
    "step of a position": (
        lambda x: (
            dataclasses.replace(STILL, position_rad=x, previous_position_rad=0.0, step_s=0.01),
            at_rest(),
        ),
        2.0 * ROUNDED + 1e-9,
    ),
    "window": (
        lambda x: (
            wanted(
                velocity_rad_s=math.copysign(100.0, x),
                previous_velocity_rad_s=math.copysign(100.0, x),
                position_rad=x,
            ),
            sample(velocity_rad_s=math.copysign(100.0, x), position_rad=x),
        ),
        300.0 - FAST_REACH_RAD,
    ),
}


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("build", "limit"), EDGES.values(), ids=EDGES)
def test_the_last_float_that_passes_is_the_limit_itself(
    build: Callable[[float], tuple[SetPoint, Sample]], limit: float, sign: float
) -> None:
    def passes(x: float) -> bool:
        return refusals(LIMITS, *build(sign * x), NOW_S) == ()

    assert last_that_passes(passes, 0.5 * limit, 2.0 * limit) == limit
    assert not passes(math.nextafter(limit, math.inf))


def test_the_last_move_that_passes_is_the_limit_itself() -> None:
    def speed_passes(speed_rad_s: float) -> bool:
        return move_refusals(LIMITS, Move(1, 0.0, speed_rad_s)) == ()

    def end_passes(end_rad: float) -> bool:
        return move_refusals(LIMITS, Move(1, end_rad, 1.0)) == ()

    assert last_that_passes(speed_passes, 1.0, 1e4) == 200.0 * ROUNDED
    assert last_that_passes(speed_passes, 1.0, -1.0) == math.nextafter(0.0, 1.0)
    assert last_that_passes(end_passes, 0.0, 1e4) == 300.0
    assert last_that_passes(end_passes, 0.0, -1e4) == -300.0


def test_to_stand_needs_no_time() -> None:
    assert refusals(LIMITS, dataclasses.replace(STILL, step_s=0.0), at_rest(), NOW_S) == ()


def test_the_last_age_that_passes_is_the_limit_itself() -> None:
    def passes(age_s: float) -> bool:
        return refusals(LIMITS, STILL, at_rest(time_s=-age_s), 0.0) == ()

    assert last_that_passes(passes, 0.01, 1.0) == 0.05 + 1e-9
    assert last_that_passes(passes, 0.01, -1.0) == -1e-9


def test_the_last_temperatures_that_pass_are_the_limits_themselves() -> None:
    def passes(degc: float) -> bool:
        return refusals(LIMITS, STILL, at_rest(gearbox_temperature_degc=degc), NOW_S) == ()

    assert last_that_passes(passes, 30.0, 500.0) == 70.0
    assert last_that_passes(passes, 30.0, -500.0) == 5.0


@pytest.mark.parametrize(("value", "name"), [(LIMITS, "torque_max_nm"), (WANTED, "velocity_rad_s")])
def test_neither_limits_nor_a_set_point_can_be_changed(value: object, name: str) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(value, name, math.inf)
