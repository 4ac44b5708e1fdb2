"""What drives the arm behind a gap goes the motor's way, where the position is known well."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.rows.run import Run
from agent.explain.rows.table import tabulate
from agent.identify.result import Floats
from agent.physics.twin import Twin

TWIN = Twin("plant", 1, 100.0, 0.006, 0.5, 0.004, 0.0, 0.0)
PERIOD_S, FLIGHT = 0.002, 25  # samples: 50 ms, for which teeth are apart
TIME_S = PERIOD_S * np.arange(15_000)
SPEED = 20.0 * np.sin(2.0 * np.pi * 0.4 * TIME_S) + 10.0 * np.sin(2.0 * np.pi * 1.3 * TIME_S)
WAY = np.concatenate(([0.0], np.cumsum(0.5 * (SPEED[1:] + SPEED[:-1]) * PERIOD_S)))


def astray_rad(step_rad: float, late_s: float = 0.0, lost: slice = slice(0)) -> tuple[Floats, ...]:
    """Return by how much two velocities go astray in the time of a flight: reported, driving."""
    rng = np.random.default_rng(5)
    reported = np.interp(TIME_S - late_s, TIME_S, SPEED) + 0.02 * rng.standard_normal(TIME_S.size)
    position = WAY + rng.uniform(-0.5, 0.5, TIME_S.size) * step_rad
    torque = 0.5 * np.sign(SPEED) + 0.006 * np.gradient(SPEED, PERIOD_S)
    torque = torque + 0.01 * rng.standard_normal(TIME_S.size)
    kept = np.ones(TIME_S.size, dtype=bool)
    kept[lost] = False
    columns = {
        "time_s": TIME_S[kept],
        "position_rad": position[kept],
        "velocity_rad_s": reported[kept],
        "torque_nm": torque[kept],
    }
    table = tabulate(TWIN, [Run.from_columns(columns, 100.0, name="a")], align_velocity=False)
    true = np.interp(TIME_S - late_s, TIME_S, SPEED)
    out = []
    for name in ("velocity_raw_rad_s", "velocity_driving_rad_s"):
        short = PERIOD_S * np.cumsum(table.full[name] - true)
        inner = short[500:-500]  # the low-pass has no neighbours at the ends
        out.append(inner[FLIGHT:] - inner[:-FLIGHT])
    return tuple(out)


@pytest.mark.parametrize("late_s", [0.0, 0.001])
def test_a_noisy_velocity_is_kept_to_a_fine_position_as_late_as_it_is(late_s: float) -> None:
    reported, driving = astray_rad(2e-5, late_s)
    assert np.std(reported) == pytest.approx(2e-4, rel=0.2)
    assert np.std(driving) < 0.25 * np.std(reported)


def test_a_coarse_position_leaves_the_velocity_what_it_is() -> None:
    reported, driving = astray_rad(1e-2)
    assert np.std(driving) < 1.05 * np.std(reported)


def test_lost_samples_are_bridged_by_what_the_velocity_lacks_and_not_by_the_position() -> None:
    """A straight line over 8 ms of hard acceleration is a milliradian beside the way."""
    _, driving = astray_rad(2e-5, lost=slice(5000, 5003))
    assert np.max(np.abs(driving)) < 5e-4
