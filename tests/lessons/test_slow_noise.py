"""Noise that is slow, in part or whole, lacks nothing; a torque that is slow beside it does."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from scipy.signal import lfilter

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from tests.science.explain_joint import NOISE_NM, RATE_HZ, TWIN, Conditions, record, stair
from trajectories import SetPoints, Trajectory, reversals

Left = Literal["flickers", "forgets", "drags", "wanders"]
Unrepeated = Literal["noise", "brake"]

STAIR = stair((5.0, 10.0, 20.0, 40.0, 60.0), stroke_rad=240.0, duration_s=40.0)
FLICKER = 2.5  # times the white noise
REMEMBERED, FORGETS_S = 0.8, 0.2
DRAGS, DRAGS_S, EVERY_S = 1.2, 1.5, 6.0
WANDERS, WANDERS_S = 1.0, 1.0
SLOW, MEMORY_S, BRAKE = 2.0, 1.0, 4.0


def flicker(rng: np.random.Generator, count: int) -> Floats:
    """Return noise of one standard deviation with as much power in every octave."""
    spectrum = np.fft.rfft(rng.standard_normal(count))
    spectrum[0] = 0.0
    spectrum[1:] /= np.sqrt(np.arange(1, spectrum.size))
    noise = np.fft.irfft(spectrum, count)
    return np.asarray(noise / noise.std())


def forgetting(rng: np.random.Generator, count: int) -> Floats:
    """Return noise of one standard deviation that forgets itself within `FORGETS_S`."""
    keep = np.exp(-1.0 / (FORGETS_S * RATE_HZ))
    noise = lfilter([1.0], [1.0, -keep], rng.standard_normal(count))
    return np.asarray(noise * np.sqrt(1.0 - keep**2))


def recorded(left: Left, seed: int) -> Run:
    """Return a recording with flicker, and a brake that drags now and then or a slow wandering."""
    rng = np.random.default_rng(70 + seed)

    def more(points: SetPoints, _at: Conditions) -> Floats:
        count = points.position_rad.size
        size = FLICKER if left == "flickers" else 0.5 * FLICKER
        extra = size * NOISE_NM * flicker(rng, count)
        if left == "forgets":
            extra = REMEMBERED * NOISE_NM * forgetting(rng, count)
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
    [
        ("flickers", "no-mismatch"),
        ("forgets", "no-mismatch"),
        ("drags", "unexplained"),
        ("wanders", "unexplained"),
    ],
)
def test_flicker_is_noise_and_what_is_slower_than_it_is_not(left: Left, verdict: str) -> None:
    runs = [recorded(left, seed) for seed in range(5)]
    answer = explain(TWIN, runs[:4], runs[4:])
    said = any("fast part foretells" in reason for reason in answer.reasons)
    ratio = answer.extended.rmse_nm / answer.floor.value_nm
    assert 1.25 < ratio < 2.0
    assert answer.verdict == verdict
    assert said == (verdict == "no-mismatch")


def to_and_fro(speed_rad_s: float) -> Trajectory:
    """Return strokes that pass the same places at the same speed again and again."""
    return reversals(
        0.0,
        2.0 * speed_rad_s,
        halvings=0,
        swings=5,
        velocity_rad_s=speed_rad_s,
        acceleration_rad_s2=200.0,
        jerk_rad_s3=5000.0,
    )


def passed_again(left: Unrepeated, seed: int, speed_rad_s: float) -> Run:
    """Return a recording with noise of seconds, or a brake that drags for seconds now and then."""
    rng = np.random.default_rng(90 + seed)

    def more(points: SetPoints, _at: Conditions) -> Floats:
        count = points.position_rad.size
        if left == "brake":
            begins = (rng.random(count) < 1.0 / (EVERY_S * RATE_HZ)).astype(np.float64)
            lasts = np.convolve(begins, np.ones(round(DRAGS_S * RATE_HZ)))[:count] > 0.0
            return np.asarray(BRAKE * NOISE_NM * lasts * np.sign(points.velocity_rad_s))
        memory = np.exp(-np.arange(6.0 * MEMORY_S * RATE_HZ) / (MEMORY_S * RATE_HZ))
        shocks = rng.standard_normal(count + memory.size)
        noise = np.convolve(shocks, memory / np.linalg.norm(memory), "valid")[:count]
        return np.asarray(SLOW * NOISE_NM * noise)

    return record(to_and_fro(speed_rad_s), more, Conditions(), seed, name=f"run-{seed}")


@pytest.mark.parametrize(("left", "verdict"), [("noise", "no-mismatch"), ("brake", "unexplained")])
def test_what_does_not_come_again_is_noise_unless_it_leans_to_a_side(
    left: Unrepeated, verdict: str
) -> None:
    runs = [passed_again(left, k, speed) for k, speed in enumerate((50.0, 35.0, 20.0, 10.0, 25.0))]
    answer = explain(TWIN, runs[:4], runs[4:])
    said = any("does not come again" in reason for reason in answer.reasons)
    assert answer.refitted.rmse_nm / answer.floor.value_nm > 1.5
    assert answer.refitted.rmse_nm / answer.floor.repeats_nm < 1.1
    assert answer.verdict == verdict
    assert said == (left == "noise")
    assert ("does not come again" in answer.sentence) == said
