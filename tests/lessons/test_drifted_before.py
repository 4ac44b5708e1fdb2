"""Friction that had begun to drift before anybody recorded it, and a number that is wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from tests.science.explain_joint import TWIN, Conditions, record, stair
from trajectories import SetPoints

_BEFORE_NM, _GROWS_NM, _SECONDS = 0.06, 0.1, 3000.0
_RUNS_IN = ((0.15, 900.0), (0.10, 7200.0))


def worn(points: SetPoints, at: Conditions) -> Floats:
    """Return friction that grows by the hour, and had by more than half as much already."""
    level = _BEFORE_NM + _GROWS_NM * at.started_s / _SECONDS
    return np.asarray(level * np.sign(points.velocity_rad_s))


def running_in(points: SetPoints, at: Conditions) -> Floats:
    """Return friction that falls quickly, and slowly for longer than it was recorded."""
    level = sum(nm * np.exp(-at.started_s / settles_s) for nm, settles_s in _RUNS_IN)
    return np.asarray(level * np.sign(points.velocity_rad_s))


def without_thermometer(run: Run) -> Run:
    columns = {n: x for n, x in run.columns.items() if n != "gearbox_temperature_degc"}
    return replace(run, columns=columns)


@pytest.mark.parametrize(("coulomb_nm", "wrong"), [(0.5, False), (0.3, True)])
@pytest.mark.parametrize("changes", [worn, running_in])
def test_a_drift_may_have_begun_before_it_was_recorded_and_a_run_in_end_after(
    changes: Callable[[SetPoints, Conditions], Floats], coulomb_nm: float, wrong: bool
) -> None:
    """It had been two findings: a wrong level, the twin's when new or run in, and a drift."""
    cycle = stair([8.0, 20.0, 45.0, 80.0])
    starts = np.linspace(0.0, _SECONDS, 6)
    runs = [
        record(cycle, changes, Conditions(started_s=at), seed, name=f"run {seed}")
        for seed, at in enumerate(starts.tolist())
    ]
    answer = explain(replace(TWIN, coulomb_nm=coulomb_nm), [*runs[:3], *runs[4:]], [runs[3]])
    effects = [finding.effect for finding in answer.findings]
    assert "friction-drift" in effects
    assert ("wrong-number" in effects) is wrong
    assert len(effects) == 1 + wrong


def test_a_drift_that_another_day_denies_is_not_proven() -> None:
    """It had been explained, for certain: the hold-out "said nothing", and parts stood in for it.

    Nobody had recorded how warm the gear was.
    """

    def warms_up(points: SetPoints, at: Conditions) -> Floats:
        falls_nm = -0.06 * at.started_s / 600.0 if at.started_s < 5000.0 else -0.1
        return np.asarray(falls_nm * np.sign(points.velocity_rad_s))

    cycle = stair([8.0, 20.0, 45.0, 80.0])
    morning, next_day = (0.0, 600.0, 1200.0, 1800.0, 2400.0), 86400.0
    *runs, unseen = (
        without_thermometer(
            record(cycle, warms_up, Conditions(started_s=at), seed, name=f"run {seed}")
        )
        for seed, at in enumerate((*morning, next_day))
    )
    answer = explain(TWIN, runs, [unseen])
    assert answer.verdict == "partly-explained"
    assert "drift cannot have gone on" in answer.sentence
    assert any("no gearbox temperature was recorded" in said for said in answer.reasons)
