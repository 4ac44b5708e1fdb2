"""A real reducer that warms up and runs in at once: what the first cycles say of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from agent.monitor.baseline.first_cycles import running_in, watch_of
from agent.monitor.compensation.compensation import Conditions
from agent.monitor.detection.cusum import DECIDING
from agent.monitor.detection.detectors import detector
from agent.monitor.detection.series import State
from agent.monitor.history.table import Features

REVERSAL_S = 240.0


def test_a_fall_that_warming_explains_as_well_is_not_called_running_in(
    real_recordings: Path,
) -> None:
    """Friction falls by 15 % over 80 minutes while the gear warms by 14 degrees: a tie."""
    table = pq.read_table(real_recordings / "cycloidal-run-in" / "baseline.parquet")
    time_s, velocity, torque, degc = (
        np.asarray(table[name].to_numpy(), dtype=np.float64)
        for name in ("time_s", "velocity_rad_s", "torque_nm", "motor_temperature_degc")
    )
    friction, warmth = [], []
    for turn in range(int(time_s[-1] // REVERSAL_S)):
        now = time_s // REVERSAL_S == turn
        ends = [float(np.median(torque[now & (s * velocity > 0.0)])) for s in (1.0, -1.0)]
        friction.append(0.5 * (ends[0] - ends[1]))
        warmth.append(float(np.mean(degc[now])))
    values, unknown = np.array(friction), np.full(len(friction), np.nan)
    steady = np.full(len(friction), 50.0)
    at_s = REVERSAL_S * np.arange(values.size, dtype=np.float64)

    def told(temperature: bool) -> Features:
        conditions = Conditions(np.array(warmth) if temperature else steady, unknown, unknown)
        return Features({DECIDING: values}, {DECIDING: 0.005 * values}, conditions)

    assert running_in(told(True), at_s, detector()) is None
    fall = running_in(told(False), at_s, detector())
    assert fall is not None
    assert -0.25 <= fall.value <= -0.1
    for temperature in (True, False):
        watch = watch_of(told(temperature), at_s, detector())
        assert watch is not None
        assert watch.alone("cusum").first(State.INCREASED) is None
