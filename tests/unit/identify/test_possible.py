"""An interval ends where what is impossible begins; how wide it was is asked before."""

from __future__ import annotations

from agent.identify.estimate import estimate
from agent.identify.possible import possible_body, possible_models
from agent.identify.result import Estimate, FrictionModelFit, Parameter, RigidBodyFit
from tests.science.identify_plant import Joint, record, stair

VISCOUS = "viscous_nm_s_per_rad"


def _of_a_short_stair(noise_nm: float) -> Estimate:
    """Return what five slow speeds say of a joint with next to no viscous friction."""
    joint = Joint(viscous_nm_s_per_rad=0.0005)
    return estimate([record(joint, stair((2.0, 4.0, 7.0, 12.0, 20.0)), noise_nm=noise_nm, seed=3)])


def test_what_an_estimate_answers_has_no_friction_that_pushes() -> None:
    found = _of_a_short_stair(0.05)
    assert found.rigid_body is not None
    assert found.selected_model is not None
    for fit in (found.selected_model, found.rigid_body):
        assert fit.parameters[VISCOUS].to_json()["ci95"][0] == 0.0
        assert fit.parameters[VISCOUS].value > 0.0
    assert "(0.00 to 1.12)" in found.sentence
    low, high = found.rigid_body.parameters["torque_offset_nm"].ci95 or (0.0, 0.0)
    assert low < 0.0 < high  # a torque offset has either sign


def test_a_number_below_zero_keeps_its_interval_which_tells_whether_by_chance() -> None:
    found = _of_a_short_stair(0.3)
    assert found.selected_model is not None
    number = found.selected_model.parameters[VISCOUS]
    assert number.ci95 is not None
    assert number.ci95[0] < number.value < 0.0 < number.ci95[1]


def test_numbers_of_either_sign_and_those_not_identified_are_left_as_they_are() -> None:
    numbers = {
        "inertia_kg_m2": Parameter(0.01, (-0.002, 0.022)),
        "gravity_sin_nm": Parameter(0.01, (-0.002, 0.022)),
        "coulomb_nm": Parameter.not_identified("one speed only"),
        "static_extra_nm": Parameter(0.2, (-0.1, 0.6)),
    }
    expected = numbers | {
        "inertia_kg_m2": Parameter(0.01, (0.0, 0.022)),
        "static_extra_nm": Parameter(0.2, (0.0, 0.6)),
    }
    body = possible_body(RigidBodyFit(numbers, 10.0, 0.01, 97.7))
    (law,) = possible_models([FrictionModelFit("stribeck", True, 0.01, 97.7, 0.0, numbers)])
    assert body is not None
    assert body.parameters == expected == law.parameters
    assert possible_body(None) is None
