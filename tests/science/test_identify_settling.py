"""The windows keep what has settled, to the last block, and no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.identify.estimate import estimate
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import read_motion
from agent.identify.signals.windows import find_windows
from tests.science.identify_plant import Joint, Motion, record, stair
from tests.science.information import MOTION, steady_samples

JOINT = Joint()


def kept_share(signals: Signals) -> float:
    """Return the share of the stair's steady samples that the windows keep."""
    kept = sum(w.stop - w.start for w in find_windows(read_motion(signals)))
    return kept / float(steady_samples(MOTION)[1].sum())


def ringing(signals: Signals, height_nm: float, decay_s: float) -> Signals:
    """Add what a soft arm leaves in the torque after every ramp: it dies out exponentially."""
    velocity, time_s = MOTION.velocity_rad_s, MOTION.time_s
    steady = np.abs(MOTION.acceleration_rad_s2) < 1e-6
    begins = np.flatnonzero(steady[1:] & ~steady[:-1]) + 1
    torque = signals.torque_nm.copy()
    previous = 0.0
    for begin in begins.tolist():
        side = float(np.sign(velocity[begin] - previous))
        previous = float(velocity[begin])
        since_s = time_s[begin:] - time_s[begin]
        torque[begin:] += side * height_nm * np.exp(-since_s / decay_s)
    return replace(signals, torque_nm=torque)


def test_settled_passes_are_kept_nearly_whole() -> None:
    shares = [kept_share(record(JOINT, MOTION, seed=seed)) for seed in range(20)]
    # The lean of settled heads is beyond two standard errors by chance once in 20.
    assert np.median(shares) >= 0.95
    assert min(shares) >= 0.84
    assert max(shares) <= 1.0


@pytest.mark.parametrize("decay_s", [0.03, 0.06])
def test_a_torque_that_settles_later_costs_the_heads_and_not_the_truth(decay_s: float) -> None:
    for seed in range(5):
        soft = ringing(record(JOINT, MOTION, seed=seed, noise_nm=0.01), 0.2, decay_s)
        assert kept_share(soft) < 0.9
        curve = estimate([soft]).friction_curve
        assert curve is not None
        error = curve.friction_nm - JOINT.friction(curve.velocity_rad_s)
        # With the heads, the mean would be off by height x decay / duration.
        assert abs(float(np.mean(error))) < 0.5 * 0.2 * decay_s / 1.75


def test_few_windows_tell_nothing_and_lose_their_heads() -> None:
    short = stair((12.0, 32.0), rate_hz=250.0, ramp_s=0.252, longest_s=1.75, stroke_rad=1e9)
    windows = find_windows(read_motion(record(JOINT, short)))
    assert len(windows) == 4
    assert all(w.stop - w.start < 0.9 * 1.75 * 250.0 for w in windows)


def test_a_sum_of_sines_has_no_level_to_settle_at_and_tells_the_rigid_body() -> None:
    time_s = np.arange(0.0, 30.0, 0.004)
    found: list[Signals] = []
    for phases in np.random.default_rng(8).uniform(0.0, 6.0, (2, 5)):
        waves = (0.1 + 0.1 * np.arange(5))[:, None] * 2.0 * np.pi
        turns = waves * time_s + phases[:, None]
        velocity = (25.0 * np.sin(turns)).sum(axis=0)
        motion = Motion(
            time_s=time_s,
            position_rad=-(25.0 / waves * np.cos(turns)).sum(axis=0),
            velocity_rad_s=velocity,
            acceleration_rad_s2=(25.0 * waves * np.cos(turns)).sum(axis=0),
        )
        found.append(record(JOINT, motion, noise_nm=0.01, seed=len(found)))
    body = estimate(found).rigid_body
    assert body is not None
    for name, true in (("inertia_kg_m2", JOINT.inertia_kg_m2), ("coulomb_nm", JOINT.coulomb_nm)):
        assert body.parameters[name].value == pytest.approx(true, rel=0.03)
