"""The words of CiA 402 and the table that answers them."""

from __future__ import annotations

import itertools

import pytest

from drivers.cia402.states import NEXT_CONTROLWORD, next_controlword
from drivers.cia402.words import (
    REDUCED,
    Controlword,
    Mode,
    State,
    error_words,
    state_of,
    supported_mode_names,
    supports_mode,
)
from drivers.ports import DriveState, Goal

FAULT_RESET = 0x80


@pytest.mark.parametrize(
    ("statusword", "state"),
    [
        (0x0000, State.NOT_READY),
        (0x0250, State.SWITCH_ON_DISABLED),
        (0x0231, State.READY),
        (0x0233, State.SWITCHED_ON),
        (0x1637, State.ENABLED),
        (0x0217, State.QUICK_STOP),
        (0x021F, State.FAULT_REACTION),
        (0x0218, State.FAULT),
        (0x0238, State.FAULT),  # bit 5 says nothing about a fault
    ],
)
def test_statusword_patterns_of_the_standard(statusword: int, state: State) -> None:
    assert state_of(statusword) is state


def test_only_the_masked_bits_decide() -> None:
    # voltage (4), warning (7), manufacturer (8), remote (9), reached (10), limit (11) ...
    for noise in (0x0010, 0x0080, 0x0100, 0x0200, 0x0400, 0x0800, 0x1000, 0xFF90):
        assert state_of(0x0027 | noise) is State.ENABLED


def test_a_pattern_that_means_nothing_is_no_state() -> None:
    assert state_of(0x0002) is None
    assert state_of(0x0060 | 0x01) is None


def test_every_state_can_be_told() -> None:
    assert {state_of(bits) for bits in range(128)} - {None} == set(State)
    assert set(REDUCED) == set(State)


@pytest.mark.parametrize(("goal", "state"), list(itertools.product(Goal, State)))
def test_every_pair_has_an_answer_and_none_resets_a_fault(goal: Goal, state: State) -> None:
    assert not NEXT_CONTROLWORD[goal, state] & FAULT_RESET


def test_the_table_climbs_to_operation_enabled_and_no_further() -> None:
    effect = {
        (State.SWITCH_ON_DISABLED, Controlword.SHUTDOWN): State.READY,
        (State.READY, Controlword.SWITCH_ON): State.SWITCHED_ON,
        (State.SWITCHED_ON, Controlword.ENABLE_OPERATION): State.ENABLED,
    }
    state = State.SWITCH_ON_DISABLED
    for _ in range(3):
        state = effect[state, next_controlword(Goal.ON, state)]
    assert state is State.ENABLED
    assert next_controlword(Goal.ON, state) is Controlword.ENABLE_OPERATION


def test_no_goal_but_on_ever_enables() -> None:
    enabling = Controlword.ENABLE_OPERATION
    for (goal, state), word in NEXT_CONTROLWORD.items():
        if goal is not Goal.ON:
            assert word is not enabling, (goal, state)
            assert word is not Controlword.SHUTDOWN, (goal, state)


def test_a_quick_stop_is_left_only_by_taking_the_voltage_away() -> None:
    assert next_controlword(Goal.ON, State.QUICK_STOP) is Controlword.DISABLE_VOLTAGE


@pytest.mark.parametrize("state", [State.FAULT, State.FAULT_REACTION])
@pytest.mark.parametrize("goal", [Goal.ON, Goal.OFF])
def test_a_fault_is_left_alone(goal: Goal, state: State) -> None:
    assert next_controlword(goal, state) is Controlword.DISABLE_VOLTAGE


@pytest.mark.parametrize("state", [*State, None])
def test_who_stops_never_lets_go_because_of_what_one_statusword_says(state: State | None) -> None:
    """A bit that is wrong would let a moving joint coast; a drive in fault heeds no quick stop."""
    assert next_controlword(Goal.QUICK_STOP, state) is Controlword.QUICK_STOP


def test_an_unknown_state_is_never_told_to_go_on() -> None:
    assert next_controlword(Goal.ON, None) is Controlword.DISABLE_VOLTAGE
    assert next_controlword(Goal.OFF, None) is Controlword.DISABLE_VOLTAGE


def test_torque_flows_in_two_states_only() -> None:
    assert [s for s, d in REDUCED.items() if d is DriveState.ON] == [State.ENABLED]
    assert [s for s, d in REDUCED.items() if d is DriveState.QUICK_STOP] == [State.QUICK_STOP]


def test_supported_modes_are_bits_from_one() -> None:
    assert supports_mode(0b100, Mode.PROFILE_VELOCITY)
    assert not supports_mode(0b011, Mode.PROFILE_VELOCITY)
    assert not supports_mode(0xFFFFFFFF, Mode.NONE)
    assert supported_mode_names(0b101) == "profile position, profile velocity"
    assert supported_mode_names(0) == "none"


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (0x8611, "following error"),
        (0x8130, "heartbeat"),
        (0x2345, "current"),
        (0x4999, "temperature"),
        (0xFF01, "vendor"),
        (0x0000, "no error"),
    ],
)
def test_error_codes_are_explained_with_their_number(code: int, words: str) -> None:
    text = error_words(code)
    assert text.startswith(f"0x{code:04X}")
    assert words in text
