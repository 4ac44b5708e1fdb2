"""A spring that the arm's weight would wind up by degrees is no gear."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.search import Library
from agent.explain.forms.arm import FORMS
from agent.explain.rows.evidence import Weighing
from agent.explain.rows.scene import Scene
from agent.physics.twin import TwinError

THETA = np.array([1.7e-3, 2e-4, 0.07, 0.8, -1.2])
SCENE = cast(
    "Scene",
    SimpleNamespace(
        theta=THETA,
        as_given=THETA,
        table=SimpleNamespace(gear_ratio=110.0, carried=np.arange(5) == 0),
    ),
)


def test_an_arm_that_its_weight_would_turn_by_radians_hangs_on_no_spring() -> None:
    """Another axis that gave way at 2.2 Hz was one: the error on unseen data went up twentyfold."""
    (spring, *_) = (f for f in FORMS if f.effect == "joint-flexibility")
    numbers = {"arm_inertia_kg_m2": 2.5e-5, "antiresonance_hz": 2.2, "damping_ratio": 0.2}
    with pytest.raises(TwinError, match=r"winds up by 2\.\d rad"):
        spring.to_twin(SCENE, numbers)
    stiffer = spring.to_twin(SCENE, {**numbers, "arm_inertia_kg_m2": 1e-3, "antiresonance_hz": 9.0})
    assert stiffer[0]["stiffness_nm_per_rad"] == pytest.approx(3.2, rel=0.01)


@pytest.mark.parametrize(("swing_hz", "enters"), [(2.2, False), (22.0, True)])
def test_what_no_arm_hangs_on_is_not_searched_on_with(swing_hz: float, enters: bool) -> None:
    """It had been found, settled and refused in the end, and all was looked for once more."""
    (spring, *_) = (f for f in FORMS if f.effect == "joint-flexibility")
    rows, blocks = np.arange(240), np.arange(12)
    weighing = Weighing(rows, np.ones(240), 20 * blocks, blocks % 4, rows // 120, by_run=False)
    inertial, swing = np.random.default_rng(0).normal(size=(2, 240, 1))
    arm = Candidate.of(spring, (swing_hz, 0.2), swing)
    target = 2.5e-5 * swing[:, 0]
    library = Library(SCENE, weighing, target, inertial, (arm,))
    assert [s.candidate for s in library.rank([], refined=False)] == [arm] * enters
