"""A ripple twice per motor turn is of that order, and not the double of one that hardly shows."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.identify.result import Floats
from tests.science.textbook_joint import TWIN, Driven, recorded, stair


def twice(driven: Driven) -> Floats:
    """Return a ripple twice per motor turn, and of once a part of the noise."""
    angle = driven.position_rad
    return np.asarray(0.07 * np.sin(2.0 * angle) + 0.0022 * np.sin(angle))


def test_an_order_whose_half_hardly_shows_is_no_double() -> None:
    *fit, held_out = (
        recorded(stair([k * v for v in (3.0, 5.0, 9.0, 14.0)]), twice, 0.03, seed)
        for seed, k in enumerate((1.0, 1.07, 1.15, 0.93))
    )
    (finding,) = explain(TWIN, fit, [held_out]).findings
    assert (finding.effect, finding.form) == ("torque-ripple", "one order")
    assert finding.parameters["order_per_motor_rev"].value == pytest.approx(2.0, abs=1e-3)
