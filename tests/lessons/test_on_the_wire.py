"""The whole loop on the wire: an effect concealed in the drive's joint, its cycle, and its name.

The rest of the effects, and what each asks for next, is `python -m tests.benchmarks.wire`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agent.explain.answer.result import Explanation
from agent.identify.result import Floats
from tests.system.concealed_joints import CONCEALED, NULL, ask_on, find

NAMED_AT_ONCE = (
    "stribeck",
    "viscous-nonlinear",
    "torque-ripple",
    "load-dependent-friction",
    "joint-flexibility",
    "presliding-hysteresis",
    "torque-constant-error",
)
SPEEDS_RAD_S = (3.0, 5.0, 8.0, 12.0, 20.0, 40.0, 80.0)


def test_a_joint_that_the_twin_knows_has_no_mismatch(tmp_path: Path) -> None:
    found = find(tmp_path, NULL).explanation
    assert found.verdict == "no-mismatch", found.sentence
    assert found.extended.rmse_nm < 1.1 * found.floor.value_nm


@pytest.mark.parametrize("effect", NAMED_AT_ONCE)
def test_the_concealed_effect_is_named(effect: str, tmp_path: Path) -> None:
    case = CONCEALED[effect]
    found = find(tmp_path, case).explanation
    first = found.findings[0]
    assert first.effect == effect, found.sentence
    assert len(first.alternatives) <= 1, found.sentence
    assert found.extended.rmse_nm < 0.5 * found.baseline.rmse_nm
    assert found.extended.rmse_nm < case.left * found.floor.value_nm
    for name, (value, tolerance) in case.parameters.items():
        assert first.parameters[name].value == pytest.approx(value, rel=tolerance)
    if math.isfinite(case.curve_nm):
        law = case.joint.friction.truth(25.0)
        truth = [law.torque_nm(speed) for speed in SPEEDS_RAD_S]
        np.testing.assert_allclose(friction_of(found), truth, atol=case.curve_nm)


def friction_of(found: Explanation) -> Floats:
    """Return the extended twin's friction at the speeds, spring and gravity left aside."""
    assert found.twin is not None
    effects = tuple(e for e in found.twin.effects if e.id != "joint-flexibility")
    twin = replace(found.twin, effects=effects, gravity_sin_nm=0.0, gravity_cos_nm=0.0)
    velocity = np.array(SPEEDS_RAD_S)
    return twin.predict_torque(np.zeros_like(velocity), velocity, np.zeros_like(velocity))


def test_the_next_experiment_breaks_a_tie(tmp_path: Path) -> None:
    """What an explanation asks for fits the cell, is driven, and all is explained together."""
    effect = "temperature-dependent-friction"
    before = find(tmp_path, CONCEALED[effect])
    assert before.explanation.verdict == "tied", before.explanation.sentence
    first = before.explanation.findings[0]
    assert effect in {first.effect, *(other.effect for other in first.alternatives)}
    after = ask_on(tmp_path, CONCEALED[effect], before).explanation
    asked = before.explanation.next_experiment
    assert asked is not None
    assert effect in asked.tells_apart
    assert after.findings[0].effect == effect, after.sentence
    rivals = {other.effect for other in after.findings[0].alternatives}
    assert not rivals.intersection(asked.tells_apart), after.sentence
