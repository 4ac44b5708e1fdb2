"""Friction from ordinary work: right where it is given, and not given where nothing carries it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from agent.identify.estimate import estimate
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import Motion, read_motion
from agent.identify.uncertainty import student_975
from agent.monitor.ordinary.ordinary import compare, ordinary_friction
from agent.monitor.ordinary.swinging import swinging_of
from fakes.history import CycleRun, HistoryPlan, Wear, Worker, cycles, ordinary_runs
from tests.benchmarks.ordinary import softened

PLAN = HistoryPlan(cycles=6, seed=2, repeatability=0.0, load_friction=0.0)
GEAR = PLAN.joint.gear_ratio


def motion(run: CycleRun) -> Motion:
    return read_motion(Signals.from_columns(run.columns, GEAR, name=run.name))


def test_friction_is_recovered_and_its_intervals_hold() -> None:
    inside, off = [], []
    for run in ordinary_runs(PLAN):
        found = ordinary_friction([motion(run)])
        if not found.decidable:
            continue
        law = PLAN.joint.friction.truth(run.label["gearbox_degc"])
        truth = np.array([law.torque_nm(v) for v in found.speed_rad_s])
        reach = student_975(found.dof) * found.deviation_nm
        inside += (np.abs(found.friction_nm - truth) <= reach).tolist()
        off += ((found.friction_nm - truth) / truth).tolist()
        inertia = found.parameter("inertia_kg_m2")
        assert inertia.value == pytest.approx(PLAN.joint.inertia_kg_m2, rel=0.01)
    assert len(inside) >= 12
    assert np.mean(inside) >= 0.75  # 95 % each; below 12 of 15 has a chance of 1 in 1000
    assert np.sqrt(np.mean(np.square(off))) < 0.03


def test_more_work_makes_more_of_the_speeds_known() -> None:
    runs = [motion(r) for r in ordinary_runs(PLAN)]
    few, many = ordinary_friction(runs[:1]), ordinary_friction(runs)
    assert many.decidable
    assert many.speed_rad_s.size >= few.speed_rad_s.size


def test_it_agrees_with_the_dedicated_cycle_of_its_night_and_not_with_that_of_a_worn_joint() -> (
    None
):
    worn = HistoryPlan(
        cycles=1,
        seed=2,
        load_friction=0.0,
        events=(Wear(-60.0, low_speed_nm=0.0, everywhere_nm=0.2),),
    )
    found = ordinary_friction([motion(next(ordinary_runs(PLAN)))])
    curves = [
        estimate([Signals.from_columns(next(cycles(p)).columns, GEAR)]).friction_curve
        for p in (PLAN, worn)
    ]
    assert curves[0] is not None
    assert curves[1] is not None
    healthy, other = (compare(found, c) for c in curves if c is not None)
    assert healthy.agrees
    assert not other.agrees
    assert np.median(other.difference_nm) == pytest.approx(-0.2, abs=0.05)


def reasons_of(run: CycleRun) -> Sequence[str]:
    found = ordinary_friction([motion(run)])
    assert not found.decidable
    assert found.friction_nm.size == 0
    assert not found.parameter("coulomb_nm").identified
    return found.reasons


def test_work_at_one_speed_or_one_way_is_not_decidable_and_says_why() -> None:
    run = next(ordinary_runs(PLAN))
    velocity = run.columns["velocity_rad_s"]
    n = velocity.size
    steady = {**run.columns, "velocity_rad_s": 80.0 + 0.05 * velocity / np.abs(velocity).max()}
    steady["position_rad"] = 80.0 * steady["time_s"]
    one_speed = CycleRun("one", steady, run.metadata, run.label)
    assert any("ratio" in r for r in reasons_of(one_speed))
    forward = velocity > 1.0
    kept = {k: v[forward] for k, v in run.columns.items()}
    one_way = CycleRun("way", kept, run.metadata, run.label)
    assert any("rarer direction" in r for r in reasons_of(one_way))
    assert n > 1000


def test_a_log_at_one_hertz_is_not_decidable() -> None:
    run = next(ordinary_runs(PLAN, Worker(moves=60)))
    slow = {name: values[::200] for name, values in run.columns.items()}
    assert any("too slow" in r for r in reasons_of(CycleRun("log", slow, run.metadata, run.label)))


@pytest.mark.parametrize(
    ("hz", "bearable"), [(3.0, False), (4.0, False), (6.0, False), (9.0, True)]
)
def test_an_arm_that_swings_slowly_is_not_decidable_and_its_frequency_is_named(
    hz: float, bearable: bool
) -> None:
    run = softened(next(ordinary_runs(PLAN)), hz, PLAN.joint.inertia_kg_m2)
    found = swinging_of([motion(run)])
    assert found is not None
    assert found.frequency_hz == pytest.approx(hz, rel=0.2)
    assert not found.refusal if bearable else "the arm swings" in found.refusal
    if not bearable:
        assert any("soft gear" in r for r in reasons_of(run))


def test_a_rigid_joint_shows_no_swinging_in_any_of_its_work() -> None:
    for run in ordinary_runs(PLAN):
        found = swinging_of([motion(run)])
        assert found is None or found.explained < 0.2
