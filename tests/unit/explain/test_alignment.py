"""With which channel the torque is in step is found beside a large mismatch of another kind."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from agent.explain.rows.lag import lag_of
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.table import tabulate
from agent.physics.twin import Twin

Floats = NDArray[np.float64]

TIME = np.arange(0.0, 24.0, 4e-3)
TWIN = Twin("r", 1, 100.0, 0.018, 0.5, 0.01)
LATE_S = 5e-4


def speed(time: Floats) -> Floats:
    """Return a rounded stair in both directions, rad/s."""
    waves = 40.0 * np.sin(0.7 * time) + 15.0 * np.sin(3.1 * time) + 3.0 * np.sin(17.0 * time)
    return np.asarray(waves)


def run(
    viscous: float,
    *,
    with_position: bool,
    seed: int,
    late_s: float = 0.0,
    velocity_late_s: float = LATE_S,
) -> Run:
    """Return a run in which the reported velocity is late, the torque in step with either.

    Or the torque is later still by `late_s`.
    """
    rng = np.random.default_rng(seed)
    late = speed(TIME - velocity_late_s)
    own = (TIME if with_position else TIME - velocity_late_s) - late_s
    fine = 1e-5
    acceleration = (speed(own + fine) - speed(own - fine)) / (2.0 * fine)
    torque = 0.018 * acceleration + viscous * speed(own) + 0.5 * np.sign(speed(own))
    position = -40.0 / 0.7 * np.cos(0.7 * TIME) - 15.0 / 3.1 * np.cos(3.1 * TIME)
    position = position - 3.0 / 17.0 * np.cos(17.0 * TIME)
    return Run.from_columns(
        {
            "time_s": TIME,
            "position_rad": position,
            "velocity_rad_s": late + 0.01 * rng.standard_normal(TIME.shape),
            "torque_nm": torque + 0.02 * rng.standard_normal(TIME.shape),
        },
        100.0,
        name=f"run-{seed}",
    )


@pytest.mark.parametrize("with_position", [True, False])
def test_the_torque_decides_in_which_step_the_velocity_is_taken(*, with_position: bool) -> None:
    runs = [run(0.016, with_position=with_position, seed=1)]
    runs.append(run(0.006, with_position=with_position, seed=2))
    assert tabulate(TWIN, runs).aligned is with_position


@pytest.mark.parametrize("late_s", [-10.0 * LATE_S, 10.0 * LATE_S])
def test_a_torque_that_is_late_by_itself_tells_nothing_of_the_velocity(late_s: float) -> None:
    runs = [run(0.01, with_position=False, seed=seed, late_s=late_s) for seed in (1, 2)]
    assert not tabulate(TWIN, runs).aligned


def test_a_velocity_that_is_late_by_more_than_a_sample_is_left_to_be_named() -> None:
    runs = [run(0.01, with_position=True, seed=seed, velocity_late_s=8e-3) for seed in (1, 2)]
    assert not tabulate(TWIN, runs).aligned


@pytest.mark.parametrize("filtered", [False, True])
def test_a_filter_takes_of_a_swing_what_a_delay_does_not(*, filtered: bool) -> None:
    period_s, lag_s, band_hz, turn = 2e-3, 1.2e-3, 40.0, 2.0 * np.pi * np.array([1.0, 9.0, 16.0])
    time = np.arange(0.0, 20.0, period_s)[:, np.newaxis]
    reported = np.exp(1j * turn * time) / (1.0 + 1j * turn * lag_s)
    if not filtered:
        reported = np.exp(1j * turn * (time - lag_s))
    velocity, true = reported.real.sum(axis=1), np.cos(turn * time).sum(axis=1)
    lag = lag_of(velocity, (np.sin(turn * time) / turn).sum(axis=1), period_s, band_hz)
    assert lag.late_s == pytest.approx(lag_s, rel=0.02)
    assert lag.bend_s2 == pytest.approx(-0.5 * lag_s**2 * filtered, abs=0.03 * lag_s**2)
    inner = slice(300, -300)  # the filter's ends aside
    left = (lag.undone(velocity, period_s, band_hz) - true)[inner]
    assert np.abs(left).max() < 0.1 * np.abs(velocity - true)[inner].max()


def test_a_derived_velocity_follows_sharp_motion_as_far_as_the_band_reaches() -> None:
    """What it misses of the acceleration would be an arm that does not follow: a soft gear."""
    time, turn, inertia = np.arange(0.0, 30.0, 4e-3), 2.0 * np.pi * 15.0, TWIN.inertia_kg_m2
    shaken = 0.1 * np.sin(turn * time)
    columns = {
        "time_s": time,
        "position_rad": 60.0 * time + 80.0 * np.sin(0.5 * time) + shaken,
        "torque_nm": -inertia * (20.0 * np.sin(0.5 * time) + turn**2 * shaken),
    }
    table = tabulate(TWIN, [Run.from_columns(columns, 100.0, name="shaken")], 25.0)
    moved, _ = refit(table)
    assert table.carried[0]
    assert moved[0] == pytest.approx(0.0, abs=3e-3 * inertia)


def test_an_encoders_steps_stay_below_the_torques_own_noise_in_the_band() -> None:
    """Else the acceleration's noise is what is left of the torque, and any soft arm filters it."""
    time, inertia, noise_nm, step = np.arange(0.0, 30.0, 2e-3), 0.018, 0.02, 2.0 * np.pi / 2**12
    rng = np.random.default_rng(7)
    columns = {
        "time_s": time,
        "position_rad": step * np.round(60.0 * np.sin(0.5 * time) / step),
        "torque_nm": noise_nm * rng.standard_normal(time.shape),
    }
    table = tabulate(TWIN, [Run.from_columns(columns, 100.0, name="steps")])
    torque = np.std(table.measured_nm[table.used])
    known = table.band(-15.0 * np.sin(0.5 * time))
    shaken = inertia * np.std((table.base[:, 0] - known)[table.used])
    assert 0.3 * torque < shaken < 0.6 * torque
