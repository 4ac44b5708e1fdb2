"""Rows that were sampled at one instant and stamped at another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.rows.run import Run
from agent.explain.rows.scene import refit
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
