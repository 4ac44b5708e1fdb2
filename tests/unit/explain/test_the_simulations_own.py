"""Of what a recorded simulation has by itself: not where the joint has one of its kind as well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.asked import tabulated
from agent.explain.own_effects.other_way import the_simulations_own
from agent.explain.rows.run import Run
from agent.identify.result import Floats
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
