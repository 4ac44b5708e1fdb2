from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trajectories import (
    AxisLimits,
    Margin,
    Segment,
    TorqueModel,
    Trajectory,
    TrajectoryError,
    check,
    margins,
    motor_rad,
    spaced_speeds,
    stair_paired,
    summarise,
)

WIDE = AxisLimits(
    position_min_rad=-1e5,
    position_max_rad=1e5,
    velocity_max_rad_s=1e4,
    acceleration_max_rad_s2=1e6,
    jerk_max_rad_s3=1e9,
    torque_max_nm=1e4,
    stopping_deceleration_rad_s2=1500.0,
    reaction_time_s=0.02,
)
MODEL = TorqueModel(inertia_kg_m2=6e-4, coulomb_nm=0.6, viscous_nm_s_per_rad=0.0107, gravity_nm=0.3)
LOW_RAD, HIGH_RAD = motor_rad(-50.0, 224.0), motor_rad(50.0, 224.0)


def stair() -> Trajectory:
    return stair_paired(
        LOW_RAD,
        HIGH_RAD,
        speeds_rad_s=spaced_speeds(2.0, 200.0, 11),
        duration_s=40.0,
        acceleration_rad_s2=1000.0,
        jerk_rad_s3=20_000.0,
    )


@st.composite
def walks(draw: st.DrawFn) -> Trajectory:
    """Any ramps, also through zero, slow and fast, soft and hard, with short dwells between."""
    segments: list[Segment] = []
    velocity = 0.0
    levels = draw(st.lists(st.floats(-250.0, 250.0).map(lambda v: round(v, 3)), max_size=5))
    for target in [*levels, 0.0]:
        acceleration = 10.0 ** draw(st.floats(1.0, 4.0))
        jerk = acceleration * 10.0 ** draw(st.floats(0.0, 3.0))
        if target != velocity:
            segments.append(Segment.ramp(velocity, target, acceleration, jerk))
        velocity = target
        hold = draw(st.floats(1e-3, 2.0))
        segments.append(Segment.transfer(velocity, hold) if velocity else Segment.rest(hold))
    return Trajectory("walk", {}, draw(st.floats(-200.0, 200.0)), tuple(segments))


@st.composite
def limits_and_models(draw: st.DrawFn) -> tuple[AxisLimits, TorqueModel]:
    limits = dataclasses.replace(
        WIDE,
        stopping_deceleration_rad_s2=10.0 ** draw(st.floats(1.0, 5.0)),
        reaction_time_s=draw(st.floats(0.0, 0.3)),
    )
    share = st.just(0.0) | st.floats(1e-4, 1.0)
    return limits, TorqueModel(draw(share), draw(share), draw(share), draw(share))


def densely(trajectory: Trajectory, points: int = 400) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return position, velocity and acceleration at many instants of every piece."""
    shares = np.linspace(0.0, 1.0 - 1e-9, points)
    times = [p.start_s + shares * p.duration_s for p in trajectory.pieces]
    sampled = trajectory.sample(np.concatenate([[0.0], *times, [trajectory.duration_s]]))
    return sampled.position_rad, sampled.velocity_rad_s, sampled.acceleration_rad_s2


def stopped_at(position: Any, velocity: Any, direction: float, limits: AxisLimits) -> Any:
    """Return where a stop ends that began at some instant, written apart from the product."""
    speed = np.maximum(direction * np.asarray(velocity), 0.0)
    braking = speed**2 / (2.0 * limits.stopping_deceleration_rad_s2)
    return position + direction * (speed * limits.reaction_time_s + braking)


@given(walks(), limits_and_models())
@settings(deadline=None)
def test_margins_are_never_less_strict_than_dense_sampling(
    trajectory: Trajectory, axis: tuple[AxisLimits, TorqueModel]
) -> None:
    limits, model = axis
    x, v, a = densely(trajectory)
    lower, upper, velocity, acceleration, _, torque = margins(trajectory, limits, model)
    slack = 1e-9
    assert lower.value <= np.min(stopped_at(x, v, -1.0, limits)) + slack * (1 + abs(lower.value))
    assert upper.value >= np.max(stopped_at(x, v, 1.0, limits)) - slack * (1 + abs(upper.value))
    assert velocity.value >= np.max(np.abs(v)) * (1.0 - slack)
    assert acceleration.value >= np.max(np.abs(a)) * (1.0 - slack)
    still = np.abs(v) < 1e-9  # the sign of a velocity that is nothing but rounding says nothing
    inertial = model.inertia_kg_m2 * a
    friction = model.coulomb_nm * np.sign(v) + model.viscous_nm_s_per_rad * v
    sampled = np.where(still, np.abs(inertial) + model.coulomb_nm, np.abs(inertial + friction))
    assert torque.value >= np.max(sampled + model.gravity_nm) * (1.0 - slack) - 1e-9


@given(walks(), limits_and_models())
@settings(deadline=None)
def test_margins_are_reached_and_so_no_stricter_than_they_must_be(
    trajectory: Trajectory, axis: tuple[AxisLimits, TorqueModel]
) -> None:
    limits, model = axis
    lower, upper, velocity, acceleration, _, torque = margins(trajectory, limits, model)
    for margin, direction in ((lower, -1.0), (upper, 1.0)):
        point = trajectory.at(margin.time_s)
        end = stopped_at(point.position_rad, point.velocity_rad_s, direction, limits)
        assert margin.value == pytest.approx(float(end), rel=1e-7, abs=1e-7)
        assert margin.stopping_distance_rad == pytest.approx(
            abs(float(end) - point.position_rad), rel=1e-6, abs=1e-7
        )
    assert abs(trajectory.at(velocity.time_s).velocity_rad_s) == pytest.approx(
        velocity.value, rel=1e-7, abs=1e-7
    )
    assert abs(trajectory.at(acceleration.time_s).acceleration_rad_s2) == pytest.approx(
        acceleration.value, rel=1e-6, abs=1e-5
    )
    point = trajectory.at(torque.time_s)
    either_side = [
        model.magnitude_nm(point.velocity_rad_s + side, point.acceleration_rad_s2)
        for side in (-1e-9, 0.0, 1e-9)
    ]
    assert min(abs(torque.value - value) for value in either_side) < 1e-6 * (1.0 + torque.value)


@given(walks(), limits_and_models(), st.floats(0.0, 1.0))
@settings(deadline=None)
def test_running_on_as_planned_while_nobody_reacts_is_covered_too(
    trajectory: Trajectory, axis: tuple[AxisLimits, TorqueModel], share: float
) -> None:
    limits, _ = axis
    lower, upper, *_ = margins(trajectory, limits)
    later = trajectory.at(share * trajectory.duration_s + limits.reaction_time_s)
    at_once = dataclasses.replace(limits, reaction_time_s=0.0)
    for direction, margin in ((-1.0, lower), (1.0, upper)):
        end = float(stopped_at(later.position_rad, later.velocity_rad_s, direction, at_once))
        assert direction * end <= direction * margin.value + 1e-7


def test_the_farthest_stop_begins_in_the_middle_of_the_braking_ramp() -> None:
    # On the straight part of the ramp the reach grows until v = A t_r / (1 - A/D) = 40 rad/s.
    limits = dataclasses.replace(WIDE, stopping_deceleration_rad_s2=2000.0, reaction_time_s=0.02)
    up = Segment.ramp(0.0, 100.0, 1000.0, 20_000.0)
    down = Segment.ramp(100.0, 0.0, 1000.0, 20_000.0)
    trajectory = Trajectory("go", {}, 0.0, (up, down))
    upper = margins(trajectory, limits)[1]
    into_s = 0.05 + 0.035  # 100 -> 75 rad/s in the bend, 75 -> 40 on the straight
    position = 100.0 * 0.05 - 20_000.0 * 0.05**3 / 6.0 + 75.0 * 0.035 - 500.0 * 0.035**2
    assert upper.time_s == pytest.approx(up.duration_s + into_s, abs=1e-9)
    assert upper.stopping_distance_rad == pytest.approx(0.8 + 0.4, abs=1e-9)
    assert upper.value == pytest.approx(up.displacement_rad + position + 1.2, abs=1e-9)
    assert upper.value > trajectory.end_position_rad + 0.05  # the path alone would not show it


def test_the_largest_torque_lies_within_the_last_bend_of_a_ramp() -> None:
    # Inertia wanes and viscous friction still grows: J j = viscous a, so a = 200 rad/s^2, 10 ms
    # before the ramp ends, when 1 rad/s is still missing.
    model = TorqueModel(
        inertia_kg_m2=1e-3, coulomb_nm=0.5, viscous_nm_s_per_rad=0.1, gravity_nm=0.0
    )
    up = Segment.ramp(0.0, 100.0, 1000.0, 20_000.0)
    trajectory = Trajectory("go", {}, 0.0, (up, Segment.ramp(100.0, 0.0, 1000.0, 20_000.0)))
    torque = margins(trajectory, WIDE, model)[-1]
    assert torque.time_s == pytest.approx(up.duration_s - 0.01, abs=1e-9)
    assert torque.value == pytest.approx(1e-3 * 200.0 + 0.5 + 0.1 * 99.0, abs=1e-9)


@given(walks())
@settings(deadline=None)
def test_the_range_of_positions_is_exact_also_where_a_ramp_turns_round(
    trajectory: Trajectory,
) -> None:
    x, _, _ = densely(trajectory)
    dry_run = summarise(trajectory)
    assert dry_run.position_min_rad <= np.min(x) + 1e-9
    assert dry_run.position_max_rad >= np.max(x) - 1e-9
    assert dry_run.position_min_rad == pytest.approx(np.min(x), abs=0.1)
    assert dry_run.position_max_rad == pytest.approx(np.max(x), abs=0.1)


def test_a_ramp_through_zero_turns_round_beyond_both_of_its_ends() -> None:
    turn = Segment.ramp(20.0, -20.0, 100.0, 1e6)
    up, down = Segment.ramp(0.0, 20.0, 100.0, 1e6), Segment.ramp(-20.0, 0.0, 100.0, 1e6)
    dry_run = summarise(Trajectory("go", {}, 0.0, (up, turn, down)))
    farthest = up.displacement_rad + turn.position_rad(0.5 * turn.duration_s)
    assert dry_run.position_max_rad == pytest.approx(farthest, abs=1e-9)
    assert farthest == pytest.approx(4.0, abs=0.01)  # v^2/2a up to speed, and once more


QUANTITIES: dict[str, Callable[[AxisLimits, float], AxisLimits]] = {
    "position_max_rad": lambda limits, v: dataclasses.replace(limits, position_max_rad=v),
    "position_min_rad": lambda limits, v: dataclasses.replace(limits, position_min_rad=v),
    "velocity_max_rad_s": lambda limits, v: dataclasses.replace(limits, velocity_max_rad_s=v),
    "acceleration_max_rad_s2": lambda limits, v: dataclasses.replace(
        limits, acceleration_max_rad_s2=v
    ),
    "jerk_max_rad_s3": lambda limits, v: dataclasses.replace(limits, jerk_max_rad_s3=v),
    "torque_max_nm": lambda limits, v: dataclasses.replace(limits, torque_max_nm=v),
}


@pytest.mark.parametrize("name", QUANTITIES)
@pytest.mark.parametrize("backward", [False, True])
def test_boundary_sweep_just_inside_passes_and_just_outside_is_refused(
    name: str, backward: bool
) -> None:
    trajectory = stair().reversed() if backward else stair()
    quantity = name.split("_", maxsplit=1)[0]
    lower = name == "position_min_rad"
    reached = next(
        m.value
        for m in margins(trajectory, WIDE, MODEL)
        if m.quantity == quantity and m.is_lower is lower
    )
    outward = -1.0 if lower else 1.0
    for step in (1e-8, 1e-6, 1e-3, 0.1):
        room = step * abs(reached) * outward
        assert check(trajectory, QUANTITIES[name](WIDE, reached + room), MODEL) == ()
        (excess,) = check(trajectory, QUANTITIES[name](WIDE, reached - room), MODEL)
        assert (excess.quantity, excess.value) == (quantity, reached)
        assert excess.limit == reached - room
        assert excess.unit in excess.sentence
    # What was made for a bound meets that bound, whatever the last bits say.
    assert check(trajectory, QUANTITIES[name](WIDE, reached), MODEL) == ()


def test_a_stair_passes_the_very_bounds_that_it_was_made_for() -> None:
    limits = dataclasses.replace(
        WIDE,
        velocity_max_rad_s=200.0,
        acceleration_max_rad_s2=1000.0,
        jerk_max_rad_s3=20_000.0,
    )
    assert check(stair(), limits) == ()


def test_every_excess_says_what_when_and_by_how_much() -> None:
    trajectory = Trajectory(
        "go",
        {},
        190.0,
        (Segment.ramp(0.0, 60.0, 600.0, 60_000.0), Segment.ramp(60.0, 0.0, 600.0, 60_000.0)),
    )
    tight = AxisLimits(191.0, 195.5, 50.0, 500.0, 5e4, 0.9, 1000.0, 0.05)
    sentences = [excess.sentence for excess in check(trajectory, tight, MODEL)]
    assert sentences[0] == "position would reach 190.0 rad at 0.0 s; the limit is 191.0 rad"
    assert sentences[1] == (
        "position would reach 198.4 rad at 0.1 s including the stopping distance of 4.5 rad; "
        "the limit is 195.5 rad"
    )
    assert sentences[2:5] == [
        "velocity would reach 60.0 rad/s at 0.1 s; the limit is 50.0 rad/s",
        "acceleration would reach 600.0 rad/s^2 at 0.0 s; the limit is 500.0 rad/s^2",
        "jerk would reach 60000.0 rad/s^3 at 0.0 s; the limit is 50000.0 rad/s^3",
    ]
    assert sentences[5].startswith("torque would reach 1.")
    assert len(sentences) == 6
    assert len(check(trajectory, tight)) == 5  # no torque without a model


def test_a_close_excess_is_written_with_enough_decimals() -> None:
    trajectory = stair()
    upper = margins(trajectory, WIDE)[1]
    limit = upper.value - 1e-4
    (excess,) = check(trajectory, dataclasses.replace(WIDE, position_max_rad=limit))
    written = [float(w) for w in excess.sentence.replace(";", "").split() if w[0].isdigit()]
    assert written[0] > written[-1]


def test_a_limit_of_zero_forgives_rounding_and_nothing_else() -> None:
    def off_by(distance: float) -> Trajectory:
        return Trajectory("stay", {}, -distance, ())

    limits = dataclasses.replace(WIDE, position_min_rad=0.0)
    assert check(off_by(1e-12), limits) == ()
    (excess,) = check(off_by(1e-8), limits)
    assert (excess.value, excess.limit) == (-1e-8, 0.0)


def test_standing_outside_the_limits_is_an_excess() -> None:
    stay = Trajectory("stay", {}, 11.0, ())
    (excess,) = check(stay, dataclasses.replace(WIDE, position_max_rad=10.0))
    assert excess.sentence == "position would reach 11.0 rad at 0.0 s; the limit is 10.0 rad"


def test_a_stop_downward_counts_against_the_lower_limit() -> None:
    trajectory = stair()
    lower, upper, *_ = margins(trajectory, WIDE)
    mirrored = margins(
        stair_paired(
            HIGH_RAD,
            LOW_RAD,
            speeds_rad_s=spaced_speeds(2.0, 200.0, 11),
            duration_s=40.0,
            acceleration_rad_s2=1000.0,
            jerk_rad_s3=20_000.0,
        ),
        WIDE,
    )
    assert mirrored[0].value == pytest.approx(-upper.value, abs=1e-9)
    assert mirrored[1].value == pytest.approx(-lower.value, abs=1e-9)


def test_torque_model_by_hand() -> None:
    model = TorqueModel(0.01, 0.5, 0.02, 0.3)
    assert model.magnitude_nm(10.0, 100.0) == pytest.approx(1.0 + 0.5 + 0.2 + 0.3)
    assert model.magnitude_nm(10.0, -100.0) == pytest.approx(0.3 + 0.3)
    assert model.magnitude_nm(-10.0, -100.0) == pytest.approx(2.0)
    assert model.magnitude_nm(0.0, -100.0) == pytest.approx(1.8)


def test_absurd_numbers_are_refused_and_not_passed() -> None:
    trajectory = Trajectory(
        "go",
        {},
        0.0,
        (Segment("ramp", 1e160, 0.0, 1e140, 1e159), Segment("ramp", 1e160, 1e140, 0.0, 1e159)),
    )
    with pytest.raises(TrajectoryError, match="beyond floating point to check"):
        check(trajectory, WIDE)


LIMITS: dict[str, Any] = dataclasses.asdict(WIDE)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"position_min_rad": math.nan}, "position_min_rad must be finite, got nan"),
        ({"position_max_rad": math.inf}, "position_max_rad must be finite, got inf"),
        ({"position_max_rad": -1e5}, "position_min_rad must lie below position_max_rad, got -1"),
        ({"velocity_max_rad_s": 0.0}, "velocity_max_rad_s must be above zero, got 0"),
        ({"acceleration_max_rad_s2": -1.0}, "acceleration_max_rad_s2 must be above zero, got -1"),
        ({"jerk_max_rad_s3": None}, "jerk_max_rad_s3 must be a number, got None"),
        ({"torque_max_nm": math.nan}, "torque_max_nm must be finite, got nan"),
        ({"stopping_deceleration_rad_s2": 0.0}, "stopping_deceleration_rad_s2 must be above zero"),
        ({"reaction_time_s": -0.1}, "reaction_time_s must not be negative, got -0.1"),
    ],
)
def test_limits_without_sense_are_refused(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(TrajectoryError) as caught:
        AxisLimits(**{**LIMITS, **changes})
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    "name", ["inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad", "gravity_nm"]
)
@pytest.mark.parametrize("value", [-0.1, math.nan])
def test_a_torque_model_without_sense_is_refused(name: str, value: float) -> None:
    with pytest.raises(TrajectoryError, match=name):
        TorqueModel(**{**dataclasses.asdict(MODEL), name: value})


# --- the dry run ------------------------------------------------------------------------------


def test_the_dry_run_in_numbers() -> None:
    limits = dataclasses.replace(WIDE, position_min_rad=-200.0, position_max_rad=210.0)
    dry_run = summarise(stair(), limits, MODEL, gear_ratio=224.0)
    assert dry_run.duration_s == pytest.approx(40.0)
    assert dry_run.steady_velocities == 22
    assert dry_run.peak_speed_rad_s == pytest.approx(200.0)
    assert dry_run.steady_speed_min_rad_s == 2.0
    assert dry_run.arm_max_deg == pytest.approx(dry_run.position_max_rad / 224.0 * 180.0 / math.pi)
    assert dry_run.peak_torque_nm == pytest.approx(
        next(m.value for m in dry_run.margins if m.quantity == "torque")
    )
    lower = next(m for m in dry_run.margins if m.is_lower)
    assert lower.remaining == pytest.approx(lower.value + 200.0)
    assert dry_run.excesses == ()


def test_the_dry_run_in_words() -> None:
    limits = dataclasses.replace(WIDE, velocity_max_rad_s=150.0)
    lines = summarise(stair(), limits, MODEL, gear_ratio=224.0).lines()
    assert lines[0].startswith("stair-paired: 40 s, from ")
    assert "degrees (arm)" in lines[1]
    assert lines[3].startswith("22 steady velocities, speeds 2.00 to 200.00 rad/s, held for")
    assert lines[-1].startswith("REFUSED: velocity would reach 200.0 rad/s")
    assert lines[-1].endswith("; the limit is 150.0 rad/s")
    limits = dataclasses.replace(WIDE, position_min_rad=-200.0)
    lines = summarise(stair(), limits, MODEL, gear_ratio=224.0).lines()
    assert lines[-3].startswith("left of the window, stopping distance included: ")
    assert lines[-3].endswith(" degrees (arm)")
    assert " before −51.1" in lines[-3]
    assert [line.count(" of ") for line in lines[-3:]] == [1, 4, 0]
    assert summarise(stair(), WIDE).lines()[-1] == "within all limits"


def test_the_dry_run_without_limits_model_or_ratio() -> None:
    dry_run = summarise(Trajectory("stay", {}, 1.0, ()))
    assert (dry_run.arm_min_deg, dry_run.peak_torque_nm, dry_run.margins) == (None, None, ())
    assert dry_run.lines()[2:] == (
        "peak speed 0.0 rad/s, acceleration 0 rad/s², jerk 0 rad/s³",
        "no steady velocity",
        "not checked against limits",
    )
    with pytest.raises(TrajectoryError, match="gear_ratio must be above zero"):
        summarise(stair(), gear_ratio=0.0)


def test_a_margin_knows_its_side() -> None:
    below = Margin("position", -9.0, -10.0, 0.0, is_lower=True)
    above = Margin("position", 11.0, 10.0, 0.0)
    assert (below.remaining, below.exceeded) == (1.0, False)
    assert (above.remaining, above.exceeded) == (-1.0, True)
