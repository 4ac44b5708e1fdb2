"""A recording that begins in motion: how an arm behind a soft gear swings then nobody knows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.caveats import left_out_of_the_proof
from agent.explain.explain import explain
from agent.explain.proof import apart_from_unknown_beginnings
from agent.explain.rows.beginnings import begun
from agent.explain.rows.forgetting import forgetting
from agent.explain.rows.run import Run
from agent.explain.rows.table import tabulate
from agent.physics.twin import Effect, Twin
from tests.science.explain_plant import GEAR, RATE_HZ, Joint, record, waves

TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)
RECORDED = ("position_rad", "velocity_rad_s", "torque_nm")
SOFT = Joint(stiffness=11.8, damping=0.019, arm_coulomb=0.0, motor_coulomb=0.5)


def recorded(seed: int, begins_s: float) -> Run:
    """Return a recording that begins so long after the motion: its arm swings already."""
    run = record(SOFT, seed, command=waves(seed, 20.0 + begins_s))
    first = round(begins_s * RATE_HZ)
    columns = {"time_s": run.signals.time_s - begins_s}
    columns |= {name: getattr(run.signals, name) for name in RECORDED}
    kept = {name: values[first:] for name, values in columns.items()}
    return Run.from_columns(kept, GEAR, name=run.name, started_s=run.started_s)


@pytest.mark.parametrize("begins_s", [0.0, 2.5])
def test_a_soft_gear_is_no_less_one_for_how_it_swings_at_first(begins_s: float) -> None:
    """The written twin began otherwise, or a search that began so ended elsewhere."""
    runs = [recorded(seed, begins_s) for seed in range(4)]
    answer = explain(TWIN, runs[:3], runs[3:])
    assert [finding.effect for finding in answer.findings] == ["joint-flexibility"]
    found = answer.findings[0].parameters
    assert found["arm_inertia_kg_m2"].value == pytest.approx(SOFT.arm_inertia, rel=0.03)
    assert found["stiffness_nm_per_rad"].value == pytest.approx(SOFT.stiffness, rel=0.03)
    assert answer.holdout is not None
    assert answer.holdout.extended.rmse_nm < 0.3 * answer.holdout.refitted.rmse_nm


@pytest.mark.parametrize("times", [1.0, 10.0])
def test_how_a_held_out_recording_begins_denies_no_soft_gear(times: float) -> None:
    """Of an arm that set off with a jump it was said to hold something that the others do not."""
    numbers = {
        "arm_inertia_kg_m2": SOFT.arm_inertia,
        "stiffness_nm_per_rad": SOFT.stiffness,
        "damping_nm_s_per_rad": SOFT.damping,
    }
    soft = replace(TWIN, effects=(Effect("joint-flexibility", numbers),))
    arm, table = forgetting(soft), tabulate(TWIN, [recorded(3, 0.0)], 30.0)
    assert arm is not None
    left_nm = np.where(begun(table, arm), times, 1.0) * 0.01
    proven = apart_from_unknown_beginnings(table, soft, left_nm)
    assert (proven.arm_forgets is not None) is (times > 2.0)
    assert bool(proven.used.sum() < table.used.sum()) is (times > 2.0)
    assert bool(left_out_of_the_proof(proven, table)) is (times > 2.0)
