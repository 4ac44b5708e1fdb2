"""A trajectory as the drive's own moves: what is offered, what is waited for, what is refused."""

from __future__ import annotations

import itertools
import math

import pytest

from agent.cycle.motion import ARRIVE_S, TAKE_UP_S, Due, MoveFailedError, Moves
from agent.cycle.streamed import ROUNDING_S, Streamed
from drivers.ports import DriveState, MoveProgress, MoveState, Sample
from trajectories import Trajectory, TrajectoryError, point_to_point, stair_between, stair_paired

TICK_S, RAMP = 0.004, 200.0


def paired() -> Trajectory:
    return stair_paired(
        -30.0,
        30.0,
        speeds_rad_s=(20.0, 40.0),
        duration_s=12.0,
        acceleration_rad_s2=RAMP,
        jerk_rad_s3=10_000.0,
    )


def said(due: Due | None, state: MoveState | None) -> Sample:
    """Return a sample that says how far the drive is with the move of `due`."""
    move = None if due is None else due.move
    progress = None if state is None or move is None else MoveProgress(move.number, state)
    return Sample(0.0, 0.0, 0.0, 0.0, 0.0, math.nan, DriveState.ON, False, move=progress)


def moves(trajectory: Trajectory, from_rad: float = 0.0) -> Moves:
    return Moves(trajectory, from_rad, RAMP, TICK_S, itertools.count(1))


def drive_all(motion: Moves) -> list[Due]:
    """Be a drive that takes every move up in the next tick and is always there in time."""
    dues: list[Due] = []
    due: Due | None = None
    while True:
        before = due
        due = motion.advance(TICK_S, said(before, MoveState.DONE))
        if due is None:
            return dues
        dues.append(due)
        assert len(dues) < 20_000


def test_every_pass_is_one_move_at_its_own_speed_and_in_its_own_place() -> None:
    trajectory = paired()
    motion = moves(trajectory, from_rad=5.0)
    dues = drive_all(motion)
    offered = list(dict.fromkeys(d.move for d in dues if d.move is not None))
    assert [m.number for m in offered] == list(range(1, len(offered) + 1))
    shift = 5.0 - trajectory.start_position_rad
    place = 5.0
    steady = [s.velocity_rad_s for s in trajectory.steady_windows()]
    speeds = []
    for move in offered:
        assert move.velocity_rad_s > 0.0
        speeds.append(math.copysign(move.velocity_rad_s, move.position_rad - place))
        place = move.position_rad
    assert place == pytest.approx(trajectory.end_position_rad + shift)
    assert {v for v in speeds if abs(v) in (20.0, 40.0)} == {20.0, -20.0, 40.0, -40.0}
    assert set(steady) <= set(speeds)
    assert motion.share == 1.0


def test_what_the_drive_should_be_doing_is_a_trapezoid_within_its_ramps() -> None:
    dues = drive_all(moves(paired()))
    for before, after in itertools.pairwise(dues):
        change = abs(after.velocity_rad_s - before.velocity_rad_s)
        assert change <= RAMP * TICK_S * (1.0 + 1e-9)
        assert abs(after.position_rad - before.position_rad) <= 40.0 * TICK_S * (1.0 + 1e-9)
    assert {d.phase for d in dues} == {"rest", "ramp", "steady"}
    assert all(abs(d.velocity_rad_s) in (20.0, 40.0) for d in dues if d.phase == "steady")


@pytest.mark.parametrize("state", [None, MoveState.OFFERED])
def test_a_move_that_is_not_taken_up_ends_the_cycle(state: MoveState | None) -> None:
    motion = moves(paired())
    due = motion.advance(TICK_S, said(None, None))
    waited_s = 0.0
    while due is not None and waited_s < TAKE_UP_S - 2.0 * TICK_S:
        due = motion.advance(TICK_S, said(due, state))
        assert due is not None
        assert due.velocity_rad_s == 0.0
        waited_s += TICK_S if due.move is not None else 0.0
    newest = said(due, state)
    motion.advance(TICK_S, newest)
    with pytest.raises(MoveFailedError, match="did not take up move 1"):
        motion.advance(3.0 * TICK_S, newest)


def test_a_move_that_never_arrives_ends_the_cycle() -> None:
    motion = moves(paired())
    due: Due | None = None
    moved = False
    still_s = 0.0
    while not moved or still_s < ARRIVE_S - 2.0 * TICK_S:
        due = motion.advance(TICK_S, said(due, MoveState.RUNNING))
        assert due is not None
        moved = moved or due.velocity_rad_s != 0.0
        still_s = 0.0 if due.velocity_rad_s else still_s + TICK_S
    newest = said(due, MoveState.RUNNING)
    with pytest.raises(MoveFailedError, match="did not end move 1"):
        motion.advance(5.0 * TICK_S, newest)


def test_what_was_said_of_the_move_before_is_not_taken_for_this_one() -> None:
    motion = moves(paired())
    due: Due | None = None
    while due is None or due.move is None or due.move.number < 2:
        due = motion.advance(TICK_S, said(due, MoveState.DONE))
    stale = said(due._replace(move=due.move._replace(number=1)), MoveState.DONE)
    for _ in range(10):
        waiting = motion.advance(TICK_S, stale)
        assert waiting is not None
        assert (waiting.velocity_rad_s, waiting.move) == (0.0, due.move)


def test_a_stair_that_changes_its_speed_on_the_way_is_refused() -> None:
    climbing = stair_between(
        -30.0, 30.0, duration_s=12.0, acceleration_rad_s2=RAMP, jerk_rad_s3=10_000.0, steps=3
    )
    with pytest.raises(TrajectoryError, match="has 3: use a stair of kind 'paired'"):
        moves(climbing)


def test_streaming_ends_where_it_should_and_a_late_tick_makes_no_leap() -> None:
    trajectory = paired()
    motion = Streamed(trajectory, 5.0, TICK_S)
    last = 5.0
    for number in itertools.count():
        step_s = 0.5 if number % 50 == 49 else TICK_S
        due = motion.advance(step_s, said(None, None))
        if due is None:
            break
        assert abs(due.position_rad - last) <= 40.0 * 3.0 * TICK_S * (1.0 + 1e-9)
        last = due.position_rad
    assert last == pytest.approx(5.0 + trajectory.end_position_rad - trajectory.start_position_rad)


def pull(rounding_s: float, frequency_hz: float) -> float:
    """Return with which acceleration a motor pulls an undamped arm at most, over one move.

    The motor follows its set-points to the letter; the arm swings on a spring behind it.
    """
    move = point_to_point(
        0.0, 60.0, velocity_rad_s=40.0, acceleration_rad_s2=RAMP, jerk_rad_s3=10_000.0
    )
    motion = Streamed(move, 0.0, TICK_S, rounding_s)
    stiffness = (2.0 * math.pi * frequency_hz) ** 2
    step_s, before_rad_s = 0.001, 0.0
    twist_rad = twist_rad_s = most_rad = 0.0
    while (due := motion.advance(step_s, said(None, None))) is not None:
        twist_rad_s += due.velocity_rad_s - before_rad_s - step_s * stiffness * twist_rad
        twist_rad += step_s * twist_rad_s
        before_rad_s = due.velocity_rad_s
        most_rad = max(most_rad, abs(twist_rad))
    return most_rad * stiffness


@pytest.mark.parametrize("frequency_hz", [8.0, 12.0, 20.0])
def test_rounded_positions_pull_an_arm_hardly_more_than_their_own_ramp(frequency_hz: float) -> None:
    assert pull(0.0, frequency_hz) > 1.7 * RAMP
    assert pull(ROUNDING_S, frequency_hz) < 1.25 * RAMP


def test_a_rounded_window_is_steady_only_where_all_that_is_averaged_is() -> None:
    trajectory = paired()
    motion = Streamed(trajectory, 5.0, TICK_S, ROUNDING_S)
    dues: list[Due] = []
    while (due := motion.advance(TICK_S, said(None, None))) is not None:
        dues.append(due)
    speeds = {round(d.velocity_rad_s, 9) for d in dues if d.phase == "steady"}
    assert speeds == {-40.0, -20.0, 20.0, 40.0}
    held_s = TICK_S * sum(d.phase == "steady" for d in dues)
    windows = trajectory.steady_windows()
    expected_s = sum(w.end_s - w.start_s - ROUNDING_S for w in windows)
    assert held_s == pytest.approx(expected_s, abs=2.0 * TICK_S * len(windows))
