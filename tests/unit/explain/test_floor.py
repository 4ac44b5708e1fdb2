"""The noise floor's windows: what a parabola takes of slow noise is noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from agent.explain.rows.floor import noise_floor, variance_about_trend
from agent.explain.rows.noise_in_kind import is_noise_in_kind
from agent.identify.signals.lowpass import lowpass
from tests.science.explain_joint import RATE_HZ as RECORDED_HZ
from tests.science.explain_joint import (
    Conditions,
    library_of,
    nothing,
    record,
    stair,
)

RATE_HZ, CUTOFF_HZ, STRIDE, WINDOW_S = 500.0, 40.0, 4, 0.5


@pytest.mark.parametrize(("memory_s", "off"), [(0.0, 0.015), (0.025, 0.05), (0.05, 0.08)])
def test_slow_noise_counts_as_noise_and_a_trend_does_not(memory_s: float, off: float) -> None:
    rng = np.random.default_rng(0)
    noise = rng.standard_normal(100_000)
    if memory_s > 0.0:
        keep = np.exp(-1.0 / (RATE_HZ * memory_s))
        slow = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.standard_normal(100_000))
        noise += 0.5 * np.asarray(slow)
    seen = lowpass(noise, 1.0 / RATE_HZ, CUTOFF_HZ)[::STRIDE]
    length = round(WINDOW_S * RATE_HZ / STRIDE)
    windows = seen[: seen.size // length * length].reshape(-1, length)
    trend = 20.0 * np.polyval([3.0, -2.0, 1.0], np.linspace(-1.0, 1.0, length))
    independent = 2.0 * CUTOFF_HZ * WINDOW_S
    found = np.sqrt(np.mean([variance_about_trend(w + trend, independent) for w in windows]))
    assert found == pytest.approx(float(np.sqrt(np.mean(seen**2))), rel=off)


def test_short_moves_have_a_floor() -> None:
    """Without one, noise beside what is named was a mismatch "without a name"."""
    short = stair((22.0, 26.0, 30.0), stroke_rad=12.0)
    ratios = []
    for first in range(0, 60, 6):
        runs = [record(short, nothing, Conditions(), first + k) for k in range(6)]
        scene = library_of(runs).scene
        held_s = max(w.end_s - w.start_s for w in short.steady_windows())
        assert held_s < WINDOW_S  # half a second is nowhere held
        left = scene.residual_nm[scene.table.used]  # nothing is missing: all of it is noise
        floor = noise_floor(scene.table, scene.residual_nm)
        ratios.append(floor.value_nm / np.sqrt(np.mean(left**2)))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.04)
    assert np.std(ratios) < 0.08


@pytest.mark.parametrize(("memory_s", "noise"), [(0.0, True), (0.02, True), (0.2, False)])
def test_a_short_recordings_noise_is_no_memory_by_chance(memory_s: float, noise: bool) -> None:
    """A hundred lags of 1500 products each are looked at: one of them is always the greatest."""
    short = stair((22.0, 26.0, 30.0), stroke_rad=12.0)
    table = library_of([record(short, nothing, Conditions(), k) for k in range(6)]).scene.table
    rows = np.flatnonzero(table.used)
    keep = float(np.exp(-1.0 / (RECORDED_HZ * memory_s))) if memory_s > 0.0 else 0.0
    told = []
    for seed in range(20):
        white = np.random.default_rng(seed).standard_normal(table.full["time_s"].shape)
        torque = np.asarray(lfilter([1.0], [1.0, -keep], white))
        told.append(is_noise_in_kind(table, rows, table.band(torque)[rows]))
    assert told == [noise] * 20


@pytest.mark.parametrize(("every_s", "is_noise"), [(4.0, False), (0.7, True)])
def test_what_jumps_every_few_seconds_is_no_noise(every_s: float, is_noise: bool) -> None:
    """Glitches of 12 times the noise for 40 ms were three times the floor, and "agreed".

    What comes in every other window is as usual as noise is.
    """
    scene = library_of([record(stair((6.0, 20.0, 50.0), 200.0), nothing, Conditions(), 0)]).scene
    quiet = noise_floor(scene.table, scene.residual_nm).value_nm
    jumps = np.where(scene.table.rows["time_s"] % every_s < 0.04, 12.0 * quiet, 0.0)
    found = noise_floor(scene.table, scene.residual_nm + jumps).value_nm
    assert (found > 2.0 * quiet) is is_noise
    assert is_noise or found == pytest.approx(quiet, rel=0.15)


def test_noise_that_grows_with_speed_is_noise() -> None:
    scene = library_of([record(stair((6.0, 20.0, 50.0), 200.0), nothing, Conditions(), 0)]).scene
    louder = scene.residual_nm * np.abs(scene.table.rows["velocity_rad_s"]) ** 1.5
    used = scene.table.used
    found = noise_floor(scene.table, louder).value_nm
    assert found == pytest.approx(float(np.sqrt(np.mean(louder[used] ** 2))), rel=0.25)
