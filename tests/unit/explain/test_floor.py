"""The noise floor's windows: what a parabola takes of slow noise is noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from agent.explain.rows.floor import variance_about_trend
from agent.identify.signals.lowpass import lowpass

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
