"""A torque constant that falls as the magnets warm, of a simulation that has it cold."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from tests.science.explain_joint import TWIN, Conditions, nothing, record, stair

_COLD_DEGC, _PER_K = 25.0, -0.001


def warm(motor_degc: float, seed: int) -> Run:
    """Return a recording whose drive takes the torque constant for that of a cold motor."""
    at = Conditions(started_s=60.0 * seed)
    run = record(stair([8.0, 20.0, 45.0, 80.0]), nothing, at, seed, name=f"run {seed}")
    reported = run.signals.torque_nm / (1.0 + _PER_K * (motor_degc - _COLD_DEGC))
    return replace(
        run,
        signals=replace(run.signals, torque_nm=reported),
        columns={**run.columns, "motor_temperature_degc": np.full(reported.shape, motor_degc)},
    )


@pytest.mark.parametrize(("twin_right", "wrong"), [(1.0, 0), (0.9, 1)])
def test_a_constant_that_was_right_cold_is_not_wrong_as_well(twin_right: float, wrong: int) -> None:
    """It had been wrong and falling; now it is so only where no warmth near makes it right."""
    runs = [warm(degc, seed) for seed, degc in enumerate((35.0, 80.0, 50.0, 95.0, 65.0, 40.0))]
    given = replace(
        TWIN,
        inertia_kg_m2=twin_right * TWIN.inertia_kg_m2,
        coulomb_nm=twin_right * TWIN.coulomb_nm,
        viscous_nm_s_per_rad=twin_right * TWIN.viscous_nm_s_per_rad,
    )
    answer = explain(given, runs[:5], runs[5:])
    assert [finding.effect for finding in answer.findings] == ["torque-constant-error"] * (
        1 + wrong
    )
    falls = answer.findings[-1].parameters["factor_per_k"].value
    assert falls == pytest.approx(_PER_K, rel=0.1)
    said = [reason for reason in answer.reasons if "right at" in reason]
    told = [float(word) for reason in said for word in re.findall(r"right at (\d+) °C", reason)]
    assert told == [pytest.approx(_COLD_DEGC, abs=4.0)] * (1 - wrong)
