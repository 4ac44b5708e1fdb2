"""Noise that is slow in part lacks nothing; torque that is slow by itself, beside it, does."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from tests.science.explain_joint import NOISE_NM, RATE_HZ, TWIN, Conditions, record, stair
from trajectories import SetPoints

Left = Literal["flickers", "drags", "wanders"]

STAIR = stair((5.0, 10.0, 20.0, 40.0, 60.0), stroke_rad=240.0, duration_s=40.0)
FLICKER = 2.5  # times the white noise
DRAGS, DRAGS_S, EVERY_S = 1.2, 1.5, 6.0
WANDERS, WANDERS_S = 1.0, 1.0


def flicker(rng: np.random.Generator, count: int) -> Floats:
    """Return noise of one standard deviation with as much power in every octave."""
    spectrum = np.fft.rfft(rng.standard_normal(count))
    spectrum[0] = 0.0
    spectrum[1:] /= np.sqrt(np.arange(1, spectrum.size))
    noise = np.fft.irfft(spectrum, count)
    return np.asarray(noise / noise.std())


def recorded(left: Left, seed: int) -> Run:
    """Return a recording with flicker, and a brake that drags now and then or a slow wandering."""
    rng = np.random.default_rng(70 + seed)

    def more(points: SetPoints, _at: Conditions) -> Floats:
        count = points.position_rad.size
        size = FLICKER if left == "flickers" else 0.5 * FLICKER
        extra = size * NOISE_NM * flicker(rng, count)
        if left == "drags":
            begins = (rng.random(count) < 1.0 / (EVERY_S * RATE_HZ)).astype(np.float64)
            lasts = np.convolve(begins, np.ones(round(DRAGS_S * RATE_HZ)))[:count] > 0.0
            extra += DRAGS * NOISE_NM * lasts
        elif left == "wanders":
            over = np.hanning(round(2.0 * WANDERS_S * RATE_HZ))
            slow = np.convolve(rng.standard_normal(count), over / np.linalg.norm(over), "same")
            extra += WANDERS * NOISE_NM * slow
        return np.asarray(extra)

    return record(STAIR, more, Conditions(), seed, name=f"run-{seed}")


@pytest.mark.parametrize(
    ("left", "verdict"),
    [("flickers", "no-mismatch"), ("drags", "unexplained"), ("wanders", "unexplained")],
)
def test_flicker_is_noise_and_what_is_slower_than_it_is_not(left: Left, verdict: str) -> None:
    runs = [recorded(left, seed) for seed in range(5)]
    answer = explain(TWIN, runs[:4], runs[4:])
    said = any("fast part foretells" in reason for reason in answer.reasons)
    ratio = answer.extended.rmse_nm / answer.floor.value_nm
    assert 1.25 < ratio < 2.0
    assert answer.verdict == verdict
    assert said == (left == "flickers")
