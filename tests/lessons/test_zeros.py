"""Recordings whose torque has a zero of its own each: named, and put on one zero."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.forms.zeros import OWN_ZEROS
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from tests.science.explain_joint import TWIN, Conditions, record, stair
from trajectories import SetPoints

FALL_NM, FALL_RAD_S = 0.15, 5.0
ZEROS_NM = (0.03, -0.02, 0.012, -0.035, 0.018, 0.027)
CYCLE = stair((1.5, 3, 6, 12, 30, 60), 200.0, 24.0)


def recorded(zeros_nm: Sequence[float], falls_nm: float, first: int = 0) -> list[Run]:
    """Return recordings that read another torque at rest each, of a joint whose friction falls."""
    runs = []
    for index, zero_nm in enumerate(zeros_nm, start=first):

        def missing(points: SetPoints, at: Conditions, zero_nm: float = zero_nm) -> Floats:
            del at
            velocity = points.velocity_rad_s
            faded = falls_nm * np.sign(velocity) * np.exp(-np.abs(velocity) / FALL_RAD_S)
            return np.asarray(zero_nm + faded)

        began = Conditions(started_s=100.0 * index)
        runs.append(record(CYCLE, missing, began, index, name=f"run-{index}"))
    return runs


@pytest.mark.parametrize("falls_nm", [0.0, FALL_NM])
def test_zeros_of_their_own_hide_nothing_and_are_no_load(falls_nm: float) -> None:
    answer = explain(TWIN, recorded(ZEROS_NM, falls_nm), recorded((-0.05, 0.04), falls_nm, first=6))
    zeros = next(f for f in answer.findings if f.form == OWN_ZEROS)
    assert zeros.effect == "torque-offset"
    assert {f.effect for f in answer.findings if f is not zeros} == (
        {"stribeck"} if falls_nm else set()
    )
    assert answer.verdict == "explained"
    spread = zeros.parameters["zero_spread_nm"]
    low, high = spread.ci95 or (np.inf, 0.0)
    assert low <= np.std(ZEROS_NM) <= high
    assert "another zero in each recording, by up to 35 mN m" in answer.sentence
    assert "read off the hold-out itself" in answer.reasons[0]
    assert answer.holdout is not None
    assert answer.holdout.floor_ratio < 1.08


def test_one_zero_that_all_recordings_share_is_a_constant_torque() -> None:
    answer = explain(TWIN, recorded([0.03] * 5, 0.0), recorded([0.03], 0.0, first=5))
    (finding,) = answer.findings
    assert finding.form != OWN_ZEROS
    assert {finding.effect, *(a.effect for a in finding.alternatives)} >= {"torque-offset"}


def one_way(index: int, coulomb_nm: float) -> Run:
    """Return a recording of a joint that turns one way alone, at several speeds."""
    period_s = 0.004
    time_s: Floats = np.arange(6000, dtype=np.float64) * period_s
    velocity: Floats = 35.0 + 25.0 * np.tanh(4.0 * np.sin(0.9 * time_s + index))
    torque = TWIN.inertia_kg_m2 * np.gradient(velocity, period_s)
    torque += TWIN.viscous_nm_s_per_rad * velocity + coulomb_nm
    torque += 0.02 * np.random.default_rng(index).standard_normal(time_s.size)
    columns = {
        "time_s": time_s,
        "position_rad": np.cumsum(velocity) * period_s,
        "velocity_rad_s": velocity,
        "torque_nm": torque,
    }
    return Run.from_columns(columns, TWIN.gear_ratio, name=f"run-{index}")


def test_where_a_joint_turns_one_way_a_zero_is_no_other_thing_than_friction() -> None:
    """Zeros of 19 N m beside a Coulomb friction of -17.6 N m were told of 20 mN m of wear."""
    worn = [one_way(i, TWIN.coulomb_nm * (1.0 + 0.04 * i)) for i in range(7)]
    answer = explain(TWIN, worn[:5], worn[5:])
    assert not any(f.form == OWN_ZEROS for f in answer.findings)
    assert answer.twin is None or answer.twin.coulomb_nm > 0.0
    moved = {m.parameter: m.extended.value for m in answer.moved}
    assert 0.5 * TWIN.coulomb_nm < moved["coulomb_nm"] < 2.0 * TWIN.coulomb_nm
