"""A controller's samples on the agent's clock: each once, in order, never from the future."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DriveStateError
from drivers.modbus.device import Value
from drivers.modbus.job_samples import ControllerSamples
from drivers.modbus.register_map import RawValue
from drivers.ports import DriveState, Quality

PERIOD_S = 0.02


def block(number: int, taken_s: float, *, degc: float = 25.0, state: int = 2) -> dict[str, Value]:
    """Return what a controller's registers say, with the clock in its own milliseconds."""
    numbers = {
        "sample_number": float(number & 0xFFFF),
        "sample_time": round(1e3 * taken_s) / 1e3,
        "position": 1.0,
        "velocity": 2.0,
        "torque": 3.0,
        "gearbox_temperature": degc,
        "job_state": float(state),
    }
    return {
        name: Value(
            value,
            Quality.GOOD if math.isfinite(value) else Quality.ABSENT,
            "" if math.isfinite(value) else "no sensor",
            RawValue((), value),
        )
        for name, value in numbers.items()
    }


@given(
    st.floats(-2e-4, 2e-4),
    st.floats(0.0, 1e4),
    st.lists(st.floats(0.004, 0.1), min_size=5, max_size=60),
)
def test_samples_are_in_order_and_never_from_the_future(
    drift: float, origin_s: float, looks_s: list[float]
) -> None:
    """Whatever the controller's clock says, and however fast or slowly it runs."""
    samples = ControllerSamples()
    now_s, last_s, taken = 100.0, -math.inf, 0
    for gap_s in looks_s:
        now_s += gap_s
        theirs_s = origin_s + (now_s - 100.0) * (1.0 + drift)
        number = math.floor(theirs_s / PERIOD_S)
        sample = samples.take(block(number, number * PERIOD_S), now_s)
        if sample is None:
            continue
        taken += 1
        assert sample.time_s <= now_s + 1e-9
        assert sample.time_s > last_s
        last_s = sample.time_s
    account = samples.account
    assert account.received == taken
    assert account.expected == account.received + account.lost


@pytest.mark.parametrize("jump_s", [-0.001, 5.0, -1e5, math.nan])
def test_what_comes_with_an_impossible_clock_is_no_sample(jump_s: float) -> None:
    samples = ControllerSamples()
    assert samples.take(block(1, 10.0), 100.0) is not None
    broken = block(2, 10.02)
    clock = broken["sample_time"]
    broken["sample_time"] = clock._replace(value=10.0 + jump_s)
    with pytest.raises(DriveStateError, match="clock went by"):
        samples.take(broken, 100.02)
    after = samples.take(block(3, 10.04), 100.04)
    assert after is not None
    assert after.time_s == pytest.approx(100.04)
    assert (samples.account.received, samples.account.lost) == (2, 1)


def test_a_number_that_was_skipped_is_lost_also_where_it_wraps() -> None:
    samples = ControllerSamples()
    for periods, number in ((0, 65534), (1, 65535), (1, 65535), (3, 1), (4, 2)):
        samples.take(block(number, periods * PERIOD_S), 1e4)
    assert (samples.account.received, samples.account.lost) == (4, 1)


def test_a_missing_sensor_is_no_number_and_a_running_job_is_on() -> None:
    samples = ControllerSamples()
    running = samples.take(block(1, 0.02, degc=math.nan), 1.0)
    assert running is not None
    assert math.isnan(running.gearbox_temperature_degc)
    assert running.gearbox_temperature_reason == "no sensor"
    assert running.state is DriveState.ON
    done = samples.take(block(2, 0.04, state=3), 1.1)
    assert done is not None
    assert done.state is DriveState.OFF
    assert done.time_s - running.time_s == pytest.approx(0.02)
