"""A resolver errs once and twice a turn: both are its own, and in the twin that is written."""

from __future__ import annotations

import math

import pytest

from agent.explain.explain import explain
from agent.physics.twin import Twin
from tests.science.explain_plant import GEAR, Joint, record

TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)


def test_a_misread_angle_has_each_of_its_orders() -> None:
    """The second one had to be a wobbling gear's, or a ripple's."""
    joint = Joint(misread=0.003, misread_once=0.008)
    runs = [record(joint, seed, noise_nm=0.02) for seed in (1, 2, 3, 4)]
    answer = explain(TWIN, runs[:3], runs[3:])
    assert {finding.effect for finding in answer.findings} == {"resolver-error"}
    told = {
        round(f.parameters["order_per_motor_rev"].value): math.hypot(
            f.parameters["cos_rad"].value, f.parameters["sin_rad"].value
        )
        for f in answer.findings
    }
    assert told == {1: pytest.approx(0.008, rel=0.03), 2: pytest.approx(0.003, rel=0.03)}
    assert answer.twin is not None
    again = explain(answer.twin, runs[:3], runs[3:])
    assert again.verdict == "no-mismatch"
