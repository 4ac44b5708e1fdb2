"""A weight that the simulation does not know, beside friction: no cable copies its sine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.explain.explain import explain
from agent.identify.result import Floats
from tests.science.textbook_joint import TWIN, Driven, recorded, stair

SPEEDS_RAD_S = (4.0, 8.0, 15.0, 28.0, 40.0)


def falling(driven: Driven) -> Floats:
    """Return friction that falls with speed."""
    speed = driven.velocity_rad_s
    return np.asarray(0.12 * np.exp(-np.abs(speed) / 6.0) * np.sign(speed))


def test_a_weight_beside_stribeck_is_no_cable() -> None:
    known = replace(TWIN, gravity_sin_nm=0.0, gravity_cos_nm=0.0)
    weighs = replace(TWIN, gravity_sin_nm=0.3, gravity_cos_nm=0.0)
    *fit, held_out = (
        recorded(stair([k * v for v in SPEEDS_RAD_S]), falling, 0.03, seed, weighs)
        for seed, k in enumerate((1.0, 1.07, 1.15, 0.93))
    )
    answer = explain(known, fit, [held_out])
    weight, friction = answer.findings
    assert (weight.effect, friction.effect) == ("gravity-imbalance", "stribeck")
    assert not weight.alternatives
