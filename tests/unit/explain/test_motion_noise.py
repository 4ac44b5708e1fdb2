"""Noise that is read off a motion, of a velocity that is reported in steps."""

from __future__ import annotations

import numpy as np

from agent.explain.rows.motion_noise import drawn_noise_rad_s
from agent.explain.rows.run import Run
from agent.explain.rows.table import tabulate
from agent.physics.twin import Twin

TWIN = Twin("r", 1, 100.0, 0.018, 0.5, 0.01)


def test_a_velocity_that_mostly_stands_still_in_its_steps_has_finite_noise() -> None:
    """Most of its segments have no power at all, by which all were divided (exit code 70)."""
    time = np.arange(0.0, 30.0, 2e-3)
    speed = np.where((time > 20.0) & (time < 26.0), 40.0 * np.sin(3.0 * (time - 20.0)), 0.0)
    step = 0.1 * 2.0 * np.pi / 60.0
    columns = {
        "time_s": time,
        "position_rad": np.cumsum(speed) * 2e-3,
        "velocity_rad_s": step * np.round(speed / step),
        "torque_nm": 0.5 * np.sign(speed) + 0.01 * np.random.default_rng(0).standard_normal(15000),
    }
    table = tabulate(TWIN, [Run.from_columns(columns, 100.0, name="steps")], 40.0)
    drawn = drawn_noise_rad_s(table, np.random.default_rng(1))
    assert np.isfinite(drawn).all()
    assert float(np.std(drawn)) < step
