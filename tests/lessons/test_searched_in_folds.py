"""A proof by parts that are left out: what a search of its own would not find there is no less."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from tests.science.explain_joint import NOISE_NM, TWIN, Conditions, record, stair
from trajectories import SetPoints

SHORT = stair((10.0, 20.0, 40.0), duration_s=24.0)


def offset(points: SetPoints, at: Conditions) -> Floats:
    del at
    return np.full_like(points.velocity_rad_s, 0.1)


def warmth(points: SetPoints, at: Conditions) -> Floats:
    return np.asarray(-0.01 * (at.gearbox_degc - 30.0) * np.sign(points.velocity_rad_s))


ONE_SHORT_RECORDING = [record(SHORT, offset, Conditions(), 1)]
TWO_COLD_AND_WARM = [
    record(SHORT, warmth, Conditions(degc, 100.0 * k), k)
    for k, degc in enumerate((30.0, 30.0, 26.0, 37.0))
]


@pytest.mark.parametrize(
    ("runs", "effects"),
    [
        (ONE_SHORT_RECORDING, {"torque-offset", "direction-asymmetry"}),
        (TWO_COLD_AND_WARM, {"temperature-dependent-friction"}),
    ],
)
def test_what_was_found_is_fitted_to_parts_in_which_it_would_not_be_found(
    runs: list[Run], effects: set[str]
) -> None:
    """The error did not fall, so that what was found "does not hold there": it leaves noise."""
    answer = explain(TWIN, runs)
    assert answer.verdict in ("explained", "tied")
    assert {finding.effect for finding in answer.findings} <= effects
    assert answer.holdout is not None
    assert answer.holdout.extended.rmse_nm < NOISE_NM < answer.holdout.refitted.rmse_nm
    assert any("finds less, or something else" in reason for reason in answer.reasons)
