"""A position that begins anew with every turn is counted on, and nothing else is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.wrapped import counted_on

TURN = 2.0 * math.pi
TIME = np.arange(0.0, 8.0, 2e-3)


def signals(position: Floats, gear_ratio: float = 80.0) -> Signals:
    columns = {"time_s": TIME, "position_rad": position, "torque_nm": np.cos(TIME)}
    return Signals.from_columns(columns, gear_ratio)


@given(
    begins=st.floats(-40.0, 40.0),
    turns=st.floats(2.5, 60.0),
    zero=st.sampled_from([0.0, -math.pi]),
    of_the_arm=st.booleans(),
)
def test_where_it_goes_on_is_found(
    begins: float, turns: float, zero: float, of_the_arm: bool
) -> None:
    turn = 80.0 * TURN if of_the_arm else TURN
    true = begins + turn * turns * np.sin(0.5 * TIME) ** 2
    if of_the_arm:
        true = begins + turn * 3.0 * np.sin(0.2 * TIME) ** 2
    wrapped = np.mod(true - zero, turn) + zero
    found, count, loses_the_arm = counted_on(signals(wrapped))
    assert count >= 2
    assert loses_the_arm is not of_the_arm
    assert found.position_rad is not None
    offset = found.position_rad - true
    np.testing.assert_allclose(offset, offset[0], atol=1e-6)


@pytest.mark.parametrize(
    "position",
    [
        20.0 * np.sin(TIME),
        np.where((TIME > 3.0) & (TIME < 3.01), 6.3, 0.1 * np.sin(TIME)) + TIME,  # a glitch
        np.round(2.0 * np.sin(TIME)),  # coarse
        np.where(np.floor(TIME) % 2.0 > 0.0, 3.0, 0.0),  # jumps that are no turn
        np.zeros_like(TIME),
    ],
)
def test_what_does_not_begin_anew_stays_as_it_is(position: Floats) -> None:
    found, count, _ = counted_on(signals(position))
    assert count == 0
    assert found.position_rad is not None
    np.testing.assert_array_equal(found.position_rad, position)
