"""The interlock is its table: every pair is tried, what is not listed trips, a trip latches."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.cycle.interlock import TRANSITIONS, Event, Interlock, State


@pytest.mark.parametrize(("state", "event"), list(itertools.product(State, Event)))
def test_every_state_and_event(state: State, event: Event) -> None:
    after = Interlock(state, "earlier" if state is State.TRIPPED else "").after(event, "now")
    if state is State.TRIPPED:
        assert after == Interlock(State.TRIPPED, "earlier")
    elif (state, event) in TRANSITIONS:
        assert after == Interlock(TRANSITIONS[state, event])
    else:
        assert after.state is State.TRIPPED
        assert after.reason


def test_motion_is_allowed_in_one_state_only() -> None:
    assert [s for s in State if Interlock(s).may_move] == [State.MOVING]
    assert {s for s in State if Interlock(s).may_have_torque} == {State.ENABLING, State.MOVING}


@given(st.lists(st.sampled_from(Event), max_size=20))
def test_no_history_moves_without_a_preflight_or_after_a_trip(events: list[Event]) -> None:
    interlock = Interlock()
    for i, event in enumerate(events):
        interlock = interlock.after(event)
        if interlock.may_move:
            seen = events[: i + 1]
            assert seen == [Event.PREFLIGHT_PASSED, Event.ENABLE_ASKED, Event.DRIVE_ON]
