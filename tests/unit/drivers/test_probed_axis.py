"""A temperature from beside the drive: on one time base, and a number only when it counts."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.ports import (
    AxisEvidence,
    Command,
    DriveState,
    Quality,
    Sample,
    StopReport,
    SyncAccount,
    TemperatureReading,
)
from drivers.probed_axis import ProbedAxis, aged

AGE_MAX_S = 2.0
READINGS = st.builds(
    TemperatureReading,
    st.floats(allow_nan=True, allow_infinity=True),
    st.floats(-100.0, 100.0),
    st.sampled_from(Quality),
    st.text(max_size=5),
)


@given(READINGS, st.floats(0.0, 10.0))
def test_only_what_is_good_finite_and_fresh_is_a_number(
    reading: TemperatureReading, age_s: float
) -> None:
    found = aged(reading, reading.taken_s + age_s, AGE_MAX_S)
    counts = reading.quality is Quality.GOOD and math.isfinite(reading.degc)
    if counts and age_s < AGE_MAX_S - 1e-9:
        assert found == reading
    elif not counts or age_s > AGE_MAX_S + 1e-9:
        assert math.isnan(found.degc)
        assert found.quality is not Quality.GOOD
        assert found.quality in (reading.quality, Quality.STALE)
    assert found.taken_s == reading.taken_s


class Told:
    """An axis and a probe that say what they are told; no device is behind them."""

    def __init__(self) -> None:
        self.samples: tuple[Sample, ...] = ()
        self.reading = TemperatureReading(20.0, 0.0, Quality.GOOD)
        self.closed = 0

    def open(self) -> AxisEvidence:
        return AxisEvidence({})

    def send(self, command: Command) -> None:
        raise NotImplementedError

    def receive(self) -> tuple[Sample, ...]:
        return self.samples

    def stop(self, deadline_s: float) -> StopReport:
        return StopReport(deadline_s > 0.0, self.samples, "")

    def close(self) -> SyncAccount:
        raise ValueError("the axis cannot be closed")


class ToldProbe:
    def __init__(self, told: Told) -> None:
        self.told = told

    def open(self) -> Mapping[str, str | int | float]:
        return {"kind": "told"}

    def latest(self) -> TemperatureReading:
        return self.told.reading

    def close(self) -> None:
        self.told.closed += 1


def sample(time_s: float) -> Sample:
    return Sample(time_s, time_s, 0.0, 0.0, 0.0, math.nan, DriveState.ON, False)


def test_each_sample_has_the_reading_that_was_taken_before_it() -> None:
    told = Told()
    axis = ProbedAxis(told, ToldProbe(told), AGE_MAX_S)
    axis.open()
    assert axis.probe_identity == {"kind": "told"}
    told.samples = (sample(0.5),)
    axis.receive()
    told.reading = TemperatureReading(21.0, 1.0, Quality.GOOD)
    told.samples = (sample(0.9), sample(1.1), sample(2.9), sample(3.1))
    found = axis.receive()
    degc = [s.gearbox_temperature_degc for s in found]
    assert degc[:3] == [20.0, 21.0, 21.0]
    assert math.isnan(degc[3])
    assert [round(s.gearbox_temperature_age_s, 6) for s in found] == [0.9, 0.1, 1.9, 2.1]
    assert found[3].gearbox_temperature_quality is Quality.STALE
    assert "2.1 s old" in found[3].gearbox_temperature_reason
    assert axis.stop(1.0).samples == found


def test_the_probe_is_closed_even_where_the_axis_cannot_be() -> None:
    told = Told()
    axis = ProbedAxis(told, ToldProbe(told), AGE_MAX_S)
    with pytest.raises(ValueError, match="cannot be closed"):
        axis.close()
    assert told.closed == 1
