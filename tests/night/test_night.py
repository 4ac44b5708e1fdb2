"""A simulated month, with faults: one attempt a night, in its window, and nothing caught up."""

from __future__ import annotations

import datetime
import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.night.attempt import Outcome
from tests.night.simulated import SimulatedWall, Watch, described, utc

REFUSED = Outcome("skip", "Refused, nothing has moved: the permit is missing; waited 10.0 s.")
STOPPED = Outcome("stopped", "Stopped during 'stair': torque above its limit.", "cd" * 32)


def test_a_month_of_nights_over_the_year_s_end() -> None:
    watch = Watch.over(described({}, {"number": 2, "window": "23:00-01:00"}), "2026-12-15T12:00")
    watch.cell.faults = {
        (1, "2026-12-20"): REFUSED,
        (1, "2026-12-31"): STOPPED,
        (2, "2027-01-05"): Outcome("alarm", "Friction has grown by 30 %."),
    }
    watch.cell.blocked_on = {"1:2027-01-02": "the recordings take too much room"}
    watch.run("2027-01-15T12:00")
    assert len(watch.kinds(1)) == len(watch.kinds(2)) == 31
    assert watch.kinds(1).count("run") == 28
    assert watch.kinds(2).count("run") == 30
    assert watch.texts("skip") == [
        REFUSED.sentence,
        "Skipped, nothing has moved: the recordings take too much room.",
    ]
    assert watch.texts("stopped") == [STOPPED.sentence]
    (alarm,) = [e for e in watch.events if e.kind == "alarm"]
    assert alarm.details["night"] == "2027-01-05"
    # once in each window, whatever became of it; never outside (the simulated cell insists)
    keys = [a[:2] for a in watch.cell.attempts]
    assert len(keys) == len(set(keys)) == 61
    assert watch.events[0].text == "The nights of this cell are watched from now on."


@pytest.mark.parametrize(
    ("start", "end"),
    [("2026-03-27T12:00", "2026-03-31T12:00"), ("2026-10-23T12:00", "2026-10-27T12:00")],
)
def test_each_night_has_one_run_when_the_clock_is_changed(start: str, end: str) -> None:
    watch = Watch.over(described({"window": "01:45-03:30"}), start).run(end)
    assert watch.kinds() == ["run"] * 4
    local = [began.astimezone(watch.description.zone) for _, _, began in watch.cell.attempts]
    assert all("01:45" <= f"{t:%H:%M}" < "03:30" for t in local)


def test_a_window_that_the_clock_swallows_is_said_to_be_missed() -> None:
    watch = Watch.over(described({"window": "02:05-02:55"}), "2026-03-27T12:00")
    watch.run("2026-03-30T12:00")
    assert watch.kinds() == ["run", "missed", "run"]
    assert "the change of the clock left nothing of it" in watch.texts("missed")[0]


def test_what_the_computer_slept_through_is_said_once_and_not_caught_up() -> None:
    watch = Watch.over(described(), "2026-06-01T12:00").run("2026-06-03T12:00")
    watch.wall.at = utc("2026-06-09T21:00")  # off for days; started inside the next window
    watch.run("2026-06-10T12:00")
    assert watch.kinds() == ["run", "run", "missed", "run"]
    assert "6 nights (2026-06-03 to 2026-06-08)" in watch.texts("missed")[0]
    watch.wall.at = utc("2026-06-11T02:58")  # started anew too late for tonight's
    watch.run("2026-06-11T12:00")
    assert watch.kinds()[4:] == ["skip"]
    assert "2 min are left of the window, a cycle needs 7 min" in watch.texts("skip")[0]


def test_a_restart_in_the_window_does_not_try_again() -> None:
    watch = Watch.over(described(), "2026-06-01T19:00").run("2026-06-01T21:00")
    assert watch.kinds() == ["run"]
    watch.run("2026-06-02T12:00")
    assert watch.kinds() == ["run"]


def test_an_attempt_that_took_the_program_with_it_is_not_repeated() -> None:
    watch = Watch.over(described(), "2026-06-01T19:00")
    watch.cell.faults = {(1, "2026-06-01"): KeyboardInterrupt("power cut")}
    with pytest.raises(KeyboardInterrupt):
        watch.run("2026-06-02T12:00")
    watch.run("2026-06-03T12:00")
    assert watch.kinds() == ["stopped", "run"]
    assert "it is not tried again" in watch.texts("stopped")[0]
    assert len(watch.cell.attempts) == 2


def test_a_clock_that_is_set_back_brings_no_second_attempt() -> None:
    watch = Watch.over(described(), "2026-06-01T19:00")
    watch.wall.jumps = [(utc("2026-06-02T12:00"), utc("2026-06-01T19:30"))]
    watch.run("2026-06-02T10:00").run("2026-06-03T12:00")
    assert watch.kinds() == ["run", "run"]
    assert [night for _, night, _ in watch.cell.attempts] == ["2026-06-01", "2026-06-02"]


def test_a_clock_that_is_set_forth_misses_the_window() -> None:
    watch = Watch.over(described(), "2026-06-01T12:00")
    watch.wall.jumps = [(utc("2026-06-01T15:00"), utc("2026-06-02T06:00"))]
    watch.run("2026-06-03T12:00")
    assert watch.kinds() == ["missed", "run"]


def test_a_cycle_that_takes_the_whole_window_leaves_the_next_axis_skipped() -> None:
    watch = Watch.over(described({}, {"number": 2}), "2026-06-01T12:00")
    watch.cell.takes = datetime.timedelta(hours=6, minutes=55)
    watch.run("2026-06-02T12:00")
    assert watch.kinds(1) == ["run"]
    assert watch.kinds(2) == ["skip"]


def test_once_does_tonight_s_windows_and_ends() -> None:
    watch = Watch.over(described({}, {"number": 2, "window": "22:30-23:30"}), "2026-06-01T20:35")
    watch.night().tonight(lambda: False)
    assert (watch.kinds(1), watch.kinds(2)) == (["run"], ["run"])
    assert watch.wall.now() < utc("2026-06-01T20:50")
    watch.wall.at = utc("2026-06-02T09:00")
    watch.night().tonight(lambda: False)  # in the day there is nothing to do
    assert watch.kinds(1) == ["run"]


def cooling(at: datetime.datetime) -> float:
    """From 52 degC at 20:00 UTC towards 22 degC with a time constant of two hours."""
    hours = (at - utc("2026-06-01T20:00")).total_seconds() / 3600.0
    return round(22.0 + 30.0 * math.exp(-hours / 2.0), 1)


def test_it_waits_for_a_comparable_gearbox_inside_its_window() -> None:
    axis = {"temperature_degc": 32.0, "temperature_tolerance_k": 1.0}
    watch = Watch.over(described(axis), "2026-06-01T19:59")
    watch.cell.gearbox = cooling
    watch.run("2026-06-02T12:00")
    assert watch.kinds() == ["run"]
    ((_, _, began),) = watch.cell.attempts
    due_h = -2.0 * math.log(11.0 / 30.0)  # at 33 degC
    late_h = (began - utc("2026-06-01T20:00")).total_seconds() / 3600.0 - due_h
    assert -0.01 < late_h < 0.1  # the sensor shows tenths
    assert len(watch.texts("wait")) == 2
    assert "52.0 degC, comparable at 32 ± 1" in watch.texts("wait")[0]
    assert re.search(r"expected at 2[12]:\d\d UTC", watch.texts("wait")[1])
    assert abs(watch.events[-1].details["difference_at_start_k"]) <= 1.0


def test_what_does_not_get_comparable_runs_at_the_last_moment_with_its_difference() -> None:
    watch = Watch.over(
        described({"temperature_degc": 15.0, "window": "22:00-00:30"}), "2026-06-01T19:59"
    )
    watch.cell.gearbox = cooling
    watch.run("2026-06-02T12:00")
    ((_, _, began),) = watch.cell.attempts
    left = utc("2026-06-01T22:30") - began
    assert datetime.timedelta(minutes=7) <= left <= datetime.timedelta(minutes=10)
    assert watch.events[-1].details["difference_at_start_k"] == pytest.approx(16.3, abs=0.4)
    assert "leaves no more time to wait" in watch.events[-1].details["temperature"]


def test_what_is_colder_than_comparable_does_not_wait() -> None:
    watch = Watch.over(described({"temperature_degc": 60.0}), "2026-06-01T19:59")
    watch.cell.gearbox = cooling
    watch.run("2026-06-02T12:00")
    ((_, _, began),) = watch.cell.attempts
    assert began < utc("2026-06-01T20:01")
    assert watch.events[-1].details["difference_at_start_k"] == pytest.approx(-8.0, abs=0.2)


def test_a_temperature_that_nobody_can_read_is_left_to_the_recording() -> None:
    watch = Watch.over(described({"temperature_degc": 30.0}), "2026-06-01T19:59")
    watch.run("2026-06-02T12:00")
    assert watch.kinds() == ["run"]
    assert "not known before the run" in watch.events[-1].details["temperature"]


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    restarts=st.lists(st.floats(0.0, 10.0), max_size=5),
    jumps=st.lists(st.tuples(st.floats(0.0, 10.0), st.floats(-6.0, 30.0)), max_size=3),
    window=st.sampled_from(["22:00-05:00", "02:15-02:45", "23:50-00:10", "12:00-13:00"]),
)
def test_whatever_happens_every_night_ends_in_one_way_and_runs_at_most_once(
    seed: int,
    restarts: list[float],
    jumps: list[tuple[float, float]],
    window: str,
) -> None:
    start = utc("2026-10-20T12:00")
    watch = Watch.over(described({"window": window}), "2026-10-20T12:00")
    for at_d, by_h in sorted(jumps):
        at = start + datetime.timedelta(days=at_d)
        watch.wall.jumps.append((at, at + datetime.timedelta(hours=by_h)))
    if seed % 3 == 0:
        watch.cell.faults = {(1, f"2026-10-2{seed % 9}"): REFUSED}
    for at_d in sorted(restarts):
        watch.night().run(lambda: False, start + datetime.timedelta(days=at_d))
    watch.run("2026-11-02T09:00")
    ended: list[str] = []
    for event in watch.events:
        if event.kind in ("run", "skip", "stopped", "missed"):
            ended += event.details.get("nights") or [event.details["night"]]
    assert len(ended) == len(set(ended))
    keys = [a[:2] for a in watch.cell.attempts]
    assert len(keys) == len(set(keys))
    begun = [e for e in watch.events if e.kind == "begun"]
    assert len(begun) == len(keys)


def test_the_night_comes_to_rest_between_windows() -> None:
    watch = Watch.over(described(), "2026-06-01T12:00")
    watch.run("2026-07-01T12:00")
    assert isinstance(watch.wall, SimulatedWall)
    assert watch.wall.waits < 100
