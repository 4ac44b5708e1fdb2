"""What a drive reports: delays of any fraction of a sample, constants, limits; drift in words."""

from __future__ import annotations

import datetime
import tomllib

import numpy as np
import pytest
from numpy.typing import NDArray

from agent.physics.effects import Motion, unix_s
from agent.physics.friction_drift import RunIn
from agent.physics.reported import Delay, TorqueConstant, at_times
from agent.physics.twin import Effect, Twin, TwinError, format_twin, parse_twin

Floats = NDArray[np.float64]

TIME = np.linspace(0.0, 6.0, 3001)
PLAIN = Twin("r", 1, 50.0, 0.02, 0.5, 0.01, 0.3, 0.0)


def run(late_s: float = 0.0) -> Motion:
    """Return a motion, seen late by some seconds."""
    time = TIME - late_s
    return Motion(
        30.0 * np.cos(2.0 * time),
        -60.0 * np.sin(2.0 * time),
        np.sign(np.cos(2.0 * time)),
        15.0 * np.sin(2.0 * time),
        TIME,
    )


def with_effect(**numbers: float) -> Twin:
    effects = (Effect("measurement-delay", numbers),)
    return Twin(**{**vars(PLAIN), "effects": effects})


@pytest.mark.parametrize("delay_s", [0.0007, 0.002, -0.0113, 0.02])
def test_a_delay_shifts_a_smooth_signal_and_knows_where_it_does_not(delay_s: float) -> None:
    wave = np.sin(11.0 * TIME)
    late = Delay(delay_s).reported(TIME, wave)
    outside = (TIME - delay_s < 0.0) | (TIME - delay_s > TIME[-1])
    assert np.isnan(late).tolist() == outside.tolist()
    assert late[~outside] == pytest.approx(np.sin(11.0 * (TIME - delay_s))[~outside], abs=1e-7)
    there = Delay(delay_s).true(TIME, late)
    known = np.isfinite(there)
    assert np.mean(known) > 0.98
    assert there[known] == pytest.approx(wave[known], abs=1e-6)


def test_interpolation_follows_uneven_time_and_keeps_samples() -> None:
    time = np.cumsum(np.random.default_rng(2).uniform(0.5e-3, 3e-3, 400))
    cubic = 1.0 + 2.0 * time - 3.0 * time**2 + 4.0 * time**3
    when = np.linspace(time[0], time[-1], 777)
    expected = 1.0 + 2.0 * when - 3.0 * when**2 + 4.0 * when**3
    assert at_times(time, cubic, when) == pytest.approx(expected, abs=1e-9)
    holed = cubic.copy()
    holed[100] = np.nan
    assert np.flatnonzero(np.isnan(at_times(time, holed, time))).tolist() == [100]
    with pytest.raises(ValueError, match="four rising samples"):
        at_times(time[::-1], cubic, when)


def test_a_late_torque_is_the_torque_of_an_earlier_motion() -> None:
    late = with_effect(torque_delay_s=0.013).predict(run())
    earlier = PLAIN.predict(run(0.013))
    known = np.isfinite(late)
    assert np.flatnonzero(~known).tolist() == list(range(7))
    # At a reversal friction jumps between two samples, and no interpolation knows where.
    away = known & (np.abs(np.cos(2.0 * (TIME - 0.013))) > 0.02)
    assert late[away] == pytest.approx(earlier[away], abs=1e-6)


def test_a_late_velocity_is_moved_back_to_its_position() -> None:
    true, seen = run(), run(0.013)
    mixed = Motion(
        seen.velocity_rad_s,
        seen.acceleration_rad_s2,
        seen.direction,
        true.position_rad,
        TIME,
    )
    parts = with_effect(velocity_delay_s=0.013).predict_parts(mixed)
    corrected = np.sum(list(parts.values()), axis=0)
    away = np.isfinite(corrected) & (np.abs(np.cos(2.0 * TIME)) > 0.02)
    assert np.mean(away) > 0.95
    assert corrected[away] == pytest.approx(PLAIN.predict(true)[away], abs=1e-6)
    assert np.nanmax(np.abs(parts["measurement-delay"])) > 0.01


def test_a_delay_needs_time() -> None:
    motion = Motion(run().velocity_rad_s, run().acceleration_rad_s2, run().direction)
    weightless = Twin(
        "r", 1, 50.0, 0.02, 0.5, 0.01, effects=with_effect(torque_delay_s=1.0).effects
    )
    with pytest.raises(TwinError, match="time_s"):
        weightless.predict(motion)


def test_magnets_that_are_hot_enough_to_give_nothing_are_refused() -> None:
    law = TorqueConstant(1.0, -0.01, 20.0)
    assert law.reported_nm(np.ones(1), np.array([70.0])) == pytest.approx([2.0])
    with pytest.raises(ValueError, match="above 0"):
        law.reported_nm(np.ones(1), np.array([120.0]))
    with pytest.raises(ValueError, match="motor_temperature_degc"):
        law.reported_nm(np.ones(1), None)


def test_instants_are_read_in_every_way_that_toml_and_recordings_write_them() -> None:
    at = datetime.datetime(2026, 1, 31, 6, 0, tzinfo=datetime.UTC)
    for value in (at, "2026-01-31T06:00:00Z", "2026-01-31T07:00:00+01:00"):
        assert unix_s(value) == at.timestamp()
    local = tomllib.loads("at = 2026-01-31T06:00:00")["at"]
    for wrong in (local, "yesterday", 3.0, None):
        with pytest.raises(ValueError, match="with its zone"):
            unix_s(wrong)


def test_a_drift_written_with_a_toml_date_survives_and_predicts() -> None:
    numbers = {
        "coulomb_nm_per_h": 0.01,
        "reference_started_at": datetime.datetime(2026, 1, 31, 6, 0, tzinfo=datetime.UTC),
    }
    law = Twin(**{**vars(PLAIN), "effects": (Effect("friction-drift", numbers),)})
    again = parse_twin(format_twin(law))
    assert again == law
    later = Motion(**{**vars(run()), "started_at_unix_s": unix_s("2026-01-31T16:00:00Z")})
    grown = again.predict(later) - PLAIN.predict(later)
    assert grown == pytest.approx(0.01 * (10.0 + TIME / 3600.0) * later.direction)
    with pytest.raises(TwinError, match="instant at which the recording started"):
        again.predict(run())


def test_running_in_settles_and_does_not_reach_back() -> None:
    law = RunIn(-0.2, 0.0, 5.0)
    one = np.ones(3)
    settled = law.torque_nm(one, one, np.array([0.0, 5.0, 1e6]))
    assert settled == pytest.approx([0.0, -0.2 * (1.0 - np.exp(-1.0)), -0.2])
    with pytest.raises(ValueError, match="after reference_started_at"):
        law.torque_nm(one, one, np.array([-1.0, 0.0, 1.0]))
