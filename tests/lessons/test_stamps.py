"""Rows that were sampled at one instant and stamped at another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.stamps import put_right, stamp_errors_s
from agent.explain.rows.table import tabulate
from agent.identify.result import Floats
from agent.physics.twin import Twin

TWIN = Twin("cell", 1, 100.0, inertia_kg_m2=0.01, coulomb_nm=0.5, viscous_nm_s_per_rad=0.004)
PERIOD_S = 0.008


def log(sampled_s: Floats, stamped_s: Floats, steps: float = 2.0**17) -> Run:
    """Record short moves of a rigid joint: at these times, and with those stamps."""
    late_s = 0.0006  # of the velocity: a drive's own filter
    speed = [
        40.0 * np.sin(1.1 * t) + 60.0 * np.tanh(8.0 * np.sin(2.3 * t))
        for t in (sampled_s - late_s, sampled_s)
    ]
    fine_s = np.arange(-0.1, sampled_s[-1] + 0.1, 0.0005)
    turns = 40.0 * np.sin(1.1 * fine_s) + 60.0 * np.tanh(8.0 * np.sin(2.3 * fine_s))
    angle = np.cumsum(turns) * 0.0005
    torque = TWIN.inertia_kg_m2 * np.interp(sampled_s, fine_s, np.gradient(turns, 0.0005))
    torque += 0.5 * np.sign(speed[1]) + 0.004 * speed[1]
    count = 2.0 * np.pi / steps
    columns = {
        "time_s": stamped_s,
        "position_rad": np.floor(np.interp(sampled_s, fine_s, angle) / count) * count,
        "velocity_rad_s": speed[0],
        "torque_nm": torque,
    }
    return Run.from_columns(columns, TWIN.gear_ratio, name="log")


def left_nm(run: Run) -> float:
    table = tabulate(TWIN, (run,), 12.5, align_velocity=False)
    return float(np.std(refit(table)[1][table.sliding]))


def test_a_log_on_regular_stamps_of_rows_that_were_not_regular_is_put_right() -> None:
    """A joint that lacked nothing was unexplained: 28 mN m where noise was 17."""
    rng = np.random.default_rng(3)
    even_s: Floats = np.arange(4000, dtype=np.float64) * PERIOD_S + 1.0
    uneven_s: Floats = even_s + 0.001 * rng.uniform(-1.0, 1.0, even_s.size)
    wrong = log(uneven_s, even_s)
    errors = stamp_errors_s(wrong)
    assert errors is not None
    assert np.std(errors - (even_s - uneven_s)) < 0.25 * np.std(even_s - uneven_s)
    (right, other), said = put_right((wrong, log(even_s, even_s)))
    assert other.signals.time_s is even_s
    assert said[0].startswith("the stamps of 1 of 2 recordings are off by 0.5")
    best = left_nm(other)
    assert left_nm(wrong) > 1.4 * best
    assert left_nm(right) < 1.04 * best


@pytest.mark.parametrize("steps", [2.0**12, 2.0**20])
def test_right_stamps_stay_however_uneven_and_coarse_the_encoder(steps: float) -> None:
    rng = np.random.default_rng(4)
    even_s: Floats = np.arange(4000, dtype=np.float64) * PERIOD_S + 1.0
    uneven_s: Floats = even_s + 0.001 * rng.uniform(-1.0, 1.0, even_s.size)
    for own_s in (even_s, uneven_s):
        run = log(own_s, own_s, steps)
        assert put_right((run,)) == ((run,), ())
    blind = replace(run, signals=replace(run.signals, position_rad=None))
    assert stamp_errors_s(blind) is None


def test_missing_rows_do_not_say_how_late_a_velocity_is() -> None:
    """Across 0.15 s the speed changes much: stamps were "put right" by three times their error."""
    rng = np.random.default_rng(5)
    even_s: Floats = np.arange(4000, dtype=np.float64) * PERIOD_S + 1.0
    uneven_s: Floats = even_s + 0.0006 * rng.uniform(-1.0, 1.0, even_s.size)
    there = np.ones(even_s.size, dtype=np.bool_)
    for first in (230, 700, 1900, 3100):
        there[first : first + 19] = False
    wrong = log(uneven_s[there], even_s[there])
    errors = stamp_errors_s(wrong)
    assert errors is not None
    true_s = (even_s - uneven_s)[there]
    assert np.std(errors - true_s) < 0.4 * np.std(true_s)


def without_velocity(run: Run) -> Run:
    return replace(run, signals=replace(run.signals, velocity_rad_s=None))


def test_without_a_velocity_rows_that_moved_evenly_were_sampled_so() -> None:
    """Every row is stamped when a busy computer gets round to it."""
    even_s: Floats = np.arange(4000, dtype=np.float64) * PERIOD_S + 1.0
    late_s = np.random.default_rng(5).exponential(0.0015, even_s.size)
    wrong, best = (without_velocity(log(even_s, own)) for own in (np.sort(even_s + late_s), even_s))
    (right,), said = put_right((wrong,))
    assert said[0].startswith("the stamps are off by 1.")
    assert np.ptp(np.diff(right.signals.time_s)) < 1e-9
    assert left_nm(right) < 1.02 * left_nm(best)


@pytest.mark.parametrize("share", [0.01, 0.06])
def test_without_a_velocity_stamps_that_vary_by_little_are_the_instants(share: float) -> None:
    """They had counted as even: a position of 300 times the encoder's noise, differentiated."""
    even_s: Floats = np.arange(4000, dtype=np.float64) * PERIOD_S + 1.0
    shaken_s = even_s + np.random.default_rng(6).normal(0.0, share * PERIOD_S, even_s.size)
    own, even = (without_velocity(log(at, at, 2.0**20)) for at in (shaken_s, even_s))
    assert put_right((own,)) == ((own,), ())
    assert left_nm(own) < 1.03 * left_nm(even)
    taken_for_even = replace(own, signals=replace(own.signals, time_s=even_s))
    assert left_nm(taken_for_even) > 1.2 * left_nm(even)


def test_stamps_of_a_fast_log_are_put_right_by_how_products_scatter() -> None:
    """Fast rows' scatter, told as noise at rest, left more than half of every stamp's error."""
    rng = np.random.default_rng(6)
    even_s: Floats = np.arange(12000, dtype=np.float64) * 0.002 + 1.0
    uneven_s: Floats = even_s + 0.0003 * rng.standard_normal(even_s.size)
    errors = stamp_errors_s(log(uneven_s, even_s, 2.0**19))
    assert errors is not None
    assert np.std(errors - (even_s - uneven_s)) < 0.15 * np.std(even_s - uneven_s)
