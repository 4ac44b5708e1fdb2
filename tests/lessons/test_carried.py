"""Some recordings carry what the others do not, and none says so: named, and taken off them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.answer.result import Explanation
from agent.explain.carried import Carried
from agent.explain.explain import explain
from agent.explain.forms.carried import in_set
from agent.explain.rows.run import Run
from agent.identify.result import Floats, Parameter
from tests.science.explain_joint import GEAR_RATIO, TWIN, Conditions, record, stair
from trajectories import SetPoints

SIN, COS = 0.30, 0.10
LOAD_SIN, LOAD_COS = 0.12, -0.04
CYCLE = stair((3, 10, 30, 60), 200.0, 20.0)
KNOWN = replace(TWIN, gravity_sin_nm=SIN, gravity_cos_nm=COS)


def recorded(
    loads: Sequence[float], inertia_kg_m2: float, falls_nm: float = 0.0, first: int = 0
) -> list[Run]:
    """Return recordings under shares of a load, of a joint whose friction may fall with speed."""
    runs = []
    for index, share in enumerate(loads, start=first):

        def missing(points: SetPoints, at: Conditions, share: float = share) -> Floats:
            del at
            arm, velocity = points.position_rad / GEAR_RATIO, points.velocity_rad_s
            weight = (SIN + share * LOAD_SIN) * np.sin(arm) + (COS + share * LOAD_COS) * np.cos(arm)
            faded = falls_nm * np.sign(velocity) * np.exp(-np.abs(velocity) / 8.0)
            return np.asarray(weight + share * inertia_kg_m2 * points.acceleration_rad_s2 + faded)

        began = Conditions(started_s=100.0 * index)
        runs.append(record(CYCLE, missing, began, index, name=f"run-{index}"))
    return runs


def loaded(answer: Explanation) -> dict[str, float]:
    """Return the numbers of what some recordings carry."""
    own = next(f for f in answer.findings if "carr" in f.said.lead)
    assert own.effect == "gravity-imbalance"
    return {name: p.value for name, p in own.parameters.items()}


@pytest.mark.parametrize("inertia_kg_m2", [0.0, 0.001])
def test_what_three_of_six_recordings_carry_hides_no_smaller_effect(inertia_kg_m2: float) -> None:
    runs = recorded((0, 1, 0, 1, 1, 0), inertia_kg_m2, falls_nm=0.06)
    unseen = recorded((1, 0), inertia_kg_m2, falls_nm=0.06, first=6)
    answer = explain(KNOWN, runs, unseen)
    assert [f.effect for f in answer.findings] == ["gravity-imbalance", "stribeck"]
    assert "The recordings run-1, run-3 and run-4 carry something" in answer.sentence
    numbers = loaded(answer)
    assert numbers["gravity_sin_nm"] == pytest.approx(LOAD_SIN, rel=0.05)
    assert numbers["gravity_cos_nm"] == pytest.approx(LOAD_COS, rel=0.05)
    assert numbers.get("inertia_kg_m2", 0.0) == pytest.approx(inertia_kg_m2, rel=0.05)
    assert answer.holdout is not None
    assert answer.holdout.floor_ratio < 1.08
    assert "(held out)" in answer.reasons[0]
    assert "payload_kg" in answer.reasons[0]


@pytest.mark.parametrize(
    ("loads", "said"),
    [
        ((0, 0, 1, 0, 1), "The recordings run-2 and run-4 carry something"),
        ((1, 0, 1, 0, 1), "The recordings run-0, run-2 and run-4 carry something"),
        ((1, 0, 1, 1, 1), "The recordings run-0, run-2, run-3 and run-4 carry something"),
    ],
)
def test_it_is_said_which_recordings_carry_what_the_twin_does_not_know(
    loads: tuple[float, ...], said: str
) -> None:
    answer = explain(KNOWN, recorded(loads, 0.0), recorded((0, 1), 0.0, first=5))
    assert answer.verdict == "explained"
    assert said in answer.sentence
    assert loaded(answer)["gravity_sin_nm"] == pytest.approx(LOAD_SIN, rel=0.05)
    assert "run-6 (held out)" in answer.reasons[0]
    assert answer.baseline.rmse_nm > 2.0 * answer.extended.rmse_nm


def test_of_one_recording_alone_it_is_asked_what_it_carries() -> None:
    """Nothing that another recording has says whether it is a load."""
    answer = explain(KNOWN, recorded((0, 0, 0, 1, 0), 0.0), recorded((0, 1), 0.0, first=5))
    assert answer.verdict == "unexplained"
    assert any("payload_kg" in reason for reason in answer.reasons)


def test_a_hold_out_that_does_not_say_where_it_went_is_none_of_them() -> None:
    (unseen,) = recorded((1,), 0.0, first=5)
    without = replace(unseen, signals=replace(unseen.signals, position_rad=None))
    answer = explain(KNOWN, recorded((0, 0, 1, 0, 1), 0.0), (without,))
    assert "run-2 and run-4 carry something" in answer.sentence
    assert not any("(held out)" in reason for reason in answer.reasons)


def test_recordings_that_carry_the_same_are_no_two_kinds() -> None:
    answer = explain(KNOWN, recorded((0, 0, 0, 0, 0), 0.0), recorded((0, 0), 0.0, first=5))
    assert (answer.verdict, answer.findings) == ("no-mismatch", ())


@pytest.mark.parametrize(
    ("sin_nm", "inertia_kg_m2", "sure", "where_the_arm_weighs"),
    [
        (Parameter(-0.053, (-0.12, 0.015)), Parameter(-3.0e-4, (-5.8e-4, -1.4e-5)), False, False),
        (Parameter(0.12, (0.10, 0.14)), Parameter(1.0e-5, (-1.0e-4, 1.2e-4)), True, True),
        (Parameter(0.01, (-0.12, 0.14)), Parameter(1.0e-3, (0.9e-3, 1.1e-3)), True, False),
    ],
)
def test_a_load_is_one_of_whose_numbers_one_is_surely_not_nothing(
    sin_nm: Parameter, inertia_kg_m2: Parameter, sure: bool, where_the_arm_weighs: bool
) -> None:
    """The coolest four of six recordings "carried" what a warmer motor lacked in torque.

    And one "carried" an inertia below nothing that did not weigh: friction with a memory.
    """
    none = Parameter(-0.004, (-0.022, 0.014))
    numbers = {"gravity_sin_nm": sin_nm, "gravity_cos_nm": none, "inertia_kg_m2": inertia_kg_m2}
    carried = Carried((0, 1), ("a", "b"), numbers, 1.0, 0.83, 0.0, 0.0, "")
    upright = replace(KNOWN, gravity_sin_nm=0.0, gravity_cos_nm=0.0)
    assert carried.is_sure(upright) is sure
    assert carried.is_sure(replace(upright, gravity_sin_nm=4.1)) is where_the_arm_weighs


def test_a_set_of_recordings_is_a_numbers_bits() -> None:
    assert in_set((38.0,), 7) == (1, 2, 5)
    assert in_set((float(1 << 49),), 50) == (49,)


@pytest.mark.parametrize(
    ("places", "gravity_nm"), [((1, 3), 0.117), ((0, 2), 0.123), ((0, 1), None)]
)
def test_the_rest_of_a_load_is_that_loads(
    places: tuple[int, ...], gravity_nm: float | None
) -> None:
    """It had been a second load, of two percent of the first: told of the others, the other way."""

    def carried(places: tuple[int, ...], sin_nm: float) -> Carried:
        cos = Parameter(0.01, (0.0, 0.02))
        sine = Parameter(sin_nm, (sin_nm - 0.001, sin_nm + 0.001))
        numbers = {"gravity_sin_nm": sine, "gravity_cos_nm": cos}
        return Carried(places, tuple(f"run-{k}" for k in places), numbers, 1.0, 1.0, 0.0, 0.0, "")

    first = carried((1, 3), 0.12)
    joined = first.joined_by(carried(places, -0.003), 4)
    if gravity_nm is None:
        assert joined is None
        return
    assert joined is not None
    found = joined.numbers["gravity_sin_nm"]
    assert found.value == pytest.approx(gravity_nm)
    assert found.ci95 == pytest.approx((gravity_nm - 0.001, gravity_nm + 0.001))
    assert joined.places == first.places
    assert first.joined_by(None, 4) is None


@pytest.mark.parametrize(("share", "lacks"), [(-1.0, True), (-0.5, False), (1.0, False)])
def test_a_recording_without_the_weight_that_the_others_show_may_be_another_axis(
    share: float, lacks: bool
) -> None:
    """It was a payload of minus all of the arm's weight, with a probability of one."""
    numbers = {"gravity_sin_nm": share * SIN, "gravity_cos_nm": share * COS}
    known = {name: Parameter(value, None) for name, value in numbers.items()}
    carried = Carried((2,), ("run-2",), known, 1.0, 0.9, 0.1, 0.3, "a form")
    assert carried.lacks_the_weight(KNOWN) is lacks
