"""A recording that begins at rest: nothing is wound up yet, as textbooks have it."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.physics.beginnings import begins_at_rest, drawn_at_first
from tests.science.textbook_joint import TWIN, recorded, stair, yielding


def test_friction_that_is_relaxed_at_first_is_explained_to_the_noise() -> None:
    *fit, held_out = (
        recorded(stair([k * v for v in (4.0, 8.0, 15.0, 28.0)]), yielding, 0.01, seed)
        for seed, k in enumerate((1.0, 1.07, 1.15))
    )
    answer = explain(TWIN, fit, [held_out])
    (finding,) = answer.findings
    assert (answer.verdict, finding.effect) == ("explained", "presliding-hysteresis")
    assert finding.parameters["stiffness_nm_per_rad"].value == pytest.approx(0.7, rel=0.06)


def test_a_motion_that_was_under_way_has_drawn_its_springs() -> None:
    speed = 5.0 * np.sin(np.linspace(0.0, 6.0, 500))
    assert begins_at_rest(speed)
    assert drawn_at_first(speed, np.sign(speed)) == 0.0
    under_way = speed[40:]
    assert not begins_at_rest(under_way)
    assert drawn_at_first(under_way, np.sign(under_way)) == 1.0
