"""A gear ratio that is wrong in recordings and twin alike: the arm's weight tells."""

from __future__ import annotations

from dataclasses import replace

import pytest

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.physics.twin import Twin
from agent.report.explanation.head import head_of
from tests.science.explain_plant import GEAR, Joint, record
from tests.science.textbook_joint import TWIN as BENCH
from tests.science.textbook_joint import nothing, stair
from tests.science.textbook_joint import recorded as bench

RECORDED = ("time_s", "position_rad", "velocity_rad_s", "torque_nm")
SPEEDS_RAD_S = (4.0, 8.0, 15.0, 28.0, 40.0)
HEAVY = Joint(gravity_sin=1.0, gravity_cos=0.2)


def recorded(seed: int, gear_ratio: float) -> Run:
    """Return a recording in whose head another gear ratio stands."""
    run = record(HEAVY, seed)
    columns = {name: getattr(run.signals, name) for name in RECORDED}
    return Run.from_columns(columns, gear_ratio, name=run.name, started_s=run.started_s)


@pytest.mark.parametrize(("gear_ratio", "said"), [(120.0, True), (GEAR, False)])
def test_a_weight_that_goes_as_behind_another_gear_says_so_first(
    gear_ratio: float, said: bool
) -> None:
    """Gravity of another size, and bumps, each for certain; the ratio was in no answer."""
    twin = Twin("plant", 1, gear_ratio, 0.006, 0.5, 0.004, 1.0, 0.2)
    runs = [recorded(seed, gear_ratio) for seed in range(4)]
    answer = explain(twin, runs[:3], runs[3:])
    first = head_of(answer).first
    assert ("behind a gear of 100.0 to one, and not of 120" in first) is said
    assert first in answer.sentence or not said
    if said:  # which is as likely as all that is named, and looked at without driving
        assert all(finding.probability <= 0.5 for finding in answer.findings)
        assert answer.next_experiment is None


def test_a_heavier_load_is_no_other_gear() -> None:
    """On a short stroke a sine that is a tenth larger goes much as one behind another gear."""
    known = replace(BENCH, gravity_sin_nm=0.9, gravity_cos_nm=0.0)
    loaded = replace(known, gravity_sin_nm=1.1 * 0.9)
    *runs, held_out = (
        bench(stair([k * v for v in SPEEDS_RAD_S]), nothing, 0.2, seed, loaded)
        for seed, k in enumerate((1.0, 1.07, 1.15, 0.93))
    )
    answer = explain(known, runs, [held_out])
    assert "behind a gear" not in answer.sentence
    assert [finding.effect for finding in answer.findings] == ["gravity-imbalance"]
