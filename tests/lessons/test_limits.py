"""Torque at a limit: the drive's, the reading's, and what only looks like one."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.answer.number_sentences import reading_sentence
from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.explain.rows.saturation import saturation_evidence
from agent.explain.rows.table import Table, tabulate
from agent.physics.twin import Twin
from tests.science.explain_plant import GEAR, Floats, Joint, record

TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)


def table_of(joint: Joint, seed: int, reported: Callable[[Floats], Floats] | None = None) -> Table:
    run = driven(joint, seed)
    if reported is not None:
        signals = run.signals
        run = replace(run, signals=replace(signals, torque_nm=reported(signals.torque_nm)))
    return tabulate(TWIN, [run])


@functools.cache
def driven(joint: Joint, seed: int) -> Run:
    return record(joint, seed, noise_nm=0.03)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_limit_in_noise_is_told_by_what_the_drive_asks_for(seed: int) -> None:
    """Its flat top is a tenth of a second long, and half of that time torque still rises to it."""
    found = saturation_evidence(table_of(Joint(limit=1.35), seed))
    assert found is not None
    low, high = found.limit_ci95_nm
    assert low <= 1.35 <= high
    assert not found.reading
    assert saturation_evidence(table_of(Joint(), seed)) is None


def test_a_reading_that_ends_is_no_limit_of_the_drive() -> None:
    """The joint keeps following its command: more torque than is reported moves it."""
    found = saturation_evidence(table_of(Joint(), 2, lambda torque: np.clip(torque, -1.2, 1.2)))
    assert found is not None
    assert found.reading
    assert found.limit_nm == pytest.approx(1.2, abs=0.01)
    said = reading_sentence(found.limit_nm, found.tops, found.missing_nm, 0.98).whole
    assert "the drive is at no limit. This explains 98 % of the mismatch." in said


def test_a_limited_speed_is_no_limited_torque() -> None:
    """Where friction in oil takes most of the torque, it is flat at the greatest speed, too."""
    oiled = table_of(Joint(viscous=0.03), 1)
    wanted = oiled.full["velocity_command_rad_s"]
    fastest = np.abs(wanted) > 0.99 * np.max(np.abs(wanted))
    # The longer it lasts, the faster the joint was to be.
    since = np.arange(wanted.shape[0]) - np.maximum.accumulate(
        np.where(fastest, 0, np.arange(wanted.shape[0]))
    )
    beyond = wanted + np.sign(wanted) * since
    asked = replace(oiled, full={**oiled.full, "velocity_command_rad_s": beyond})
    assert saturation_evidence(asked) is None


@pytest.mark.parametrize("limit", [1.3, 1.4])
def test_a_simulation_that_hardly_asks_for_more_hides_no_limit(limit: float) -> None:
    """It is off by as much elsewhere; how the drive answers its errors says what it asks for."""
    run, simulated = driven(Joint(limit=limit), 2), record(Joint(), 2, noise_nm=0.0)
    columns = {**run.columns, "torque_simulated_nm": simulated.signals.torque_nm}
    found = saturation_evidence(tabulate(TWIN, [replace(run, columns=columns)]))
    assert found is not None
    assert found.limit_nm == pytest.approx(limit, rel=0.003)


@pytest.mark.parametrize("limit", [0.8, 1.0])
def test_a_recorded_simulation_without_a_limit_shows_the_drives(limit: float) -> None:
    """Its own loop asks for more where the drive stays at its limit, and catches up otherwise."""
    runs = []
    for seed in (1, 2, 3):
        run, simulated = driven(Joint(limit=limit), seed), record(Joint(), seed, noise_nm=0.0)
        columns = {**run.columns, "torque_simulated_nm": simulated.signals.torque_nm}
        runs.append(replace(run, columns=columns))
    answer = explain(TWIN, runs[:2], runs[2:])
    assert [f.effect for f in answer.findings] == ["torque-saturation"]
    told = answer.findings[0].parameters["limit_nm"]
    assert told.ci95 is not None
    assert told.ci95[0] <= limit <= told.ci95[1]
    assert "the reading is clipped" not in answer.sentence
    assert answer.holdout is not None
    assert answer.holdout.extended.rmse_nm < 0.9 * answer.holdout.refitted.rmse_nm
