"""Recordings of 1 kHz and more, thinned: nothing of the compared band is lost, bent or late."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.explain.rows.coarser import OFTEN_ENOUGH_HZ, coarsened
from agent.explain.rows.run import Run
from agent.identify.result import Floats

GEAR_RATIO = 100.0


def run_of(time: Floats, torque: Floats, **columns: Floats) -> Run:
    motion = {"position_rad": np.cumsum(np.ones_like(time)), "velocity_rad_s": np.cos(time)}
    return Run.from_columns(
        {"time_s": time, "torque_nm": torque, **motion, **columns}, GEAR_RATIO, name="fast"
    )


def sampled(rate_hz: float, seconds: float = 2.0) -> Floats:
    return np.asarray(np.arange(round(seconds * rate_hz)) / rate_hz)


@given(
    st.sampled_from([1000.0, 1250.0, 2000.0, 4000.0, 8000.0]),
    st.floats(0.5, 40.0),
    st.floats(0.0, 6.28),
)
def test_a_wave_of_the_band_is_as_high_and_as_late_as_before(
    rate_hz: float, frequency_hz: float, phase: float
) -> None:
    time = sampled(rate_hz)
    (thinned,) = coarsened([run_of(time, np.cos(2.0 * np.pi * frequency_hz * time + phase))])
    own = thinned.signals
    rate = 1.0 / np.median(np.diff(own.time_s))
    assert OFTEN_ENOUGH_HZ <= 1.001 * rate < 2.0 * OFTEN_ENOUGH_HZ
    wave = np.cos(2.0 * np.pi * frequency_hz * own.time_s + phase)
    np.testing.assert_allclose(own.torque_nm, wave, atol=1e-3)


@pytest.mark.parametrize("rate_hz", [100.0, 500.0, 990.0])
def test_what_is_sampled_no_more_often_stays_as_it_is(rate_hz: float) -> None:
    run = run_of(sampled(rate_hz), np.ones(round(2.0 * rate_hz)))
    assert coarsened([run])[0] is run


def test_what_would_fold_onto_rest_is_gone() -> None:
    """A wave a little beside the thinned rate would be a slow one there."""
    time = sampled(1000.0)
    (thinned,) = coarsened([run_of(time, np.sin(2.0 * np.pi * 495.0 * time))])
    assert np.max(np.abs(thinned.signals.torque_nm)) < 0.01
    # That it was recorded still counts, where an effect is asked whether it drowns in it.
    assert thinned.thinned_away_nm2 == pytest.approx(0.5, rel=0.01)


def test_a_gap_stays_one_and_readings_far_apart_are_kept() -> None:
    time = np.delete(sampled(1000.0), np.arange(700, 900))
    warmth = np.full(time.shape, np.nan)
    warmth[::100] = 30.0 + time[::100]
    (thinned,) = coarsened([run_of(time, np.ones_like(time), gearbox_temperature_degc=warmth)])
    steps = np.diff(thinned.signals.time_s)
    assert np.count_nonzero(steps > 0.1) == 1
    inside = (thinned.signals.time_s > 0.1) & (thinned.signals.time_s < 0.6)
    np.testing.assert_allclose(
        thinned.columns["gearbox_temperature_degc"][inside],
        30.0 + thinned.signals.time_s[inside],
        atol=0.01,
    )
