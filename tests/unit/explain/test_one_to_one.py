"""Behind a gear of one to one a weight and a ripple of order one are the same column."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.numbers.instead import with_a_ripple_instead
from agent.explain.numbers.wrong import WrongNumber
from agent.identify.result import Parameter

WEIGHT = WrongNumber("gravity-imbalance", 0.7, {"gravity_sin_nm": Parameter(0.009, (0.008, 0.01))})
INERTIA = WrongNumber("inertia-error", 0.2, {"inertia_extra_kg_m2": Parameter(0.001, None)})


@pytest.mark.parametrize("others", [{}, {"cable-force": 0.5}])
def test_a_screws_ripple_is_no_unknown_load_for_certain(others: dict[str, float]) -> None:
    """The cogging of a lead screw's motor was a payload, with a probability of one."""
    weight = replace(WEIGHT, alternatives=others)
    told, inertia = with_a_ripple_instead((weight, INERTIA), 1.0)
    assert inertia == INERTIA
    assert set(told.alternatives) == {*others, "torque-ripple"}
    own = 1.0 - sum(told.alternatives.values())
    assert np.allclose(list(told.alternatives.values()), own)


def test_behind_any_other_gear_a_weight_is_one() -> None:
    assert with_a_ripple_instead((WEIGHT, INERTIA), 101.0) == (WEIGHT, INERTIA)
