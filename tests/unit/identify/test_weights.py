"""What a point of the friction curve counts in the fit of a law."""

from __future__ import annotations

import numpy as np
import pytest

from agent.identify.friction.weights import misfit, weights
from agent.identify.result import Floats
from agent.physics.friction import STRIBECK

SPEED = np.geomspace(1.0, 140.0, 24)
ERROR = 0.0007 * np.maximum(1.0, np.sqrt(SPEED / 20.0))  # as of passes over one stroke: 2.6 times


def deviations(root: Floats) -> Floats:
    """Return the deviations of Stribeck's five numbers, to first order."""
    at, linear = np.array([12.0, 1.3]), np.array([0.6, 0.0107, 0.4])
    slopes = [STRIBECK.columns(SPEED, *at)]
    for step in 1e-5 * np.diag(at):
        change = STRIBECK.columns(SPEED, *(at + step)) - STRIBECK.columns(SPEED, *(at - step))
        slopes.append((change @ linear / (2.0 * step.max()))[:, np.newaxis])
    solve = np.linalg.pinv(np.concatenate(slopes, axis=1) * root[:, np.newaxis]) * root
    return np.asarray(np.sqrt(solve**2 @ ERROR**2))


def test_unequal_points_cost_a_law_that_is_exact_a_fiftieth_at_most() -> None:
    bound = deviations(1.0 / ERROR)
    assert np.all(deviations(weights(ERROR).root) < 1.02 * bound)
    assert np.any(deviations(np.ones(24)) > 1.1 * bound)


def test_a_quiet_speed_does_not_rule_the_others() -> None:
    error = np.array([1e-6, 1.0, 1.0, 1.0, 100.0])
    root = weights(error).root
    assert root[1] / root[0] == pytest.approx(np.sqrt(0.5), rel=1e-6)
    assert root[4] < 0.02
    assert weights(error, misfit_nm=1e4).root == pytest.approx(np.ones(5), rel=1e-4)


def test_the_misfit_is_what_the_points_own_errors_leave() -> None:
    rng = np.random.default_rng(3)
    own = np.tile([1.0, 2.0, 4.0], 2000)
    noise = own * rng.standard_normal(own.size)
    assert misfit(noise + 3.0 * rng.standard_normal(own.size), own, own.size) == pytest.approx(
        3.0, rel=0.05
    )
    assert misfit(0.9 * noise, own, own.size) == 0.0


def test_errors_that_are_not_known_leave_points_alike() -> None:
    for error in (np.zeros(4), np.array([1.0, np.inf, 1.0, 1.0])):
        assert np.all(weights(error).root == 1.0)
    assert misfit(np.array([1.0, -1.0, 1.0]), np.zeros(3), 3) == pytest.approx(1.0)
    assert misfit(np.ones(2), np.ones(2), 0) == 0.0
