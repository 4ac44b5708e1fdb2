"""The CiA 402 state machine of the fake, transition by transition."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes.state_machine import Motion, State, StateMachine

OPTIONS = {0x605A: 2, 0x605B: 0, 0x605C: 1, 0x605D: 1, 0x605E: 2}
ENABLE = (0x06, 0x07, 0x0F)


def machine(*commands: int, resets: bool = True, **options: int) -> StateMachine:
    values = OPTIONS | {int(k[1:], 16): v for k, v in options.items()}
    made = StateMachine(values.__getitem__, lambda: resets, lambda: None)
    for command in commands:
        made.command(command)
    return made


@pytest.mark.parametrize(
    ("commands", "state"),
    [
        ((), State.SWITCH_ON_DISABLED),
        ((0x06,), State.READY_TO_SWITCH_ON),
        ((0x06, 0x07), State.SWITCHED_ON),
        ((0x06, 0x07, 0x0F), State.OPERATION_ENABLED),
        ((0x06, 0x0F), State.OPERATION_ENABLED),
        ((0x0F,), State.SWITCH_ON_DISABLED),
        ((0x07,), State.SWITCH_ON_DISABLED),
        ((0x06, 0x00), State.SWITCH_ON_DISABLED),
        ((0x06, 0x02), State.SWITCH_ON_DISABLED),
        ((0x06, 0x07, 0x06), State.READY_TO_SWITCH_ON),
        ((0x06, 0x07, 0x00), State.SWITCH_ON_DISABLED),
        ((0x06, 0x07, 0x02), State.SWITCH_ON_DISABLED),
        ((*ENABLE, 0x00), State.SWITCH_ON_DISABLED),
        ((*ENABLE, 0x06), State.READY_TO_SWITCH_ON),
        ((*ENABLE, 0x02), State.QUICK_STOP_ACTIVE),
        ((*ENABLE, 0x02, 0x00), State.SWITCH_ON_DISABLED),
        ((0x80,), State.SWITCH_ON_DISABLED),
        ((*ENABLE, 0x80), State.OPERATION_ENABLED),
    ],
)
def test_transitions(commands: tuple[int, ...], state: State) -> None:
    assert machine(*commands).state is state


@pytest.mark.parametrize(
    ("state", "mask", "value"),
    [
        (State.SWITCH_ON_DISABLED, 0x4F, 0x40),
        (State.READY_TO_SWITCH_ON, 0x6F, 0x21),
        (State.SWITCHED_ON, 0x6F, 0x23),
        (State.OPERATION_ENABLED, 0x6F, 0x27),
        (State.QUICK_STOP_ACTIVE, 0x6F, 0x07),
        (State.FAULT_REACTION_ACTIVE, 0x4F, 0x0F),
        (State.FAULT, 0x4F, 0x08),
    ],
)
def test_statusword_bits_are_the_standards(state: State, mask: int, value: int) -> None:
    assert state & mask == value


@pytest.mark.parametrize(
    ("option", "motion", "after"),
    [
        (1, Motion.PROFILE_RAMP, State.SWITCH_ON_DISABLED),
        (2, Motion.QUICK_RAMP, State.SWITCH_ON_DISABLED),
        (3, Motion.CURRENT_LIMIT, State.SWITCH_ON_DISABLED),
        (5, Motion.PROFILE_RAMP, State.QUICK_STOP_ACTIVE),
        (6, Motion.QUICK_RAMP, State.QUICK_STOP_ACTIVE),
        (7, Motion.CURRENT_LIMIT, State.QUICK_STOP_ACTIVE),
    ],
)
def test_quick_stop_options(option: int, motion: Motion, after: State) -> None:
    m = machine(*ENABLE, 0x02, x605A=option)
    assert (m.state, m.motion) == (State.QUICK_STOP_ACTIVE, motion)
    m.at_rest()
    assert m.state is after


def test_quick_stop_option_zero_takes_the_torque_away() -> None:
    m = machine(*ENABLE, 0x02, x605A=0)
    assert (m.state, m.motion) == (State.SWITCH_ON_DISABLED, Motion.NO_TORQUE)


def test_a_stream_of_old_commands_does_not_undo_an_internal_quick_stop() -> None:
    m = machine(*ENABLE, x605A=6)
    m.quick_stop()
    m.command(0x0F)
    m.at_rest()
    m.command(0x0F)
    assert m.motion is Motion.QUICK_RAMP
    m.command(0x02)
    m.command(0x0F)
    assert m.state is State.OPERATION_ENABLED


def test_a_quick_stop_that_ends_in_switch_on_disabled_cannot_be_cut_short() -> None:
    m = machine(*ENABLE, 0x02)
    m.command(0x0F)
    assert m.state is State.QUICK_STOP_ACTIVE


def test_halt_brakes_and_stays_enabled() -> None:
    m = machine(*ENABLE, 0x010F)
    assert (m.state, m.motion) == (State.OPERATION_ENABLED, Motion.PROFILE_RAMP)
    assert machine(*ENABLE, 0x010F, x605D=2).motion is Motion.QUICK_RAMP
    m.command(0x0F)
    assert m.motion is Motion.FOLLOW


def test_disable_operation_ramps_down_first() -> None:
    m = machine(*ENABLE, 0x07)
    assert (m.state, m.motion) == (State.OPERATION_ENABLED, Motion.PROFILE_RAMP)
    m.at_rest()
    assert m.state is State.SWITCHED_ON
    again = machine(*ENABLE, 0x07, 0x0F)
    assert again.motion is Motion.FOLLOW


@pytest.mark.parametrize(
    ("option", "motion"),
    [(1, Motion.PROFILE_RAMP), (2, Motion.QUICK_RAMP), (3, Motion.CURRENT_LIMIT)],
)
def test_fault_reaction_brakes_and_ends_in_fault(option: int, motion: Motion) -> None:
    m = machine(*ENABLE, x605E=option)
    m.fault()
    assert (m.state, m.motion) == (State.FAULT_REACTION_ACTIVE, motion)
    m.command(0x80)
    assert m.state is State.FAULT_REACTION_ACTIVE
    m.at_rest()
    assert (m.state, m.motion) == (State.FAULT, Motion.NO_TORQUE)


def test_fault_without_torque_or_with_option_zero_is_immediate() -> None:
    standing, moving = machine(0x06), machine(*ENABLE, x605E=0)
    for m in (standing, moving):
        m.fault()
        assert m.state is State.FAULT


def test_only_a_rising_edge_resets_a_fault() -> None:
    m = machine(0x06, 0x80)
    m.fault()
    for command in (0x80, 0x80, 0x8F, 0x06, 0x0F, 0x00):
        m.command(command)
        assert m.state is State.FAULT
    m.command(0x80)
    assert m.state is State.SWITCH_ON_DISABLED


def test_a_fault_whose_cause_remains_is_not_reset() -> None:
    m = machine(resets=False)
    m.fault()
    m.command(0x80)
    assert m.state is State.FAULT


@given(words=st.lists(st.integers(0, 0xFFFF) | st.sampled_from([6, 7, 15, 0x80]), max_size=40))
def test_a_fault_is_latched_against_every_word_without_the_reset_bit(words: list[int]) -> None:
    m = machine(*words)
    m.fault()
    m.at_rest()
    for word in words:
        m.command(word & ~0x80)
        assert (m.state, m.motion) == (State.FAULT, Motion.NO_TORQUE)


@given(words=st.lists(st.integers(0, 0xFFFF), max_size=40))
def test_torque_without_enable_voltage_never_lasts(words: list[int]) -> None:
    m = machine(*words)
    m.command(0x00)
    assert m.motion is Motion.NO_TORQUE
