"""Corners of a speed wherever a recording begins and ends."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.rows.corners import with_corners
from agent.explain.rows.run import CORNERS, Run
from tests.science.textbook_joint import nothing, recorded, steps


@pytest.mark.parametrize("has_velocity", [True, False])
def test_a_recording_may_begin_and_end_beside_a_corner_or_in_a_short_ramp(
    has_velocity: bool,
) -> None:
    driven = steps([3.0, 6.0, 40.0, -5.0, -2.0, 20.0], acceleration_rad_s2=300.0, rate_hz=250.0)
    signals = recorded(driven, nothing, 0.001, 0).signals
    assert signals.position_rad is not None
    assert signals.velocity_rad_s is not None
    told = 0
    for cut in range(1, 30):
        columns = {
            "time_s": signals.time_s,
            "torque_nm": signals.torque_nm,
            "position_rad": signals.position_rad,
        }
        if has_velocity:
            columns["velocity_rad_s"] = signals.velocity_rad_s
        # Ends run over the last ramps, beginnings over the first.
        kept = {name: values[80 - cut : 2320 - cut * 17] for name, values in columns.items()}
        (run,) = with_corners([Run.from_columns(kept, 50.0, name="cut")])
        found = run.columns.get(CORNERS)
        told += found is not None and bool(np.isfinite(found).all())
    assert told > 20
