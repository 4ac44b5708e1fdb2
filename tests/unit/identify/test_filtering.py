"""Stretches, the low-pass and its cutoff."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.direction import direction_in_time, direction_of
from agent.identify.signals.lowpass import ORDER, choose_cutoff, lowpass
from agent.identify.signals.preprocess import filter_motion, read_motion
from agent.identify.signals.sampling import Stretch, find_stretches, through_neighbours
from agent.identify.signals.thinning import Part, Thinned
from agent.physics.rigid_body import PARAMETERS
from tests.science.identify_plant import Joint, record, stair


def on_time(time_s: NDArray[np.floating[Any]], **columns: NDArray[np.floating[Any]]) -> Signals:
    whole: dict[str, NDArray[np.generic]] = {
        "time_s": time_s,
        "torque_nm": np.sin(time_s),
        "velocity_rad_s": np.cos(time_s),
        **columns,
    }
    return Signals.from_columns(whole, 1.0)


def test_lowpass_is_the_butterworth_run_forward_and_backward() -> None:
    rng = np.random.default_rng(1)
    x = np.cumsum(rng.standard_normal((2, 3000)), axis=1)
    reference = sosfiltfilt(butter(ORDER, 20.0, fs=500.0, output="sos"), x, axis=1, padlen=600)
    ours = lowpass(x, 1 / 500.0, 20.0)
    inside = slice(150, -150)
    np.testing.assert_allclose(ours[:, inside], reference[:, inside], atol=1e-4 * np.ptp(x))


def test_lowpass_that_returns_fewer_samples_of_every_stretch_returns_the_same() -> None:
    strides, lengths = (1, 3, 4, 7, 4, 2), (6001, 6001, 5002, 301, 40, 2)
    at, row, parts, whole = 0, 0, [], []
    x = np.cumsum(np.random.default_rng(0).standard_normal((sum(lengths), 2)), axis=0)
    for every, length in zip(strides, lengths, strict=True):
        kept = -(-length // every)
        samples, rows = slice(at, at + length), slice(row, row + kept)
        parts.append(Part(samples, rows, 1 / 500.0, 40.0, every))
        whole.append(lowpass(x[samples].T, 1 / 500.0, 40.0)[:, ::every].T)
        at, row = at + length, row + kept
    np.testing.assert_allclose(Thinned(parts)(x), np.concatenate(whole), atol=1e-9)


def test_lowpass_is_linear_keeps_lines_and_does_not_shift() -> None:
    rng = np.random.default_rng(2)
    x, y = rng.standard_normal((2, 997))
    np.testing.assert_allclose(
        lowpass(2.0 * x - 3.0 * y, 0.01, 5.0),
        2.0 * lowpass(x, 0.01, 5.0) - 3.0 * lowpass(y, 0.01, 5.0),
        atol=1e-10,
    )
    line = np.linspace(-3.0, 5.0, 400)
    np.testing.assert_allclose(lowpass(line, 0.01, 5.0), line, atol=1e-2)
    pulse = np.exp(-0.5 * ((np.arange(801) - 400) / 20.0) ** 2)
    smooth = lowpass(pulse, 0.01, 2.0)
    np.testing.assert_allclose(smooth, smooth[::-1], atol=1e-9)


@pytest.mark.parametrize("derived", [False, True])
def test_acceleration_is_the_motions_own_up_to_a_tenth_of_the_rate(derived: bool) -> None:
    # By differences of two points it was 4 % too small here, 8 % where velocity is one, too.
    time_s, swing = np.arange(2000) * 0.01, 2.0 * np.pi * 8.0
    columns: dict[str, NDArray[np.generic]] = {
        "time_s": time_s,
        "torque_nm": np.cos(swing * time_s),
        "position_rad": np.sin(swing * time_s) / swing,
    }
    if not derived:
        columns["velocity_rad_s"] = np.cos(swing * time_s)
    (found,) = filter_motion(read_motion(Signals.from_columns(columns, 1.0)), 30.0)
    acceleration = found.regressor[200:-200, PARAMETERS.index("inertia_kg_m2")]
    truth = -swing * np.sin(swing * time_s[200:-200])
    assert float(acceleration @ truth / (truth @ truth)) == pytest.approx(1.0, abs=0.005)


def test_a_gap_cuts_and_a_single_lost_sample_is_bridged() -> None:
    time_s = np.arange(1000) * 0.002
    lost = np.delete(time_s, 500)
    assert len(find_stretches(on_time(lost)).stretches) == 1
    gap = np.concatenate((time_s[:400], time_s[400:] + 0.5))
    stretches = find_stretches(on_time(gap)).stretches
    assert [s.index.size for s in stretches] == [400, 600]


def test_masked_block_cuts_and_its_samples_are_used_nowhere() -> None:
    time_s = np.arange(1000) * 0.002
    torque = np.sin(time_s)
    torque[300:350] = np.nan
    stretches = find_stretches(on_time(time_s, torque_nm=torque)).stretches
    assert [s.index.size for s in stretches] == [300, 650]
    assert not np.isin(np.arange(300, 350), np.concatenate([s.index for s in stretches])).any()


def test_the_rate_may_change_from_pass_to_pass() -> None:
    fast = np.arange(500) * 0.0064
    slow = 10.0 + np.arange(500) * 0.128
    timing = find_stretches(on_time(np.concatenate((fast, slow))))
    assert [s.period_s for s in timing.stretches] == pytest.approx([0.0064, 0.128])
    assert not any(s.resampled for s in timing.stretches)
    assert timing.jitter_s < 1e-9


def test_uneven_time_is_resampled_and_said_so() -> None:
    rng = np.random.default_rng(3)
    time_s = np.cumsum(rng.uniform(0.001, 0.004, 2000))
    signals = on_time(time_s, velocity_rad_s=np.sin(time_s), torque_nm=np.cos(time_s))
    motion = read_motion(signals)
    assert motion.timing.stretches[0].resampled
    assert any("uneven" in note for note in motion.notes)
    stretch = motion.timing.stretches[0]
    np.testing.assert_allclose(motion.velocity_rad_s[0], np.sin(stretch.time_s), atol=1e-4)
    back = stretch.off_grid(signals, motion.velocity_rad_s[0])
    np.testing.assert_allclose(back, np.sin(time_s), atol=1e-4)


def _swing_rad(time_s: Floats, step_rad: float = 2.0 * np.pi / (1 << 20)) -> Floats:
    """Return what an encoder reads of a fast swing, shape (n,)."""
    angle = 40.0 * np.sin(2.5 * time_s) + 1.2 * np.sin(19.0 * time_s + 1.0)
    return np.asarray(np.floor(angle / step_rad) * step_rad)


def _off_rad(stretch: Stretch, signals: Signals) -> float:
    """Return the rms of what a position on the grid differs by from the swing, less its mean."""
    assert signals.position_rad is not None
    on_grid = stretch.on_grid(signals, signals.position_rad)
    return float(np.std(on_grid - _swing_rad(stretch.time_s, 1e-12)))


@pytest.mark.parametrize("share", [0.003, 0.012, 0.09, 0.2])
def test_stamps_of_the_instants_of_sampling_are_believed(share: float) -> None:
    """One percent of a period had been taken for even: 300 times the encoder's noise."""
    period_s = 0.002
    shaken = np.random.default_rng(5).normal(0.0, share * period_s, 5000)
    time_s = np.sort(np.arange(5000) * period_s + shaken)
    signals = on_time(time_s, position_rad=_swing_rad(time_s), torque_nm=np.cos(time_s))
    (stretch,) = find_stretches(signals).stretches
    assert stretch.resampled
    assert stretch.uneven == (share >= 0.09)  # less is nothing to be told of
    assert _off_rad(stretch, signals) < 1.5 * 2.0 * np.pi / (1 << 20)


@pytest.mark.parametrize("late_s", [2e-5, 6e-4])
def test_stamps_that_the_motion_denies_are_not_believed(late_s: float) -> None:
    """Rows sampled evenly, stamped by a computer that gets round to it a little later."""
    even_s: Floats = np.arange(5000, dtype=np.float64) * 0.002
    given_s = np.sort(even_s + np.random.default_rng(6).exponential(late_s, 5000))
    signals = on_time(given_s, position_rad=_swing_rad(even_s), torque_nm=np.cos(even_s))
    motion = read_motion(signals)
    (stretch,) = motion.timing.stretches
    assert not stretch.resampled
    np.testing.assert_allclose(stretch.time_s, even_s, atol=12.0 * late_s)
    np.testing.assert_array_equal(stretch.on_grid(signals, even_s), even_s)
    assert any("sampled evenly" in note for note in motion.notes) == (late_s > 2e-4)


def test_stamps_in_whole_milliseconds_at_400_hz_are_not_believed() -> None:
    even_s: Floats = np.arange(4000, dtype=np.float64) * 0.0025
    signals = on_time(np.round(even_s, 3), position_rad=_swing_rad(even_s))
    (stretch,) = find_stretches(signals).stretches
    assert not stretch.resampled
    assert stretch.period_s == pytest.approx(0.0025, rel=1e-3)


def test_a_joint_at_rest_says_nothing_of_its_stamps() -> None:
    time_s = np.cumsum(np.random.default_rng(7).uniform(0.001, 0.003, 500))
    (stretch,) = find_stretches(on_time(time_s, position_rad=np.ones(500))).stretches
    assert stretch.resampled


@given(
    steps=st.lists(st.floats(0.2, 3.0), min_size=5, max_size=12),
    powers=st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4),
    shares=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=5),
)
def test_between_samples_any_cubic_is_found(
    steps: list[float], powers: list[float], shares: list[float]
) -> None:
    time_s = np.cumsum(steps) - sum(steps) / 2.0
    at_s = time_s[0] + np.array(shares) * (time_s[-1] - time_s[0])
    values: Floats = np.asarray(np.polyval(powers, time_s), dtype=np.float64)
    found = through_neighbours(at_s, time_s, values)
    scale = float(np.abs(np.polyval(np.abs(powers), np.abs(time_s))).max()) + 1.0
    np.testing.assert_allclose(found, np.polyval(powers, at_s), atol=1e-9 * scale)


def test_beside_what_is_no_number_a_line_stands() -> None:
    time_s: Floats = np.arange(8.0, dtype=np.float64)
    values: Floats = np.where(time_s == 6.0, np.nan, time_s**2)
    found = through_neighbours(np.array([1.5, 4.5, 5.5]), time_s, values)
    np.testing.assert_allclose(found[:2], [2.25, 20.5])  # the line's, as 6 is a neighbour of 4.5
    assert np.isnan(found[2])


def test_a_few_missing_samples_are_no_jumps_in_time() -> None:
    """One row in 200 without a torque: counted as even, each had been a kick of the joint."""
    time_s = np.arange(2000) * 0.016
    torque = np.cos(3.0 * time_s)
    torque[100::200] = np.nan
    motion = read_motion(on_time(time_s, velocity_rad_s=np.sin(3.0 * time_s), torque_nm=torque))
    (stretch,) = motion.timing.stretches
    assert stretch.period_s == pytest.approx(0.016, rel=1e-9)
    acceleration = np.gradient(motion.velocity_rad_s[0], stretch.period_s)
    np.testing.assert_allclose(acceleration, 3.0 * np.cos(3.0 * stretch.time_s), atol=0.15)


def test_direction_needs_more_than_noise() -> None:
    rng = np.random.default_rng(4)
    velocity = np.concatenate((np.zeros(500), np.full(500, 1.0), np.full(500, -1.0)))
    noisy = velocity + 0.05 * rng.standard_normal(velocity.size)
    direction = direction_of(noisy, 0.002, 10.0, 0.05)
    assert np.mean(direction[:450] == 0.0) > 0.99
    assert np.all(direction[550:950] == 1.0)
    assert np.all(direction[1050:] == -1.0)


def test_a_turn_from_a_slow_speed_to_a_fast_one_is_not_drawn_towards_the_slow_one() -> None:
    """One such sample of a stair of 20 s moved gravity by half of a standard error."""
    period_s, rng = 0.004, np.random.default_rng(3)
    time_s = period_s * np.arange(500)
    # 2 rad/s backwards, 40 rad/s forwards, in a ramp that begins and ends softly.
    ramp = np.clip((time_s - 1.0) / 0.08, 0.0, 1.0)
    velocity = -2.0 + 42.0 * (3.0 * ramp**2 - 2.0 * ramp**3)
    clean = direction_in_time(velocity + 0.01 * rng.standard_normal(500), period_s, 2.2, 0.01)
    np.testing.assert_array_equal(clean, np.sign(velocity))
    # Noise that hides where it turns leaves the samples there unknown, and no other one wrong.
    noisy = direction_in_time(velocity + 2.0 * rng.standard_normal(500), period_s, 2.2, 2.0)
    wrong = np.flatnonzero(noisy * velocity < 0.0)
    assert np.all(np.abs(velocity[wrong]) < 2.0)
    assert np.mean(noisy[300:] == 1.0) == 1.0


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.5])
def test_cutoff_keeps_the_motion_and_not_the_noise(noise: float) -> None:
    motion = stair(rate_hz=500.0)
    velocity = motion.velocity_rad_s + noise * np.random.default_rng(5).standard_normal(
        motion.velocity_rad_s.size
    )
    cutoff = choose_cutoff([(velocity, 0.002)], differences=1)
    assert 2.0 < cutoff.frequency_hz < 20.0
    assert cutoff.noise_share <= 0.101


def test_all_columns_go_through_the_same_filter() -> None:
    joint, motion = Joint(gravity_sin_nm=0.3, gear_ratio=20.0), stair()
    signals = record(joint, motion, noise_nm=0.0, velocity_noise_rad_s=0.0)
    filtered = filter_motion(read_motion(signals), 6.0)[0]
    truth = np.array([0.0184, 0.0107, 0.6042, 0.3, 0.0, 0.0])
    error = (filtered.regressor @ truth - filtered.torque_nm)[filtered.usable]
    # What is left stands at the very ends, where the filter's extension is no motion.
    assert np.sqrt(np.mean(error**2)) < 5e-3 * np.std(filtered.torque_nm)
    assert np.sqrt(np.mean(error[300:-300] ** 2)) < 2e-3 * np.std(filtered.torque_nm)


def test_the_cutoff_does_not_fall_with_how_often_the_work_was_repeated() -> None:
    """Hours of one and the same work have a spectrum of lines, and nothing between them."""
    level = np.tile([5.0, -5.0, 40.0, -40.0], 4)
    work = np.concatenate([v * np.hanning(250) for v in level])  # 16 s of it at 250 Hz
    found = []
    for times in (3, 30, 300):
        noise = 1e-3 * np.random.default_rng(times).standard_normal(times * work.size)
        velocity = np.tile(work, times) + noise
        found.append(choose_cutoff([(velocity, 0.004)], differences=1).frequency_hz)
    np.testing.assert_allclose(found, found[0], rtol=0.05)
