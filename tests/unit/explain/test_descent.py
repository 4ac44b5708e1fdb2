"""Non-linear numbers moved together: down a narrow valley, within limits, never uphill."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.choosing.descent import Movable, descended
from agent.explain.forms.form import Point
from agent.explain.forms.refinement import Step
from agent.identify.result import Floats

TIME = np.linspace(0.0, 4.0, 400)
NOTHING = np.zeros((TIME.shape[0], 0))
STEPS = (Step(0.4, proportional=True), Step(0.4, proportional=True))


def fading(_: int, point: Point) -> Floats:
    """A sum of two decays: their rates hang together closely."""
    fast, slow = point
    return np.asarray(np.exp(-fast * TIME) + np.exp(-slow * TIME))[:, np.newaxis]


def numbers(high: float = 10.0) -> list[Movable]:
    return [Movable(0, i, 1e-3, high, step) for i, step in enumerate(STEPS)]


def error_at(point: Point, target: Floats) -> float:
    (column,) = fading(0, point).T
    left = target - column * (column @ target) / (column @ column)
    return float(left @ left)


def test_numbers_that_hang_together_are_found_together() -> None:
    target = 3.0 * fading(0, (1.6, 1.2))[:, 0]
    (found,) = descended(
        [(2.5, 0.8)], numbers(), fading, NOTHING, target, lambda *_: True, rounds=30
    )
    assert sorted(found) == pytest.approx([1.2, 1.6], rel=0.02)
    assert error_at(found, target) < 1e-6 * error_at((2.5, 0.8), target)


def test_a_number_stays_within_its_limits() -> None:
    target = fading(0, (2.0, 1.0))[:, 0]
    (found,) = descended(
        [(1.2, 0.9)], numbers(high=1.3), fading, NOTHING, target, lambda *_: True, rounds=20
    )
    assert max(found) <= 1.3
    assert error_at(found, target) < error_at((1.2, 0.9), target)


def test_what_physics_forbids_is_not_entered() -> None:
    target = fading(0, (2.0, 1.0))[:, 0]
    start = (1.2, 0.9)
    assert descended([start], numbers(), fading, NOTHING, target, lambda *_: False, rounds=5) == (
        start,
    )


def test_a_law_that_overflows_is_no_way_down() -> None:
    def blown(_: int, point: Point) -> Floats:
        return fading(0, point) * (np.inf if point != (1.2, 0.9) else 1.0)

    target = fading(0, (2.0, 1.0))[:, 0]
    found = descended([(1.2, 0.9)], numbers(), blown, NOTHING, target, lambda *_: True, rounds=5)
    assert found == ((1.2, 0.9),)
