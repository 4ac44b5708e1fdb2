"""A delay as slow motion shows it: told by it, and refused where it has none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.physics.twin import Twin
from tests.science.explain_plant import GEAR, RATE_HZ, Joint, record

TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)
_ANSWER_S = 0.0055  # by which the drive's torque leads what shakes the joint


def shaken(seed: int) -> Run:
    """Return a recording of a joint that chatters about 27 Hz while it moves fast enough.

    The drive answers what it measures of that; no channel is late.
    """
    run = record(Joint(), seed, noise_nm=0.02)
    own = run.signals
    assert own.position_rad is not None
    assert own.velocity_rad_s is not None
    wide = np.random.default_rng(seed).standard_normal(own.time_s.shape)
    band = butter(2, (25.5, 28.5), "bandpass", fs=RATE_HZ, output="sos")
    moving = sosfiltfilt(butter(2, 1.0, fs=RATE_HZ, output="sos"), np.abs(own.velocity_rad_s) > 8.0)
    speed = moving * sosfiltfilt(band, wide)
    speed *= 0.03 / np.std(speed)
    needed = TWIN.inertia_kg_m2 * np.gradient(speed, own.time_s)
    torque = own.torque_nm + np.interp(own.time_s + _ANSWER_S, own.time_s, needed)
    way = np.cumsum(speed) / RATE_HZ
    signals = replace(
        own,
        position_rad=own.position_rad + way,
        velocity_rad_s=own.velocity_rad_s + speed,
        torque_nm=torque,
    )
    return replace(run, signals=signals)


def test_a_drive_that_answers_what_shakes_the_joint_is_not_late() -> None:
    """At the one frequency it looks like a late motion; slow motion is on time."""
    runs = [shaken(seed) for seed in (1, 2, 3, 4)]
    answer = explain(TWIN, runs[:3], runs[3:])
    assert "measurement-delay" not in [finding.effect for finding in answer.findings]
    assert answer.verdict == "unexplained"
    (said,) = (reason for reason in answer.reasons if "slow motion is on time" in reason)
    assert "shakes the joint around 27 Hz" in said
