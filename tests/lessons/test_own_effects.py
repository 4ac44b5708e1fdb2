"""A simulation that has an effect with other numbers than the joint, or one that it has not."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.answer.names import OWN_EFFECT
from agent.explain.answer.result import Explanation
from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.physics.twin import Effect, Twin
from tests.science.explain_joint import TWIN, Conditions, record, stair
from tests.science.explain_plant import GEAR, Joint
from tests.science.explain_plant import record as swinging
from trajectories import SetPoints

FALL_NM, FALL_RAD_S = 0.15, 6.0
SPEEDS_RAD_S = (2.0, 4.0, 8.0, 16.0, 30.0, 50.0)


@functools.cache
def recordings(of: float = 1.0) -> tuple[Run, ...]:
    """Return a joint whose friction falls with speed, by so many times its usual fall."""

    def missing(now: SetPoints, at: Conditions) -> Floats:
        del at
        speed = np.abs(now.velocity_rad_s)
        return np.asarray(of * FALL_NM * np.exp(-speed / FALL_RAD_S) * np.sign(now.velocity_rad_s))

    return tuple(
        record(stair([(1.0 + 0.1 * k) * v for v in SPEEDS_RAD_S]), missing, Conditions(), k)
        for k in range(2)
    )


def falling(extra_nm: float) -> Effect:
    numbers = {"static_extra_nm": extra_nm, "stribeck_velocity_rad_s": FALL_RAD_S, "exponent": 1.0}
    return Effect("stribeck", numbers)


RIPPLE = Effect("torque-ripple", {"order_per_motor_rev": 6.0, "cos_nm": 0.1, "sin_nm": 0.0})


def with_effects(*effects: Effect) -> Twin:
    return replace(TWIN, effects=effects)


def own(answer: Explanation) -> dict[str, str]:
    return {f.effect: f.sentence for f in answer.findings if f.form == OWN_EFFECT}


@pytest.mark.parametrize(
    ("times", "said"), [(2.0, "times as strong as the joint's"), (0.4, "of the joint's strength")]
)
def test_too_much_and_too_little_of_an_effect_is_a_wrong_number_of_the_simulation(
    times: float, said: str
) -> None:
    answer = explain(with_effects(falling(times * FALL_NM)), recordings())
    assert [f.effect for f in answer.findings] == ["stribeck"]
    assert said in own(answer)["stribeck"]
    found = answer.findings[0].parameters["static_extra_nm"]
    assert found.ci95 is not None
    assert found.ci95[0] <= FALL_NM <= found.ci95[1]
    # What the simulation as given leaves stands beside it, and the law in its place is one.
    assert answer.refitted.rmse_nm > 1.2 * answer.extended.rmse_nm
    assert answer.twin is not None
    assert [e.id for e in answer.twin.effects] == ["stribeck"]
    assert explain(answer.twin, recordings()).verdict == "no-mismatch"


def test_an_effect_that_the_joint_has_not_is_told_beside_the_one_that_is_missing() -> None:
    answer = explain(with_effects(RIPPLE), recordings())
    assert {f.effect for f in answer.findings} == {"stribeck", "torque-ripple"}
    assert "which these recordings do not show" in own(answer)["torque-ripple"]
    assert answer.twin is not None
    assert [e.id for e in answer.twin.effects] == ["stribeck"]


def test_a_right_effect_is_not_told_whatever_else_is_missing() -> None:
    agreeing = explain(with_effects(falling(FALL_NM)), recordings())
    assert agreeing.verdict == "no-mismatch"
    lacking = explain(with_effects(falling(FALL_NM)), [_rippling(run) for run in recordings()])
    assert [f.effect for f in lacking.findings] == ["torque-ripple"]
    assert not own(lacking)


def _rippling(run: Run) -> Run:
    signals = run.signals
    assert signals.position_rad is not None
    wave = 0.1 * np.cos(6.0 * signals.position_rad)
    return replace(run, signals=replace(signals, torque_nm=signals.torque_nm + wave))


def test_a_spring_that_is_twice_too_stiff_has_its_own_stiffness_again() -> None:
    soft = Joint(stiffness=25.0, damping=0.03)
    runs = [swinging(soft, seed, duration_s=20.0) for seed in range(2)]
    plain = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)
    then = explain(plain, runs).twin
    assert then is not None
    (spring,) = then.effects
    numbers = spring.parameters
    stiff = {**numbers, "stiffness_nm_per_rad": 2.0 * numbers["stiffness_nm_per_rad"]}
    answer = explain(replace(then, effects=(Effect(spring.id, stiff),)), runs)
    assert list(own(answer)) == ["joint-flexibility"]
    assert answer.twin is not None
    found = answer.twin.effects[0].parameters["stiffness_nm_per_rad"]
    assert found == pytest.approx(numbers["stiffness_nm_per_rad"], rel=0.02)
