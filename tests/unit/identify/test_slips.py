"""A position that jumps, and whatever else looks like that for a moment."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.slips import slips, slips_said

GEAR, PERIOD_S, COUNT_RAD, RPM = 100.0, 0.004, 2.0 * np.pi / 4096, 2.0 * np.pi / 60.0
TIME_S: Floats = np.arange(0.0, 20.0, PERIOD_S)


def driven(position_off: Floats | float = 0.0, late_s: Floats | float = 0.0) -> Signals:
    """Return a joint that swings, counted and with whole revolutions a minute, a sample late."""
    w, at = 2.0 * np.pi / 7.0, TIME_S + late_s
    position = 60.0 / w * np.sin(w * at) + position_off
    velocity = 60.0 * np.cos(w * (at - PERIOD_S))
    columns = {
        "time_s": TIME_S,
        "position_rad": np.floor(position / COUNT_RAD) * COUNT_RAD,
        "velocity_rad_s": np.floor(velocity / RPM) * RPM,
        "torque_nm": np.sign(velocity),
    }
    return Signals.from_columns(columns, GEAR, name="run")


@settings(max_examples=50, deadline=None)
@given(st.integers(50, TIME_S.size - 50), st.floats(0.3, 20.0), st.booleans())
def test_an_encoder_that_slips_is_told_when_and_by_how_much(
    row: int, size_rad: float, back: bool
) -> None:
    by_rad = -size_rad if back else size_rad
    ((at_s, found_rad),) = slips(driven(np.where(np.arange(TIME_S.size) < row, 0.0, by_rad)))
    assert at_s == pytest.approx(TIME_S[row], abs=1e-9)
    assert found_rad == pytest.approx(by_rad, abs=0.05)


def test_a_slip_is_told_on_the_arms_side() -> None:
    (said,) = slips_said([driven(np.where(TIME_S < 8.0, 0.0, np.radians(1.5) * GEAR))])
    assert said.startswith("run: at 8 s the position jumps by 1.5 degrees of the arm")


def test_answers_that_come_late_are_no_slips() -> None:
    late_s = np.zeros_like(TIME_S)
    late_s[48::97] = -3.0 * PERIOD_S  # of another moment, each by itself
    assert slips(driven(late_s=late_s)) == ()


def test_a_position_that_begins_anew_every_turn_slips_nowhere() -> None:
    whole = driven()
    assert whole.position_rad is not None
    turns = np.floor(whole.position_rad / (2.0 * np.pi))
    assert slips(driven(-2.0 * np.pi * turns)) == ()
    assert slips(whole) == ()
