"""A spring beside a velocity that is reported late: the interval of its arm holds a filter's."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import cast

import pytest

from agent.explain.numbers.lag import reaching_over_a_filter
from agent.explain.numbers.model import Model
from agent.identify.result import Parameter

SWING_HZ, LAG_S, ARM_KG_M2, HIGHEST = 8.0, 0.002, 0.01, 1.0001


@pytest.mark.parametrize(("delay_s", "reaches"), [(-LAG_S, True), (LAG_S, False)])
def test_an_arms_interval_reaches_to_what_a_filter_of_that_lag_would_have_left(
    delay_s: float, reaches: bool
) -> None:
    taken = math.sqrt(1.0 + (2.0 * math.pi * SWING_HZ * LAG_S) ** 2)
    found = ARM_KG_M2 * taken  # the swing that was reported is too small by as much
    terms = tuple(
        SimpleNamespace(scored=SimpleNamespace(form=SimpleNamespace(effect=effect)))
        for effect in ("joint-flexibility", "measurement-delay")
    )
    numbers = (
        {
            "arm_inertia_kg_m2": Parameter(found, (0.9999 * found, HIGHEST * found)),
            "antiresonance_hz": Parameter(SWING_HZ, None),
        },
        {"torque_delay_s": Parameter(delay_s, None)},
    )
    spring, late = reaching_over_a_filter(cast("Model", SimpleNamespace(terms=terms)), numbers)
    low, high = spring["arm_inertia_kg_m2"].ci95 or (math.nan, math.nan)
    assert (low <= ARM_KG_M2) is reaches
    assert high == HIGHEST * found
    assert late is numbers[1]
