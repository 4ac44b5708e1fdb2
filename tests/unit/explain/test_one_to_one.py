"""Behind a gear of one to one a weight and a ripple of order one are the same column."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.numbers.instead import with_a_ripple_instead
from agent.explain.numbers.wrong import WrongNumber
from agent.identify.result import Parameter
from agent.physics.twin import Twin

WEIGHT = WrongNumber("gravity-imbalance", 0.7, {"gravity_sin_nm": Parameter(0.009, (0.008, 0.01))})
INERTIA = WrongNumber("inertia-error", 0.2, {"inertia_extra_kg_m2": Parameter(0.001, None)})
SCREW = Twin("screw", 1, 1.0, 6e-4, 0.085, 9e-4)


@pytest.mark.parametrize("others", [{}, {"cable-force": 0.5}])
def test_a_screws_ripple_is_no_unknown_load_for_certain(others: dict[str, float]) -> None:
    """The cogging of a lead screw's motor was a payload, with a probability of one."""
    weight = replace(WEIGHT, alternatives=others)
    told, inertia = with_a_ripple_instead((weight, INERTIA), SCREW)
    assert inertia == INERTIA
    assert set(told.alternatives) == {*others, "torque-ripple"}
    own = 1.0 - sum(told.alternatives.values())
    assert np.allclose(list(told.alternatives.values()), own)


@pytest.mark.parametrize(
    "twin", [replace(SCREW, gear_ratio=101.0), replace(SCREW, gravity_sin_nm=4.1)]
)
def test_behind_any_other_gear_or_beside_a_weight_it_is_one(twin: Twin) -> None:
    assert with_a_ripple_instead((WEIGHT, INERTIA), twin) == (WEIGHT, INERTIA)
