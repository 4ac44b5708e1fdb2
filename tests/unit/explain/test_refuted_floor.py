"""What is told of an own arm that is not the joint's: no ringing as noise, and no factor twice."""

from __future__ import annotations

from dataclasses import replace

from agent.explain.answer.own_effect import own_effect_sentence
from agent.explain.answer.result import Explanation
from agent.explain.own_effects.against import is_the_factors
from agent.explain.own_effects.better import is_better, on_the_floor_of
from agent.identify.result import Parameter
from agent.physics.twin import Effect
from tests.unit.report.explanation_examples import explained, no_mismatch


def leaving(answer: Explanation, rmse_nm: float, floor_nm: float) -> Explanation:
    return replace(
        answer,
        floor=replace(answer.floor, value_nm=floor_nm),
        extended=replace(answer.extended, rmse_nm=rmse_nm),
    )


def test_an_answer_that_leaves_less_than_anothers_noise_refutes_that() -> None:
    ringing = leaving(no_mismatch(), 0.034, 0.023)  # of an agreement: 34 mN m where noise was 23
    right = leaving(replace(explained(), verdict="partly-explained"), 0.0015, 0.001)
    assert not is_better(right, ringing)
    judged = on_the_floor_of(ringing, right)
    assert (judged.verdict, judged.floor.value_nm) == ("unexplained", 0.001)
    assert is_better(right, judged)


def test_an_answer_that_leaves_as_much_refutes_nothing() -> None:
    agreeing = leaving(no_mismatch(), 0.023, 0.023)
    other = leaving(explained(), 0.0235, 0.02)
    assert on_the_floor_of(agreeing, other) is agreeing


def test_what_leaves_far_more_than_noise_is_not_said_to_be_what_the_joint_has() -> None:
    said = own_effect_sentence("joint-flexibility", {}, {}, 0.9, 0.0, nameless=True)
    assert "not the joint's; what the joint has instead has no name" in said.lead
    assert "do not show" not in said.lead


def test_a_spring_in_reported_newton_metres_is_the_torque_constants() -> None:
    # Of a torque constant 6 % off the twin's spring was "not the joint's", first of all.
    spring = Effect("joint-flexibility", {"stiffness_nm_per_rad": 2.52, "damping_ratio": 0.02})
    found = replace(
        explained().findings[0],
        parameters={"stiffness_nm_per_rad": Parameter(2.62, (2.51, 2.70), identified=True)},
    )
    assert is_the_factors(spring, found, 0.941)  # 2.52 / 0.941 is 2.68
    assert not is_the_factors(spring, found, 1.0)
    assert not is_the_factors(spring, found, 0.8)
