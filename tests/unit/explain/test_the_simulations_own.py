"""Of what a simulation has by itself: one of its kind in the joint may be the very same."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from agent.explain.asked import tabulated
from agent.explain.own_effects.better import is_as_good
from agent.explain.own_effects.constant import deciding, or_a_constant
from agent.explain.own_effects.doubted import Doubted, says_twice
from agent.explain.own_effects.other_way import the_simulations_own
from agent.explain.rows.run import Run
from agent.explain.rows.table import Table
from agent.identify.result import Floats, Parameter
from agent.physics.twin import Effect
from tests.science.textbook_joint import TWIN, Driven, nothing, recorded, stair
from tests.unit.report.explanation_examples import explained

SIZE_NM = 0.1


def ripple(order: float, size_nm: float) -> Effect:
    numbers = {"cos_nm": size_nm, "sin_nm": 0.0, "order_per_motor_rev": order}
    return Effect("torque-ripple", numbers)


def wave(driven: Driven) -> Floats:
    return SIZE_NM * np.cos(3.0 * driven.position_rad)


def beside(run: Run, driven: Driven, order: float) -> Run:
    """Return a recording beside a simulation that has a ripple."""
    plain_nm = recorded(driven, nothing, 0.0, 0).signals.torque_nm
    simulated_nm = plain_nm + SIZE_NM * np.cos(order * driven.position_rad)
    return replace(run, columns={**run.columns, "torque_simulated_nm": simulated_nm})


@pytest.mark.parametrize("joint_ripples", [False, True])
def test_a_ripple_of_the_joint_keeps_the_name_for_both(joint_ripples: bool) -> None:
    driven = stair([3.0, 7.0, 15.0])
    run = recorded(driven, wave if joint_ripples else nothing, 0.01, 0)
    laws = [ripple(6.0, -SIZE_NM), *([ripple(3.0, SIZE_NM)] if joint_ripples else [])]
    answer = replace(explained(), twin=replace(TWIN, effects=tuple(laws)))
    _, table = tabulated(TWIN, [beside(run, driven, 6.0)], [])
    own = {"torque-ripple"} if not joint_ripples else set()
    assert the_simulations_own(TWIN, table, answer) == own


@pytest.mark.parametrize(("left_nm", "as_good"), [(1.0, True), (1.2, False)])
def test_another_law_of_the_kind_that_a_simulation_has_is_that_one_grown(
    left_nm: float, as_good: bool
) -> None:
    """Friction under load that grew by half was a second one: beside one alone, a late velocity."""
    has = replace(TWIN, effects=(ripple(3.0, SIZE_NM),))
    kind = replace(explained().findings[0], effect="torque-ripple")
    extended = replace(explained().extended, rmse_nm=1.0)
    two = replace(has, effects=(ripple(3.0, SIZE_NM), ripple(3.0, 0.5 * SIZE_NM)))
    answer = replace(explained(), twin=two, findings=(kind,), extended=extended)
    doubted = Doubted(has, has, cast("Table", None), (0,))
    assert says_twice(answer, doubted)
    assert not says_twice(replace(answer, findings=()), doubted)
    late = Effect("measurement-delay", {"torque_delay_s": 3e-4})
    one = replace(has, effects=(ripple(3.0, 1.5 * SIZE_NM), late))
    bare = replace(answer, twin=one, extended=replace(extended, rmse_nm=left_nm))
    assert is_as_good(bare, answer) is as_good


@pytest.mark.parametrize(
    ("stiffness", "neutral", "tied"),
    [(1.8, 0.066, True), (1.2, 0.066, False), (1.8, 0.1, False)],
)
def test_a_cable_that_hangs_free_elsewhere_may_be_a_constant_torque(
    stiffness: float, neutral: float, tied: bool
) -> None:
    """An asymmetry that had come since was, for certain, the simulation's own cable."""
    cable = Effect("cable-force", {"stiffness_nm_per_arm_rad": 1.8, "neutral_arm_rad": 0.1})
    found = {
        "stiffness_nm_per_arm_rad": Parameter(stiffness, (stiffness - 0.01, stiffness + 0.01)),
        "neutral_arm_rad": Parameter(neutral, (neutral - 0.002, neutral + 0.002)),
    }
    own = replace(explained().findings[0], effect="cable-force", parameters=found, alternatives=())
    told = or_a_constant(cable, own)
    others = [a.effect for a in told.alternatives]
    assert others == (["torque-offset", "direction-asymmetry"] if tied else [])
    if tied:
        assert "brake closed" in deciding(told).set_up
