"""What happens once is where it happened, and the simulation that fits all else stays as it is."""

from __future__ import annotations

import numpy as np

from agent.explain.explain import explain
from agent.identify.result import Floats
from tests.science.explain_joint import TWIN, Conditions, nothing, record, stair
from trajectories import SetPoints

CYCLE = stair((3, 10, 30, 60), 200.0, 20.0)


def dragging(points: SetPoints, at: Conditions) -> Floats:
    """Return a brake that drags in the middle of a recording."""
    del at
    time_s = np.linspace(0.0, CYCLE.duration_s, points.velocity_rad_s.shape[0])
    drags = np.abs(time_s - 0.4 * CYCLE.duration_s) < 3.0
    return np.where(drags, 0.3 * np.sign(points.velocity_rad_s), 0.0)


def test_a_brake_that_dragged_once_is_told_where_it_did() -> None:
    """It was ten spells in three recordings: the refitted friction was off in all of them."""
    missing = (nothing, nothing, dragging, nothing)
    runs = [
        record(CYCLE, each, Conditions(started_s=100.0 * k), k, name=f"run-{k}")
        for k, each in enumerate(missing)
    ]
    answer = explain(TWIN, runs, [record(CYCLE, nothing, Conditions(started_s=900.0), 9)])
    assert answer.verdict == "unexplained"
    assert answer.unexplained_spells is not None
    assert {name for name, _, _ in answer.unexplained_spells.at} == {"run-2"}
    assert answer.twin is not None
    assert answer.twin.coulomb_nm == TWIN.coulomb_nm
    assert answer.holdout is not None
    assert answer.holdout.floor_ratio < 1.2
