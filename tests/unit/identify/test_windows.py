"""The steady-window finder on stairs of many shapes, from the velocity alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import read_motion
from agent.identify.signals.segments import merge_steady, monotone_chain, partition, trend_of
from agent.identify.signals.windows import SteadyWindow, find_windows
from tests.science.identify_plant import SPEEDS_RAD_S, stair

Floats = NDArray[np.float64]


def windows_of(velocity: Floats, period_s: float = 0.004) -> tuple[SteadyWindow, ...]:
    columns: dict[str, NDArray[np.generic]] = {
        "time_s": np.arange(velocity.size) * period_s,
        "torque_nm": np.zeros(velocity.size),
        "velocity_rad_s": velocity,
    }
    return find_windows(read_motion(Signals.from_columns(columns, 1.0)))


def expected(speeds: tuple[float, ...]) -> list[float]:
    return [sign * v for v in speeds for sign in (1.0, -1.0)]


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("noise", [0.0, 0.002, 0.01])
def test_every_step_is_found_once_at_any_scale(scale: float, noise: float) -> None:
    motion = stair()
    rng = np.random.default_rng(0)
    velocity = motion.velocity_rad_s + noise * 140.0 * rng.standard_normal(motion.time_s.size)
    found = windows_of(scale * velocity)
    levels = np.array([w.velocity_rad_s for w in found]) / scale
    truth = np.array(expected(SPEEDS_RAD_S))
    if noise < 0.01:
        np.testing.assert_allclose(levels, truth, rtol=0.02, atol=3.0 * noise)
    else:
        # 1.4 rad/s of noise: the slowest step (2 rad/s) may be missed, none may be invented.
        assert np.all(np.min(np.abs(levels[:, None] - truth), axis=1) < 0.02 * np.abs(levels) + 0.4)
        assert len(found) >= truth.size - 4


def test_windows_lie_inside_their_steps() -> None:
    motion = stair()
    flat = np.abs(np.gradient(motion.velocity_rad_s)) < 1e-9
    for window in windows_of(motion.velocity_rad_s):
        assert np.all(flat[window.start + 1 : window.stop - 1])


@pytest.mark.parametrize("step", [0.1047, 0.5])
def test_quantised_velocity(step: float) -> None:
    velocity = np.round(stair().velocity_rad_s / step) * step
    levels = [w.velocity_rad_s for w in windows_of(velocity)]
    np.testing.assert_allclose(levels, expected(SPEEDS_RAD_S), rtol=0.03, atol=step)


def test_a_slow_quantised_ramp_is_no_stair() -> None:
    ramp = np.concatenate(
        (np.zeros(500), np.linspace(0.0, 20.0, 5000), np.linspace(20.0, 0.0, 5000))
    )
    # The turning point is indeed one constant reading for a second; the ramps are not.
    assert [w.velocity_rad_s for w in windows_of(np.round(ramp))] in ([], [20.0])


def test_ringing_after_a_step_is_settling() -> None:
    motion = stair((20.0, 60.0), longest_s=3.0, stroke_rad=200.0)
    t = motion.time_s
    starts = np.flatnonzero(np.diff(np.abs(np.gradient(motion.velocity_rad_s)) < 1e-9))
    velocity = motion.velocity_rad_s.copy()
    for start in starts[::2]:
        after = t[start:] - t[start]
        velocity[start:] += 3.0 * np.exp(-after / 0.15) * np.sin(2 * np.pi * 8.0 * after)
    found = windows_of(velocity)
    np.testing.assert_allclose([w.velocity_rad_s for w in found], [20, -20, 60, -60], rtol=0.01)


def test_stick_slip_that_reverses_still_makes_one_window() -> None:
    rng = np.random.default_rng(1)
    noise = np.convolve(rng.standard_normal(2009), np.ones(10) / np.sqrt(10), mode="valid")
    found = windows_of(
        np.concatenate((np.full(1000, 20.0), np.zeros(100), 0.3 + 0.3 * noise[:2000]))
    )
    assert [round(w.velocity_rad_s, 1) for w in found] == [20.0, 0.3]


def test_standstill_and_sine_are_not_steady_motion() -> None:
    t = np.arange(6000) * 0.004
    assert windows_of(np.zeros(6000)) == ()
    covered = sum(w.stop - w.start for w in windows_of(30.0 * np.sin(2 * np.pi * 0.5 * t)))
    assert covered < 0.2 * t.size


def test_partition_finds_a_change_exactly() -> None:
    values = np.concatenate((np.zeros(40), np.ones(30), np.full(50, -2.0)))
    noisy = values + 0.05 * np.random.default_rng(2).standard_normal(values.size)
    assert partition(noisy, 0.1) == [(0, 40), (40, 70), (70, 120)]
    assert merge_steady(noisy, [(0, 20), (20, 40), (40, 120)], 0.03)[0] == (0, 40)


@given(
    steps=st.lists(st.tuples(st.integers(1, 30), st.floats(-50.0, 50.0)), max_size=12),
    noise=st.sampled_from([0.0, 0.05, 3.0]),
    penalty=st.sampled_from([0.0, 0.1, 20.0]),
)
def test_a_compiled_partition_is_the_same(
    steps: list[tuple[int, float]], noise: float, penalty: float
) -> None:
    levels = np.array([level for count, level in steps for _ in range(count)], dtype=np.float64)
    values = levels + noise * np.random.default_rng(4).standard_normal(levels.size)
    assert partition(values, penalty, compiled=True) == partition(values, penalty)


def test_trend_tells_a_ramp_from_noise() -> None:
    rng = np.random.default_rng(3)
    assert trend_of(5.0 + rng.standard_normal(60)).is_steady(60, 0.03)
    assert not trend_of(5.0 + np.linspace(0, 3, 60) + 0.1 * rng.standard_normal(60)).is_steady(
        60, 0.03
    )
    bow = 5.0 + 2.0 * np.sin(np.linspace(0, np.pi, 60))
    assert not trend_of(bow).is_steady(60, 0.03)


def test_monotone_chain_marks_the_inside_of_a_ramp() -> None:
    levels = np.array([0.0, 1.0, 2.0, 3.0, 3.0, 9.0])
    assert monotone_chain(levels, 1.0).tolist() == [False, True, True, False, False, False]
