"""A twin's numbers come from what shows them best, and hold no weight that is chance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.identify.estimate import estimate, twin_from_estimate
from agent.identify.signals.preprocess import read_motion
from agent.identify.signals.settling import never_settles
from agent.identify.signals.windows import find_windows
from agent.physics.twin import Twin
from tests.science.identify_plant import Joint, record, stair

SPEEDS = (4.0, 9.0, 20.0, 45.0, 100.0)


def twin_of(joint: Joint, seed: int) -> Twin:
    """Return the twin of recordings whose velocity is so coarse that ramps tell little."""
    runs = [
        record(joint, stair(SPEEDS, start_rad=at), seed=10 * seed + k, velocity_noise_rad_s=0.5)
        for k, at in enumerate((-90.0, 40.0))
    ]
    return twin_from_estimate(estimate(runs), robot="cell", axis=2, gear_ratio=20.0)


def test_a_twin_holds_no_weight_where_there_is_none_and_the_weight_where_there_is() -> None:
    weights = [abs(twin_of(Joint(gear_ratio=20.0), seed).gravity_sin_nm) for seed in range(3)]
    assert weights.count(0.0) >= 2
    heavy = twin_of(Joint(gear_ratio=20.0, gravity_sin_nm=0.4, gravity_cos_nm=0.2), 5)
    assert heavy.gravity_sin_nm == pytest.approx(0.4, abs=0.03)


@pytest.mark.parametrize(("least", "hunts"), [(0.0, False), (20.0, True)])
def test_moves_with_rests_between_them_have_settled(least: float, hunts: bool) -> None:
    """Moves one way at two speeds in turn: between rests they are moves, without it hunts."""
    motion = stair((30.0, 24.0) * 4, directions=(1,), longest_s=0.8, dwell_s=0.1)
    velocity = np.maximum(motion.velocity_rad_s, least)
    position = np.cumsum(velocity) / motion.rate_hz
    moved = replace(motion, velocity_rad_s=velocity, position_rad=position)
    read = read_motion(record(Joint(gear_ratio=20.0), moved))
    assert never_settles(read, find_windows(read)) == hunts
