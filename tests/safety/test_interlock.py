"""The interlock is its table: every pair is tried, what is not listed trips, a trip latches."""

from __future__ import annotations

import dataclasses
import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.cycle.interlock import TRANSITIONS, Event, Interlock, State


def test_the_table_is_the_one_that_was_drawn() -> None:
    """Written out here once more: a change of the table must be meant."""
    assert dict(TRANSITIONS) == {
        (State.LOCKED, Event.PREFLIGHT_PASSED): State.READY,
        (State.READY, Event.ENABLE_ASKED): State.ENABLING,
        (State.ENABLING, Event.DRIVE_ON): State.MOVING,
        (State.MOVING, Event.MOTION_DONE): State.DISABLING,
        (State.DISABLING, Event.DRIVE_OFF): State.DONE,
    }


@pytest.mark.parametrize("state", [s for s in State if s is not State.TRIPPED])
def test_a_trip_keeps_its_own_reason_and_is_never_without_one(state: State) -> None:
    assert Interlock(state).after(Event.TRIP, "too hot") == Interlock(State.TRIPPED, "too hot")
    assert Interlock(state).after(Event.TRIP).reason == "tripped without a reason"


def test_an_interlock_begins_locked_and_cannot_be_changed() -> None:
    interlock = Interlock()
    assert (interlock.state, interlock.reason) == (State.LOCKED, "")
    with pytest.raises(dataclasses.FrozenInstanceError):
        interlock.state = State.MOVING  # type: ignore[misc]  # that is the point


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


@given(st.lists(st.sampled_from(Event), max_size=20))
def test_no_history_moves_without_a_preflight_or_after_a_trip(events: list[Event]) -> None:
    interlock = Interlock()
    for i, event in enumerate(events):
        interlock = interlock.after(event)
        if interlock.may_move:
            seen = events[: i + 1]
            assert seen == [Event.PREFLIGHT_PASSED, Event.ENABLE_ASKED, Event.DRIVE_ON]
