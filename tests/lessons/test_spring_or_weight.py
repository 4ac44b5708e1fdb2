"""A hose on an axis whose simulation has no weight: freed, gravity takes up most of its pull."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from agent.explain.explain import explain
from agent.identify.result import Floats
from tests.science.explain_joint import GEAR_RATIO, NOISE_NM, TWIN, Conditions, record, stair
from trajectories import SetPoints

PULL, HANGS_FREE = 0.035, -0.2  # N m/rad, rad


def test_a_hose_is_not_called_a_weight_that_explains_less() -> None:
    """On a stroke of 1.5 rad to either side a sine takes nine tenths of a straight spring.

    In noise of a hundredth of a second it was a weight, and nothing else.
    """
    rng = np.random.default_rng(11)

    def missing(points: SetPoints, _at: Conditions) -> Floats:
        slow = lfilter([1.0], [1.0, -0.8], rng.standard_normal(points.position_rad.size))
        pull = PULL * (points.position_rad / GEAR_RATIO - HANGS_FREE)
        return np.asarray(pull + 1.2 * NOISE_NM * slow)

    cycle = stair((5, 15, 40, 80), 300.0, 30.0)
    runs = [record(cycle, missing, Conditions(), 3 + k, name=f"run {k}") for k in range(3)]
    answer = explain(TWIN, runs[:2], runs[2:])
    assert answer.verdict == "tied"
    first = answer.findings[0]
    assert first.effect == "cable-force"
    assert [rival.effect for rival in first.alternatives] == ["gravity-imbalance"]
    found = first.parameters["stiffness_nm_per_arm_rad"].value
    assert found == pytest.approx(PULL, rel=0.1)
