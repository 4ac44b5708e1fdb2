"""A slow joint behind a coarse encoder, whose true path is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.identify.result import Floats
from agent.identify.reversals.driving import between_edges, driving_velocity
from agent.identify.reversals.turns import read_tracks
from agent.identify.signals.lowpass import lowpass
from tests.science.reversal_plant import FINE_S, SAMPLE_S, bristled, own_swings, sampled

STEP_RAD = 2.0 * np.pi / (1 << 16)
CUTOFF_HZ = 31.25


def test_a_turn_is_where_the_joint_turns_not_where_its_last_count_begins() -> None:
    late_s = []
    for seed in range(700_000, 700_003):
        run = bristled("bliman-sorine", own_swings(seed))
        (track,) = read_tracks([sampled(run, seed)]).tracks
        true = _at_samples(run.velocity_rad_s, seed)
        for turn in track.turns:
            near = slice(turn.at - 40, turn.at + 60)
            late_s.append(_turned_s(track.driving_rad_s[near]) - _turned_s(true[near]))
    # The last count begins 9 ms before the turn, of 28 ms that it lasts.
    assert len(late_s) == 48
    assert abs(float(np.mean(late_s))) < 1.5e-3
    assert float(np.std(late_s)) < 4e-3


@given(phase=st.floats(0.0, 1.0), speed=st.floats(0.02, 2.0), rest_s=st.floats(0.0, 1.0))
@settings(max_examples=25, deadline=None)
def test_the_motion_stays_in_its_steps_and_never_goes_back(
    phase: float, speed: float, rest_s: float
) -> None:
    time = np.arange(0.0, 2.0 + rest_s, SAMPLE_S)
    going = np.minimum(time, 1.0) - np.maximum(time - 1.0 - rest_s, 0.0)
    raw = _counted(speed * going, phase)
    velocity = np.gradient(lowpass(raw, SAMPLE_S, CUTOFF_HZ), SAMPLE_S)
    path = between_edges(raw, velocity, period_s=SAMPLE_S, cutoff_hz=CUTOFF_HZ, step_rad=STEP_RAD)
    # A speed that changes at once is no motion of a joint: there the path may cut the corner.
    calm = np.abs(time - 1.0) > 0.05
    calm &= np.abs(time - 1.0 - rest_s) > 0.05
    assert np.abs(path - raw)[calm].max() < 0.75 * STEP_RAD

    driving = driving_velocity(
        raw,
        velocity,
        [int(np.argmax(raw))],
        period_s=SAMPLE_S,
        cutoff_hz=CUTOFF_HZ,
        step_rad=STEP_RAD,
    )
    assert driving[time < 1.0 - SAMPLE_S].min() >= 0.0
    assert driving[time > 1.0 + rest_s + SAMPLE_S].max() <= 0.0


@pytest.mark.parametrize("step_rad", [0.0, STEP_RAD])
def test_a_joint_that_steadily_goes_on_is_driven_at_its_speed(step_rad: float) -> None:
    time = np.arange(0.0, 2.0, SAMPLE_S)
    raw = _counted(0.3 * time, 0.4) if step_rad else 0.3 * time
    driving = driving_velocity(
        raw,
        np.full(time.size, 0.3),
        [],
        period_s=SAMPLE_S,
        cutoff_hz=CUTOFF_HZ,
        step_rad=step_rad,
    )
    assert driving[100:-100] == pytest.approx(0.3, rel=0.02)


def _counted(position_rad: Floats, phase: float) -> Floats:
    return np.asarray(np.floor(position_rad / STEP_RAD + phase) * STEP_RAD)


def _turned_s(velocity: Floats) -> float:
    """Return the middle of the time from which on the velocity has its last sign."""
    one_way = np.flatnonzero(velocity * velocity[0] > 0.0)[-1]
    other_way = np.flatnonzero(velocity * velocity[-1] > 0.0)[0]
    return float(0.5 * (one_way + other_way)) * SAMPLE_S


def _at_samples(values: Floats, seed: int) -> Floats:
    """Return the values at the samples that `sampled` draws of this seed."""
    stride = round(SAMPLE_S / FINE_S)
    return values[int(np.random.default_rng(seed).integers(stride)) :: stride]
