"""What the port `Axis` promises, held against each of its implementations.

In simulated time; what hangs on a clock that nobody steps, in real time, too. What a CiA 402 drive
promises beside this stands in `test_cia402_axis`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from drivers.clock import SteppedClock
from drivers.errors import DriveStateError
from drivers.ports import Axis, AxisEvidence, Command, DriveState, Goal, Sample, SyncAccount
from tests.contract.axis_bench import (
    PERIOD_S,
    REST_RAD_S,
    SPEED_RAD_S,
    AxisBench,
    kinds,
    kinds_in_real_time,
    open_bench,
)

OFF = Command(Goal.OFF, 0.0)
AT_SPEED = Command(Goal.ON, SPEED_RAD_S)
IN_EITHER_TIME = pytest.mark.parametrize("bench", [*kinds(), *kinds_in_real_time()], indirect=True)
STOPS_AFTER_RAD = 0.05
"""Half of what the quickest of them needs: 20 rad/s are 0.1 rad at 2000 rad/s2."""


@pytest.fixture(params=kinds())
def bench(request: pytest.FixtureRequest) -> Iterator[AxisBench]:
    with open_bench(request.param) as made:
        yield made


@IN_EITHER_TIME
def test_opening_says_who_it_is_and_leaves_it_without_torque(bench: AxisBench) -> None:
    axis: Axis = bench.axis()
    evidence = axis.open()
    assert isinstance(evidence, AxisEvidence)
    assert evidence.identity["name"]
    samples = bench.run(axis, 0.05, OFF)
    assert {sample.state for sample in samples} == {DriveState.OFF}
    assert max(abs(sample.velocity_rad_s) for sample in samples) <= REST_RAD_S
    assert isinstance(axis.close(), SyncAccount)


@IN_EITHER_TIME
def test_a_velocity_is_reached_and_every_tick_is_answered(bench: AxisBench) -> None:
    axis = bench.axis()
    axis.open()
    sent_s: list[float] = []
    samples: list[Sample] = []
    # So long, and not so many ticks: a recording that is played in real time ends by itself.
    end_s = bench.clock.now() + 99.5 * PERIOD_S
    while (now_s := bench.clock.now()) < end_s:
        sent_s.append(now_s)
        bench.send(axis, AT_SPEED)
        bench.clock.sleep_until(now_s + PERIOD_S)
        samples += bench.receive(axis)
    report = axis.stop(bench.clock.now() + 2.0)
    assert report.at_rest, report.reason
    account = axis.close()
    assert account.lost == 0
    least = 100 if isinstance(bench.clock, SteppedClock) else 8  # a busy machine ticks late
    assert account.received == account.expected >= len(sent_s) >= least
    times_s = np.array([sample.time_s for sample in (*samples, *report.samples)])
    assert np.all(np.diff(times_s) > 0.0)  # each once, in order
    assert times_s[0] >= sent_s[0]
    assert all(sample.received_s >= sample.time_s for sample in samples)
    last, before = samples[-1], samples[-1 - len(samples) // 4]
    assert last.state is DriveState.ON
    assert last.velocity_rad_s == pytest.approx(SPEED_RAD_S, abs=0.5)
    moved_rad = last.position_rad - before.position_rad
    assert moved_rad == pytest.approx(SPEED_RAD_S * (last.time_s - before.time_s), rel=0.1)
    assert 0.0 < last.torque_nm < 5.0


@IN_EITHER_TIME
def test_a_stop_is_a_measured_standstill(bench: AxisBench) -> None:
    axis = bench.axis()
    axis.open()
    before = bench.at_speed(axis)[-1]
    report = axis.stop(bench.clock.now() + 2.0)
    assert report.at_rest, report.reason
    assert report.samples[0].time_s > before.time_s
    # The way cannot be missed: a busy machine may look next when the speed has long gone.
    assert report.samples[-1].position_rad - before.position_rad > STOPS_AFTER_RAD
    assert max(abs(sample.velocity_rad_s) for sample in report.samples[-5:]) <= REST_RAD_S
    assert report.samples[-1].state is not DriveState.ON
    axis.close()


@IN_EITHER_TIME
def test_a_stop_that_has_no_time_claims_no_standstill(bench: AxisBench) -> None:
    axis = bench.axis()
    axis.open()
    bench.at_speed(axis)
    report = axis.stop(bench.clock.now())
    assert not report.at_rest
    assert report.reason
    axis.close()


def test_a_goal_that_is_taken_back_is_no_surprise(bench: AxisBench) -> None:
    axis = bench.axis()
    axis.open()
    bench.until(axis, Command(Goal.ON, 0.0), lambda s: s.state is DriveState.ON)
    bench.until(axis, OFF, lambda s: s.state is DriveState.OFF)
    after = bench.run(axis, 0.05, OFF)
    axis.close()
    assert after
    assert all(sample.state is DriveState.OFF for sample in after)


def test_closing_may_be_repeated_and_says_the_same(bench: AxisBench) -> None:
    axis = bench.axis()
    axis.open()
    bench.run(axis, 0.05, OFF)
    account = axis.close()
    assert account.received > 0
    assert axis.close() == account


def test_an_axis_serves_one_session(bench: AxisBench) -> None:
    axis = bench.axis()
    axis.open()
    with pytest.raises(DriveStateError, match="opened before"):
        axis.open()
    axis.close()


def test_an_axis_that_is_closed_does_nothing(bench: AxisBench) -> None:
    axis = bench.axis()
    report = axis.stop(bench.clock.now() + 0.1)
    assert not report.at_rest
    assert axis.close() == SyncAccount()
    for call in (axis.open, axis.receive, lambda: axis.send(OFF)):
        with pytest.raises(DriveStateError):
            call()


def test_a_velocity_that_is_no_number_never_leaves(bench: AxisBench) -> None:
    axis = bench.axis()
    axis.open()
    for velocity_rad_s in (math.nan, math.inf, -math.inf):
        with pytest.raises(ValueError, match="finite"):
            axis.send(Command(Goal.ON, velocity_rad_s))
        axis.send(Command(Goal.OFF, velocity_rad_s))  # ignored unless the goal is ON
    axis.close()


@IN_EITHER_TIME
def test_send_and_receive_do_not_wait(bench: AxisBench) -> None:
    axis = bench.axis()
    axis.open()
    bench.run(axis, 0.05, OFF)
    began_s = bench.clock.now()
    bench.send(axis, AT_SPEED)
    bench.receive(axis)
    waited_s = bench.clock.now() - began_s
    assert waited_s == 0.0 if isinstance(bench.clock, SteppedClock) else waited_s < 0.5
    axis.stop(bench.clock.now() + 2.0)
    axis.close()
