"""A joint that turns one way alone: friction and a constant torque are the same there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.explain.explain import explain
from tests.science.textbook_joint import TWIN, nothing, recorded, stair

SPEEDS_RAD_S = (4.0, 8.0, 15.0, 28.0, 50.0)


def test_a_coulomb_level_of_one_direction_is_tied_and_the_other_one_is_asked_for() -> None:
    turning = replace(TWIN, gravity_sin_nm=0.0, gravity_cos_nm=0.0)
    rubs = replace(turning, coulomb_nm=1.2 * turning.coulomb_nm)
    *fit, held_out = (
        recorded(stair([k * v for v in SPEEDS_RAD_S], ways=(1.0,)), nothing, 0.01, seed, rubs)
        for seed, k in enumerate((1.0, 1.07, 1.15, 0.93, 1.2))
    )
    answer = explain(turning, fit, [held_out])
    (finding,) = answer.findings
    assert (answer.verdict, finding.effect) == ("tied", "wrong-number")
    others = {alternative.effect for alternative in finding.alternatives}
    assert others == {"torque-offset", "direction-asymmetry"}
    assert "the other direction" in answer.sentence
    assert np.isclose(finding.parameters["coulomb_extra_nm"].value, 0.07, atol=0.004)
