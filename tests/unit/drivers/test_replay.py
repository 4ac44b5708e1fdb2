"""What the axis over a recording promises, whatever the ticks: every sample once, as it was."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.clock import SteppedClock
from drivers.ports import Command, DriveState, Goal, Quality, Sample
from drivers.recorded import Recorded
from drivers.replay import ReplayAxis

STEPS_S = st.lists(st.floats(1e-4, 0.2), min_size=1, max_size=40)


def recorded(time_s: list[float], **changes: object) -> Recorded:
    """Return a recording whose columns tell its rows apart."""
    row = np.arange(len(time_s), dtype=np.float64)
    columns = {
        "time_s": np.array(time_s),
        "position_rad": row,
        "velocity_rad_s": row + 0.25,
        "torque_nm": row + 0.5,
        "velocity_command_rad_s": row + 0.25,
    }
    return Recorded(**{**columns, **changes})  # type: ignore[arg-type]  # names checked by the class


def played(source: Recorded, ticks_s: list[float], command: Command) -> list[Sample]:
    """Return what comes of ticking so, then on until the recording has ended."""
    clock = SteppedClock(start_s=1000.0)
    axis = ReplayAxis(source, clock)
    axis.open()
    samples: list[Sample] = []
    length_s = float(source.time_s[-1] - source.time_s[0])
    left = [length_s / 8.0] * 12
    for step_s in (*ticks_s, *left):
        axis.send(command)
        samples += axis.receive()
        assert all(sample.time_s <= clock.now() for sample in samples)
        if len(samples) >= len(source.time_s):
            break
        clock.sleep_until(clock.now() + step_s)
    return samples


@settings(deadline=None)  # a busy machine is not what is tested
@given(gaps_s=STEPS_S, ticks_s=STEPS_S, start_s=st.floats(-1e3, 1e3))
def test_every_sample_comes_once_in_order_unaltered_and_never_from_the_future(
    gaps_s: list[float], ticks_s: list[float], start_s: float
) -> None:
    time_s = list(start_s + np.cumsum([0.0, *gaps_s]))
    source = recorded(time_s, begins_with_enabling=True)
    samples = played(source, ticks_s, Command(Goal.ON, 0.0))[: len(time_s)]
    assert [sample.position_rad for sample in samples] == list(source.position_rad)
    assert [sample.torque_nm for sample in samples] == list(source.torque_nm)
    elapsed_s = np.array([sample.time_s for sample in samples]) - samples[0].time_s
    assert elapsed_s == pytest.approx(np.array(time_s) - time_s[0], abs=2e-6)


def test_without_a_recorded_enabling_it_stands_until_motion_is_asked_for() -> None:
    clock = SteppedClock()
    axis = ReplayAxis(recorded([5.0, 5.1, 5.2, 5.3]), clock)
    axis.open()
    for goal, velocity, rows in [(Goal.OFF, 0.0, [0]), (Goal.ON, 0.0, [0]), (Goal.ON, 0.25, [0])]:
        axis.send(Command(goal, velocity))
        samples = axis.receive()
        assert [sample.position_rad for sample in samples] == rows
        assert samples[0].state is (DriveState.ON if goal is Goal.ON else DriveState.OFF)
        clock.sleep_until(clock.now() + 0.1)
    axis.send(Command(Goal.ON, 1.25))
    assert [sample.position_rad for sample in axis.receive()] == [1.0]
    account = axis.close()
    assert (axis.held, account.received) == (2, 4)


@settings(deadline=None)  # a busy machine is not what is tested
@given(
    off_rad_s=st.floats(-50.0, 50.0),
    at=st.integers(20, 40),
)
def test_a_set_point_differs_by_its_distance_from_those_recorded_about_its_time(
    off_rad_s: float, at: int
) -> None:
    clock, period_s = SteppedClock(), 0.1
    commands = np.full(50, 10.0)
    source = recorded(list(period_s * np.arange(50)), velocity_command_rad_s=commands)
    axis = ReplayAxis(source, clock)
    axis.open()
    for tick in range(50):
        axis.send(Command(Goal.ON, 10.0 + off_rad_s * (tick == at)))
        clock.sleep_until(clock.now() + period_s)
    different = abs(off_rad_s) > 1e-6
    comparison = axis.comparison
    assert (comparison.compared, comparison.different) == (50, int(different))
    assert comparison.largest_rad_s == pytest.approx(abs(off_rad_s))
    if different:
        assert comparison.first_s == pytest.approx(at * period_s)


@given(shift=st.floats(0.0, 1.0), swing_s=st.floats(0.5, 5.0))
def test_the_same_curve_ticked_at_other_times_is_the_same(shift: float, swing_s: float) -> None:
    period_s, clock = 0.004, SteppedClock()
    time_s = period_s * np.arange(250)

    def curve_rad_s(at_s: float) -> float:
        return 30.0 + 20.0 * math.sin(math.tau * at_s / swing_s)

    commands = np.array([curve_rad_s(at_s) for at_s in time_s])
    axis = ReplayAxis(recorded(list(time_s), velocity_command_rad_s=commands), clock)
    axis.open()
    axis.send(Command(Goal.ON, commands[0]))
    clock.sleep_until(shift * period_s)
    while clock.now() < time_s[-1]:
        axis.send(Command(Goal.ON, curve_rad_s(clock.now())))
        clock.sleep_until(clock.now() + 9.0 * period_s)
    assert axis.comparison.different == 0


def test_what_is_missing_in_the_recording_is_booked() -> None:
    time_s = [0.0, 0.1, 0.2, 0.3, 0.6, 0.7, 0.8, 1.1]  # four rows are missing
    clock = SteppedClock()
    axis = ReplayAxis(recorded(time_s, begins_with_enabling=True, samples_lost=3), clock)
    axis.open()
    for _ in range(12):
        axis.send(Command(Goal.ON, 0.0))
        clock.sleep_until(clock.now() + 0.1)
    axis.receive()
    account = axis.close()
    assert (account.received, account.lost, account.not_asked) == (8, 3, 1)
    assert account.expected == 11
    assert account.longest_gap_s == pytest.approx(0.3)


def test_a_temperature_keeps_its_age_and_its_quality() -> None:
    source = recorded(
        [0.0, 0.1],
        gearbox_temperature_degc=np.array([30.0, np.nan]),
        gearbox_temperature_age_s=np.array([0.4, 0.5]),
        gearbox_temperature_quality=(Quality.GOOD, Quality.STALE),
    )
    first, last = (source.sample(row, 7.0, DriveState.ON) for row in (0, 1))
    assert (first.gearbox_temperature_degc, first.gearbox_temperature_age_s) == (30.0, 0.4)
    assert first.gearbox_temperature_reason == ""
    assert math.isnan(last.gearbox_temperature_degc)
    assert last.gearbox_temperature_reason == "recorded as 'stale'"


@pytest.mark.parametrize(
    ("time_s", "changes", "words"),
    [
        ([0.0], {}, "at least two"),
        ([0.0, 0.0], {}, "increase strictly"),
        ([0.0, 1.0], {"torque_nm": np.zeros(3)}, "torque_nm has 3 samples, time_s has 2"),
    ],
)
def test_columns_that_are_no_recording_are_refused(
    time_s: list[float], changes: dict[str, object], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        recorded(time_s, **changes)
