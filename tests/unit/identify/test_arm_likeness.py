"""What a simulated arm leaves: noise, or an error that all reversals share."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from agent.identify.reversals.arm_elimination import ARM, TORQUE, Reduced
from agent.identify.reversals.arm_likeness import likeness
from agent.identify.reversals.arm_record import ArmRecord

TURNS, SWING = 16, 500


def left(seed: int, alike: float, memory: float = 0.0, turns: int = TURNS) -> float:
    """Return the likeness of noise, and of so much of one course in every reversal."""
    size = (turns + 1) * SWING
    noise = np.random.default_rng(seed).standard_normal((5, size))
    noise = math.sqrt(1.0 - memory**2) * lfilter([1.0], [1.0, -memory], noise)
    places = tuple(range(SWING, size, SWING))
    way = np.repeat((-1.0) ** np.arange(turns + 1), SWING)
    course = alike * np.sin(np.arange(SWING) / 20.0)
    for block in (TORQUE, ARM):
        noise[block, SWING:] += np.concatenate([w * course for w in way[::SWING][1:]])
    none, yes = np.zeros(size), np.ones(size, dtype=np.bool_)
    record = ArmRecord(
        period_s=1e-3,
        motor_rad=none,
        arm_rad=none,
        torque_nm=none,
        smooth_rad=none,
        way=way,
        slides=yes,
        swings=yes,
        turn=np.zeros(size, dtype=np.intp),
        places=places,
        motor_error_rad=1.0,
        arm_error_rad=1.0,
        torque_error_nm=1.0,
        arm_step_rad=1.0,
        hardest_rad_s2=1.0,
    )
    rest = noise.ravel()
    return likeness([record], [Reduced(none[:, np.newaxis], rest, none, float(size), none)])


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_noise_is_not_alike_at_two_reversals_whatever_its_colour(memory: float) -> None:
    seen = [left(seed, 0.0, memory) for seed in range(100)]
    assert abs(np.mean(seen)) < 0.3
    assert 0.8 < np.std(seen) < 1.2


def test_an_error_that_all_reversals_share_shows_where_the_mean_square_does_not() -> None:
    alike = 0.2  # 0.8 % of all five blocks' mean square: chance makes as much
    assert sum(left(seed, alike) > 2.0 for seed in range(10)) >= 9


def test_too_few_reversals_of_one_direction_tell_nothing() -> None:
    assert left(1, 0.0, turns=4) == math.inf
