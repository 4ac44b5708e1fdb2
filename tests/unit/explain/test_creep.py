"""Speeds at which friction fades are edges; friction that yields, bends or rises there is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from agent.explain.proof import compare_runs
from agent.explain.rows.creep import creep_speed, without_creep
from agent.explain.rows.run import Run
from agent.explain.rows.table import tabulate
from agent.physics.twin import Effect, Twin

Floats = NDArray[np.float64]
Friction = Callable[[Floats], Floats]

TIME = np.arange(0.0, 30.0, 4e-3)
TWIN = Twin("r", 1, 100.0, 0.018, 0.5, 0.01)
FASTEST, SLOW = 58.0, 0.3  # rad/s: the greatest speed, and the scale on which a sign is smoothed


def run(friction: Friction) -> Run:
    """Return a slow swing, whose reversals last."""
    rng = np.random.default_rng(3)
    swing, turn = np.sin(0.6 * TIME), 0.6 * np.cos(0.6 * TIME)
    velocity, acceleration = FASTEST * swing**3, 3.0 * FASTEST * swing**2 * turn
    torque = 0.018 * acceleration + 0.01 * velocity + friction(velocity)
    return Run.from_columns(
        {
            "time_s": TIME,
            "position_rad": np.cumsum(velocity) * 4e-3,
            "velocity_rad_s": velocity + 0.01 * rng.standard_normal(TIME.shape),
            "torque_nm": torque + 0.01 * rng.standard_normal(TIME.shape),
        },
        100.0,
        name="swing",
    )


def smoothed(velocity: Floats) -> Floats:
    return np.asarray(0.5 * np.tanh(velocity / SLOW))


def dry(velocity: Floats) -> Floats:
    return np.asarray(0.5 * np.sign(velocity))


def stribeck(velocity: Floats) -> Floats:
    return np.asarray((0.5 + 0.2 * np.exp(-np.abs(velocity) / 3.0)) * np.sign(velocity))


def bell(velocity: Floats) -> Floats:
    return np.asarray((0.5 + 0.4 * np.exp(-((velocity / 2.0) ** 2))) * np.sign(velocity))


def thinning(velocity: Floats) -> Floats:
    return np.asarray((0.3 + 0.3 * (np.abs(velocity) / FASTEST) ** 0.4) * np.sign(velocity))


def test_where_a_simulator_smooths_the_sign_is_found_and_left_out() -> None:
    table = tabulate(TWIN, [run(smoothed)])
    found = without_creep(table)
    assert 2.0 * SLOW < found.creep_rad_s < 6.0 * SLOW < 0.04 * FASTEST
    slowest = np.abs(found.rows["velocity_rad_s"][found.used]).min()
    assert slowest > 0.9 * found.creep_rad_s
    assert np.count_nonzero(found.used) > 0.8 * np.count_nonzero(table.used)
    again = without_creep(table, found.creep_rad_s)
    assert np.array_equal(again.used, found.used)


@pytest.mark.parametrize("friction", [dry, stribeck, bell, thinning])
def test_friction_that_is_there_at_low_speed_is_kept(friction: Friction) -> None:
    """A bell beside falls that are steep at first had been friction that fades, and left out."""
    assert creep_speed(tabulate(TWIN, [run(friction)])) < 0.006 * FASTEST


@pytest.mark.parametrize(("friction", "creeps"), [(stribeck, False), (smoothed, True)])
def test_friction_of_which_the_twin_has_too_much_is_there_at_low_speed(
    friction: Friction, creeps: bool
) -> None:
    """Less than it predicts is not nothing: twice the Stribeck fall was told as agreeing."""
    fall = {"static_extra_nm": 1.0, "stribeck_velocity_rad_s": 3.0, "exponent": 1.0}
    twin = replace(TWIN, effects=(Effect("stribeck", fall),))
    assert (creep_speed(tabulate(twin, [run(friction)])) > 2.0 * SLOW) == creeps


@pytest.mark.parametrize(
    ("friction", "smooths"), [(smoothed, True), (dry, False), (stribeck, False)]
)
def test_where_a_recorded_simulation_smooths_the_sign_is_left_out(
    friction: Friction, smooths: bool
) -> None:
    """The joint's friction is whole there, and had been called Stribeck."""
    joint = run(dry)
    velocity = joint.signals.velocity_rad_s
    assert velocity is not None
    simulated = 0.018 * np.gradient(velocity, 4e-3) + 0.01 * velocity + friction(velocity)
    columns = {**joint.columns, "torque_simulated_nm": simulated}
    speed = creep_speed(tabulate(TWIN, [replace(joint, columns=columns)]))
    assert (2.0 * SLOW < speed < 6.0 * SLOW) if smooths else speed < 0.006 * FASTEST


@pytest.mark.parametrize(("friction", "creeps"), [(smoothed, True), (dry, False)])
def test_a_hold_out_creeps_where_the_recordings_to_learn_from_did_not(
    friction: Friction, creeps: bool
) -> None:
    """Pick-and-place after stairs: laws that were right had left ten times the noise there."""
    like = tabulate(TWIN, [run(dry)])
    compared, unseen = compare_runs(TWIN, TWIN, TWIN, [run(friction)], like)
    assert np.sqrt(np.mean(compared.extended**2)) < 0.02
    assert (unseen.creep_rad_s > 2.0 * SLOW) == creeps


def test_what_was_learnt_from_may_say_that_a_hold_out_creeps() -> None:
    """Where a drift and an offset were as large, the creep showed beside both of them only."""
    like = tabulate(TWIN, [run(dry)])
    _, alone = compare_runs(TWIN, TWIN, TWIN, [run(dry)], like)
    _, unseen = compare_runs(TWIN, TWIN, TWIN, [run(dry)], like, 4.0 * SLOW)
    assert unseen.creep_rad_s == 4.0 * SLOW > alone.creep_rad_s
    assert np.abs(unseen.rows["velocity_rad_s"][unseen.used]).min() > 3.5 * SLOW


@pytest.mark.parametrize(("every", "move_s", "wait_s"), [(1, 1.2, 0.8), (4, 1.1, 0.0)])
def test_rests_in_which_a_joint_creeps_on_are_none_of_the_motion(
    every: int, move_s: float, wait_s: float
) -> None:
    """They were counted: of work with many waits too much would have been left out, and none was.

    What a smoothed sign leaves there hid Stribeck friction of two thirds of the dry level; and
    where a narrow band's memory widens every stop, a belt that lacks nothing was told two bends.
    """
    since = TIME % (move_s + wait_s)
    move, wait = since < move_s, np.maximum(since - move_s, 0.0)
    turn = np.where(move, 2.0 * np.pi * since / move_s, 0.0)
    way = np.where(TIME % (8.0 * (move_s + wait_s)) < 4.0 * (move_s + wait_s), 1.0, -1.0)
    creep = 0.4 * np.exp(-wait / 0.3)
    speed = np.where(move, 0.5 * FASTEST * (1.0 - np.cos(turn)) + 0.4, creep)
    rate = np.where(move, 0.5 * FASTEST * np.sin(turn) * 2.0 * np.pi / move_s, -creep / 0.3)
    noise = 0.01 * np.random.default_rng(5).standard_normal(TIME.shape)
    whole = {
        "time_s": TIME,
        "position_rad": np.cumsum(way * speed) * 4e-3,
        "velocity_rad_s": way * speed,
        "torque_nm": way * (0.018 * rate + 0.01 * speed) + smoothed(way * speed) + noise,
    }
    columns = {name: values[::every] for name, values in whole.items()}
    table = tabulate(TWIN, [Run.from_columns(columns, 100.0, name="work")])
    found = without_creep(table)
    left, before = (np.sqrt(np.mean(t.target_nm[t.used] ** 2)) for t in (found, table))
    assert np.count_nonzero(found.sliding) < 0.7 * np.count_nonzero(table.sliding)
    assert 1.5 * left < before
    assert left < 0.02


def test_a_joint_that_crawls_under_the_torque_that_holds_it_stands() -> None:
    """Contacts of a simulator give way a little, and its velocity has no noise to hide that."""
    phase = np.sin(0.9 * TIME)
    moving, rising = np.maximum(np.abs(phase) - 0.3, 0.0), np.sign(phase) * np.cos(0.9 * TIME)
    crawl = 0.002
    velocity = np.sign(phase) * (FASTEST * moving**2 + crawl)
    acceleration = 2.0 * FASTEST * moving * 0.9 * np.sign(phase) * rising
    held = np.where(moving > 0.0, 0.5, 0.1) * np.sign(phase)
    columns = {
        "time_s": TIME,
        "velocity_rad_s": velocity,
        "torque_nm": 0.018 * acceleration + 0.01 * velocity + held,
    }
    noisy = columns | {
        "torque_nm": columns["torque_nm"] + 0.01 * np.random.default_rng(1).normal(size=TIME.size)
    }
    table = tabulate(replace(TWIN, gear_ratio=1.0), [Run.from_columns(noisy, 1.0, name="dwells")])
    found = without_creep(table)
    assert np.count_nonzero(np.abs(table.rows["velocity_rad_s"][table.used]) < 2.0 * crawl) > 20
    assert crawl < found.creep_rad_s < 0.01 * FASTEST
    left = found.measured_nm[found.used] - found.given_nm[found.used]
    assert np.sqrt(np.mean(left**2)) < 0.012


def test_behind_a_gear_what_creeps_at_one_speed_rests_and_what_turns_slowly_does_not() -> None:
    """A hold under friction that is smooth in the speed, and a turn that goes through as slowly."""
    since = TIME % 4.0
    move = np.where(since < 3.5, np.sin(np.pi * since / 3.5) ** 2, 0.0)
    creeping = np.where(TIME % 8.0 < 4.0, 1.0, -1.0) * (10.0 * move + 0.07)
    turning = 0.5 * np.cos(2.0 * np.pi * TIME / 6.0)
    for velocity, rests in ((creeping, True), (turning, False)):
        columns = {
            "time_s": TIME,
            "position_rad": np.cumsum(velocity) * 4e-3,
            "velocity_rad_s": velocity,
            "torque_nm": 0.018 * np.gradient(velocity, 4e-3) + 0.5 * np.tanh(velocity / 0.05),
        }
        table = tabulate(TWIN, [Run.from_columns(columns, 100.0, name="pass")])
        slow = np.abs(table.rows["velocity_rad_s"][table.used]) < 0.15
        assert (int(np.count_nonzero(slow)) < 10) == rests


@pytest.mark.parametrize("reach_rad", [0.1, 0.2, 0.5, 1.0])
def test_friction_that_yields_over_a_little_of_the_stroke_is_no_creep(reach_rad: float) -> None:
    """It is over within a hundredth of the way, at low speed: it was left out, and had no name."""
    velocity = FASTEST * np.sin(1.5 * TIME) + 10.0 * np.sin(4.1 * TIME)
    acceleration = 1.5 * FASTEST * np.cos(1.5 * TIME) + 41.0 * np.cos(4.1 * TIME)
    noise = 0.01 * np.random.default_rng(3).standard_normal((2, TIME.size))
    friction, spring_rad = np.zeros(TIME.size), 0.0
    for k, step_rad in enumerate(4e-3 * velocity):
        spring_rad = min(max(spring_rad + step_rad, -reach_rad), reach_rad)
        friction[k] = 0.5 * spring_rad / reach_rad
    columns = {
        "time_s": TIME,
        "position_rad": np.cumsum(velocity) * 4e-3,
        "velocity_rad_s": velocity + noise[0],
        "torque_nm": 0.018 * acceleration + 0.01 * velocity + friction + noise[1],
    }
    assert creep_speed(tabulate(TWIN, [Run.from_columns(columns, 100.0, name="swings")])) == 0.0
