"""A spring that the arm's weight would wind up by degrees is no gear."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from agent.explain.forms.arm import FORMS
from agent.explain.rows.scene import Scene
from agent.physics.twin import TwinError

SCENE = cast(
    "Scene",
    SimpleNamespace(
        theta=np.array([1.7e-3, 2e-4, 0.07, 0.8, -1.2]), table=SimpleNamespace(gear_ratio=110.0)
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
