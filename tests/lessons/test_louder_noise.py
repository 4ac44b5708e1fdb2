"""Torque that is noisier where the speed changes lacks nothing; what goes on, or bursts, does."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from tests.science.explain_joint import NOISE_NM, RATE_HZ, TWIN, Conditions, record
from trajectories import SetPoints, stair_paired

Left = Literal["noise", "wanders", "bursts"]

SLOW_RAMPS = stair_paired(
    -60.0,
    60.0,
    speeds_rad_s=(8.0, 16.0, 30.0),
    duration_s=40.0,
    acceleration_rad_s2=15.0,
    jerk_rad_s3=100.0,
    dwell_min_s=0.1,
)
WANDERS_S, BURST_S = 0.3, 0.06
SIZE = {"noise": 1.8, "wanders": 1.0, "bursts": 12.0}  # times the noise


def recorded(left: Left, seed: int) -> Run:
    """Return a recording with as much again where its speed changes: noise, or none in kind."""
    rng = np.random.default_rng(50 + seed)

    def more(points: SetPoints, _at: Conditions) -> Floats:
        noise: Floats = rng.standard_normal(points.position_rad.shape)
        extra = SIZE["noise"] * NOISE_NM * noise
        if left == "wanders":
            over = np.ones(round(WANDERS_S * RATE_HZ))
            extra = SIZE[left] * NOISE_NM * np.convolve(noise, over / np.sqrt(over.size), "same")
        elif left == "bursts":
            begins = (rng.random(points.position_rad.shape) < 0.5 / RATE_HZ).astype(np.float64)
            lasts = np.convolve(begins, np.ones(round(BURST_S * RATE_HZ)), "same") > 0.0
            extra = SIZE[left] * NOISE_NM * noise * lasts
        return np.asarray(extra * (np.abs(points.acceleration_rad_s2) > 5.0))

    return record(SLOW_RAMPS, more, Conditions(), seed, name=f"run-{seed}")


@pytest.mark.parametrize(
    ("left", "verdict"),
    [("noise", "no-mismatch"), ("wanders", "unexplained"), ("bursts", "unexplained")],
)
def test_more_noise_is_no_mismatch_and_what_wanders_or_bursts_is(left: Left, verdict: str) -> None:
    runs = [recorded(left, seed) for seed in range(4)]
    answer = explain(TWIN, runs[:3], runs[3:])
    said = any("noise all the same" in reason for reason in answer.reasons)
    ratio = answer.extended.rmse_nm / answer.floor.value_nm
    assert 1.25 < ratio < 2.0
    assert answer.verdict == verdict
    assert said == (left == "noise")
