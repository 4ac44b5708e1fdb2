"""An arm behind a soft gear: samples are lost while it swings, and nobody knows where it began."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.physics.twin import Twin
from tests.science.explain_plant import GEAR, Joint, record

SOFT = Joint(stiffness=8.0, damping=0.03)
TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)
LOST = 6  # samples, every two seconds or so


def with_samples_lost(run: Run, seed: int) -> Run:
    """Return a recording as a busy bus leaves it."""
    rng = np.random.default_rng(seed)
    signals = run.signals
    starts = rng.choice(signals.time_s.shape[0] - LOST, signals.time_s.shape[0] // 1000)
    kept = np.ones(signals.time_s.shape[0], dtype=np.bool_)
    for start in starts:
        kept[start : start + LOST] = False
    assert signals.position_rad is not None
    assert signals.velocity_rad_s is not None
    columns = {
        "time_s": signals.time_s[kept],
        "position_rad": signals.position_rad[kept],
        "velocity_rad_s": signals.velocity_rad_s[kept],
        "torque_nm": signals.torque_nm[kept],
    }
    return replace(
        Run.from_columns(columns, GEAR, name=run.name, started_s=run.started_s), columns=run.columns
    )


@pytest.mark.parametrize("lost", [False, True])
def test_a_soft_gear_has_its_spring_though_the_arm_begins_anywhere(lost: bool) -> None:
    runs = [record(SOFT, seed) for seed in range(1, 6)]
    if lost:
        runs = [with_samples_lost(run, seed) for seed, run in enumerate(runs)]
    answer = explain(TWIN, runs[:4], runs[4:])
    (found,) = answer.findings
    assert found.effect == "joint-flexibility"
    assert found.parameters["stiffness_nm_per_rad"].value == pytest.approx(8.0, rel=0.08)
    assert answer.holdout is not None
    assert answer.holdout.floor_ratio < 1.7  # begun anew at every gap 2.6
