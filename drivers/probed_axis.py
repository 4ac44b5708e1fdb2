"""An axis whose gearbox temperature comes from a device of its own, on the axis's time base.

Each sample carries the newest reading that was taken before it, with its age. A reading that is
older than allowed, or that the device itself does not stand by, is NaN with its reason: the gate
then refuses, and the recording shows when and why.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping

from drivers.ports import (
    Axis,
    AxisEvidence,
    Command,
    Quality,
    Sample,
    StopReport,
    SyncAccount,
    TemperatureProbe,
    TemperatureReading,
)


def aged(reading: TemperatureReading, now_s: float, age_max_s: float) -> TemperatureReading:
    """Return what a reading is worth at `now_s`: itself, or NaN when it is too old.

    Parameters
    ----------
    reading : TemperatureReading
        As the probe gave it.
    now_s : float
        When it is used, on the same clock.
    age_max_s : float
        How old it may be.
    """
    age_s = now_s - reading.taken_s
    if reading.quality is not Quality.GOOD:
        return reading._replace(degc=math.nan)
    if math.isfinite(reading.degc) and age_s <= age_max_s:
        return reading
    why = f": {reading.reason}" if reading.reason else ""
    return reading._replace(
        degc=math.nan,
        quality=Quality.STALE,
        reason=f"its newest reading is {age_s:.1f} s old, the limit is {age_max_s:.1f} s{why}",
    )


class ProbedAxis:
    """The port `Axis`, with the temperature of a `TemperatureProbe` in every sample.

    Parameters
    ----------
    axis : Axis
        Where motion and torque come from.
    probe : TemperatureProbe
        Where the temperature comes from; opened and closed with the axis.
    age_max_s : float
        How old a reading may be.
    """

    def __init__(self, axis: Axis, probe: TemperatureProbe, age_max_s: float) -> None:
        self._axis = axis
        self._probe = probe
        self._age_max_s = age_max_s
        self._readings: deque[TemperatureReading] = deque(maxlen=4)
        self.probe_identity: Mapping[str, str | int | float] = {}

    def open(self) -> AxisEvidence:
        """Reach the probe, then the axis: a probe that does not answer leaves the drive alone."""
        self.probe_identity = self._probe.open()
        self._take()
        return self._axis.open()

    def send(self, command: Command) -> None:
        """As the axis does."""
        self._axis.send(command)

    def receive(self) -> tuple[Sample, ...]:
        """Return the axis's samples with the temperature, its age and its quality.

        Raises
        ------
        drivers.errors.DriverError
            As the axis does; `WorkerDiedError` where nobody reads the probe any more.
        """
        self._take()
        return self._with_temperature(self._axis.receive())

    def stop(self, deadline_s: float) -> StopReport:
        """As the axis does; the probe has no say in it."""
        report = self._axis.stop(deadline_s)
        return StopReport(report.at_rest, self._with_temperature(report.samples), report.reason)

    def close(self) -> SyncAccount:
        """Close both, the probe whatever becomes of the axis."""
        try:
            return self._axis.close()
        finally:
            self._probe.close()

    def _take(self) -> None:
        reading = self._probe.latest()
        if not self._readings or reading.taken_s > self._readings[-1].taken_s:
            self._readings.append(reading)
        else:
            self._readings[-1] = reading  # the same one, perhaps with a reason added since

    def _with_temperature(self, samples: Iterable[Sample]) -> tuple[Sample, ...]:
        return tuple(self._joined(sample) for sample in samples)

    def _joined(self, sample: Sample) -> Sample:
        """Return the sample with the newest reading that is not younger than it."""
        reading = self._readings[0]
        for candidate in reversed(self._readings):
            if candidate.taken_s <= sample.time_s:
                reading = candidate
                break
        worth = aged(reading, sample.time_s, self._age_max_s)
        return sample._replace(
            gearbox_temperature_degc=worth.degc,
            gearbox_temperature_age_s=max(0.0, sample.time_s - worth.taken_s),
            gearbox_temperature_quality=worth.quality,
            gearbox_temperature_reason=worth.reason,
        )
