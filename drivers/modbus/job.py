"""A robot controller that runs the stair itself, as the port `JobController`.

The agent selects the axis, hands over the parameters and reads them back, starts, and from then on
writes a count at every control tick and reads one block of registers. Both sides watch the other's
count: a controller that stands still is a stop, and so is an agent that does (the controller's own
watchdog, whose time is written and read back before the start).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from drivers.clock import Clock
from drivers.errors import (
    ConfigurationError,
    DriveFaultError,
    DriverError,
    DriveStateError,
)
from drivers.modbus.device import MappedDevice, Value
from drivers.modbus.job_life import ControllerLife
from drivers.modbus.job_samples import ControllerSamples
from drivers.modbus.job_words import (
    ABORT,
    LET_GO,
    PHASES,
    SELECT,
    START,
    STATUS,
    refuse_stopped,
    refuse_unready,
    state_of,
    why,
)
from drivers.ports import (
    AxisEvidence,
    JobState,
    JobStatus,
    Sample,
    StopReport,
    SyncAccount,
)

REST_RAD_S = 0.5
_RESOLVED_RAD = 0.02
RETRY_S = 0.1
"""After a request that failed while stopping or letting go."""


@dataclass(frozen=True)
class JobConfig:
    """What the controller shall do, and how closely it is watched.

    Parameters
    ----------
    axis : int
        As the controller counts.
    parameters : mapping
        Registers of the map by name, in their units: the stair and the approach.
    alive_timeout_s : float
        How long either side may stand still before the other stops.
    timeout_s : float
        Of one request.
    answer_timeout_s : float
        How long the controller may take to select an axis, or to let it go.
    rest_s : float
        How long the joint must stand to be believed at rest.
    """

    axis: int
    parameters: Mapping[str, float]
    alive_timeout_s: float
    timeout_s: float = 0.2
    answer_timeout_s: float = 2.0
    rest_s: float = 0.2


class ModbusJob:
    """A controller behind the map ``robot-job``; one object serves one job.

    Parameters
    ----------
    device : MappedDevice
        The controller; it belongs to the job from now on.
    config : JobConfig
        What to do.
    clock : Clock
        The agent's time base, on which samples are put.
    """

    def __init__(self, device: MappedDevice, config: JobConfig, clock: Clock) -> None:
        self._device = device
        self._config = config
        self._clock = clock
        self._count = 0
        self._opened = False
        self._closed = False
        self._life = ControllerLife(config.alive_timeout_s)
        self._samples = ControllerSamples()

    def open(self) -> AxisEvidence:
        """Check mode and stops, select the axis, write the parameters and read them back.

        Raises
        ------
        DriveStateError
            Not in automatic mode, stopped, or another job is running.
        DriveFaultError
            The controller's job program is in fault.
        ConfigurationError
            Something does not read back as written, or the axis is not selected.
        DriverError
            Nobody answers.
        """
        first = self._read()
        refuse_unready(first)
        self._opened = True
        config = self._config
        wanted = {**config.parameters, "alive_timeout": config.alive_timeout_s}
        self._write({"command": LET_GO, "axis": config.axis, **wanted})
        self._compare(wanted)
        self._set_clock()
        self._write({"command": SELECT})
        self._await_selection()
        return AxisEvidence(
            identity={"name": self._device.map.device, "where": self._device.connection.where},
            settings={
                "axis": config.axis,
                "operating_mode": first["operating_mode"].whole,
                "alive_timeout_ms": round(1e3 * config.alive_timeout_s),
                "sample_period_ms": int(first["sample_period"].raw.number),
            },
        )

    def start(self) -> None:
        """Let the controller begin."""
        self._write({"command": START})

    def exchange(self) -> JobStatus:
        """Say that we are alive and return what the controller says; one round trip each.

        A request that fails is forgiven until the controller has been silent for the alive
        time-out; the status then says why it failed, and has neither a state nor a sample.

        Raises
        ------
        HeartbeatLostError
            Silence, or a count that stands still, for longer than the alive time-out.
        DriveStateError
            No automatic mode any more, or a stop.
        DriveFaultError
            The job program is in fault.
        """
        try:
            self._beat()
            status = self._take(self._read())
        except DriverError as error:
            if isinstance(error, DriveStateError | DriveFaultError):
                raise
            self._life.trouble = error.what
            status = None
        self._life.refuse_silence(self._clock.now())
        return status or JobStatus(None, None, 0.0, "", self._life.trouble)

    def stop(self, deadline_s: float) -> StopReport:
        """Abort, again and again, and wait for a measured standstill. Never raises."""
        samples: list[Sample] = []
        troubles: dict[str, None] = {}
        still_since: Sample | None = None
        while self._clock.now() < deadline_s:
            try:
                self._write({"command": ABORT})
                self._beat()
                sample = self._samples.take(self._read(), self._clock.now())
            except DriverError as error:
                troubles[error.what.rstrip(".")] = None
                sample = None
                self._clock.sleep_until(min(deadline_s, self._clock.now() + RETRY_S))
            if sample is not None:
                samples.append(sample)
                if still_since is not None and not _stands(still_since, sample):
                    still_since = None
                if not abs(sample.velocity_rad_s) < REST_RAD_S:
                    still_since = None
                elif still_since is None:
                    still_since = sample
                elif sample.time_s - still_since.time_s >= self._config.rest_s:
                    return StopReport(True, tuple(samples), "; ".join(troubles))
            self._clock.sleep_until(self._clock.now() + 0.01)
        troubles["standstill was not measured in time"] = None
        return StopReport(False, tuple(samples), "; ".join(troubles))

    def close(self) -> SyncAccount:
        """Take the command away, see the axis let go, close the connection. May be repeated.

        Raises
        ------
        ConfigurationError
            The controller does not let go of the axis.
        """
        if self._closed:
            return self._samples.account
        self._closed = True
        try:
            if self._opened:
                self._let_go()
        finally:
            self._device.connection.close()
        return self._samples.account

    # -- the exchange --------------------------------------------------------------------------

    def _read(self) -> dict[str, Value]:
        return self._device.read(STATUS, self._clock.now() + self._config.timeout_s)

    def _write(self, values: Mapping[str, float]) -> None:
        self._device.write(values, self._clock.now() + self._config.timeout_s * len(values))

    def _beat(self) -> None:
        self._count = self._count + 1 & 0xFFFF
        self._write({"agent_alive": self._count})

    def _take(self, read: Mapping[str, Value]) -> JobStatus:
        """Return the status of one block, after noting that the controller is alive."""
        now_s = self._clock.now()
        self._life.heard(read["controller_alive"].whole, now_s)
        refuse_stopped(read)
        state = state_of(read)
        if state is JobState.FAULT:
            raise DriveFaultError(
                f"The controller's job program is in fault: {why(read)}.",
                "A person must find the cause and clear it at the controller.",
            )
        phase = read["phase"].whole
        return JobStatus(
            self._samples.take(read, now_s),
            state,
            read["progress"].value,
            PHASES[phase] if 0 <= phase < len(PHASES) else "unknown",
            why(read) if state is JobState.ABORTED else "",
        )

    # -- selecting and letting go --------------------------------------------------------------

    def _compare(self, wanted: Mapping[str, float]) -> None:
        """Read back everything that was written, and compare all of it before complaining."""
        names = ("axis", *wanted)
        read = self._device.read(names, self._clock.now() + self._config.timeout_s)
        expected = {"axis": float(self._config.axis), **wanted}
        wrong = [
            f"{name} set to {expected[name]:g}, reads {read[name].value:g}"
            for name in names
            if not math.isclose(read[name].value, expected[name], rel_tol=1e-6, abs_tol=1e-3)
        ]
        if wrong:
            raise ConfigurationError(
                f"The controller does not hold what was written: {'; '.join(wrong)}.",
                "Compare its job program with docs/modbus.md; nothing moves until it holds.",
            )

    def _set_clock(self) -> None:
        """Look at the controller's clock a few times, before any of its samples counts."""
        for _ in range(5):
            asked_s = self._clock.now()
            read = self._read()
            self._samples.see_clock(read, asked_s)
            self._life.begin(read["controller_alive"].whole, self._clock.now())

    def _await_selection(self) -> None:
        deadline_s = self._clock.now() + self._config.answer_timeout_s
        while True:
            self._beat()
            read = self._read()
            self._life.begin(read["controller_alive"].whole, self._clock.now())
            selected = read["selected_axis"].whole
            state = state_of(read)
            if selected == self._config.axis and state is JobState.READY:
                return
            if self._clock.now() >= deadline_s:
                raise ConfigurationError(
                    f"The controller did not select axis {self._config.axis} within "
                    f"{self._config.answer_timeout_s} s: it has {selected}, "
                    f"{'unknown' if state is None else state.value}; {why(read)}.",
                    "Check that its job program runs and accepts the parameters.",
                )
            self._clock.sleep_until(self._clock.now() + 0.01)

    def _let_go(self) -> None:
        deadline_s = self._clock.now() + self._config.answer_timeout_s
        trouble = "it still has the axis selected"
        while self._clock.now() < deadline_s:
            try:
                self._write({"command": LET_GO})
                if self._read()["selected_axis"].whole == 0:
                    return
            except DriverError as error:
                trouble = error.what
            self._clock.sleep_until(self._clock.now() + RETRY_S)
        raise ConfigurationError(
            f"The controller did not let go of axis {self._config.axis}: {trouble}",
            "Cancel the job at the controller.",
        )


def _stands(before: Sample, now: Sample) -> bool:
    """Return whether the joint has kept its place, whatever velocity it reports."""
    moved_rad = abs(now.position_rad - before.position_rad)
    return moved_rad <= REST_RAD_S * (now.time_s - before.time_s) + _RESOLVED_RAD
