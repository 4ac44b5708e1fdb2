"""Recordings that go much further than the first one decide what was asked, and ask nothing new."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.explain.findings import findings_of
from agent.explain.rows.table import tabulate
from agent.explain.rows.usual import usual_rows
from agent.explain.study import study
from agent.identify.result import Floats
from tests.science.explain_joint import GEAR_RATIO, TWIN, Conditions, record, stair
from trajectories import SetPoints

OFFSET_NM, HOSE_NM_PER_ARM_RAD = 0.03, 0.02


def missing(points: SetPoints, at: Conditions) -> Floats:
    """Return an offset, and a hose: a fifth of it on the short stroke, and twice it later."""
    del at
    return OFFSET_NM + HOSE_NM_PER_ARM_RAD * points.position_rad / GEAR_RATIO


def test_an_offset_stays_the_answer_where_a_longer_stroke_strains_a_hose() -> None:
    short, far = stair((2.0, 6.0, 20.0, 50.0), 60.0), stair((20.0, 50.0), 500.0)
    runs = [
        record(path, missing, Conditions(started_s=3600.0 * k), k)
        for k, path in enumerate((short, far))
    ]
    table = tabulate(TWIN, runs)
    found = findings_of(study(TWIN, table))
    assert found[0].effect in ("torque-offset", "direction-asymmetry")
    assert found[0].energy_share > 0.8
    assert np.array_equal(usual_rows(table, np.arange(table.run.shape[0])), table.run == 0)
    # Where the short stroke comes after it, the long one is part of what the joint does.
    again = replace(runs[0], signals=replace(runs[0].signals, name="again"), started_s=9e3)
    table = tabulate(TWIN, [*runs, again])
    assert usual_rows(table, np.arange(table.run.shape[0])).all()
