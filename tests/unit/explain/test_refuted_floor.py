"""What a simulated arm leaves that rings where the joint's does not: no noise, and no agreement."""

from __future__ import annotations

from dataclasses import replace

from agent.explain.answer.own_effect import own_effect_sentence
from agent.explain.answer.result import Explanation
from agent.explain.own_effects.better import is_better, on_the_floor_of
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
