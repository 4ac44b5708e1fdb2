"""A robot controller that runs the stair itself, as the port `JobController`.

The agent selects the axis, hands over the parameters and reads them back, starts, and from then on
writes a count at every control tick and reads one block of registers. Both sides watch the other's
count: a controller that stands still is a stop, and so is an agent that does (the controller's own
watchdog, whose time is written and read back before the start).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from drivers.clock import Clock
from drivers.errors import (
    ConfigurationError,
    DriveFaultError,
    DriverError,
    DriveStateError,
    HeartbeatLostError,
)
from drivers.modbus.device import MappedDevice, Value
from drivers.ports import (
    AxisEvidence,
    DriveState,
    JobState,
    JobStatus,
    Quality,
    Sample,
    StopReport,
    SyncAccount,
)

LET_GO, SELECT, START, ABORT = 0, 1, 2, 3
AUTOMATIC_MODES = (3, 4)
MODES = {
    1: "MANUAL_REDUCED_SPEED",
    2: "MANUAL_HIGH_SPEED",
    3: "AUTOMATIC",
    4: "AUTOMATIC_EXTERNAL",
}
STOPS = {1: "EmergencyStop", 2: "ProtectiveStop"}
STATES = {
    0: JobState.IDLE,
    1: JobState.READY,
    2: JobState.RUNNING,
    3: JobState.DONE,
    4: JobState.ABORTED,
    5: JobState.FAULT,
}
PHASES = ("", "approach", "ramp", "steady", "rest", "return")
ERRORS = {
    1: "it missed the agent's alive count",
    2: "the agent asked for it",
    3: "it does not accept the parameters",
    4: "for a reason of its own",
}
STATUS = (
    "controller_alive",
    "job_state",
    "job_error",
    "operating_mode",
    "stops",
    "selected_axis",
    "progress",
    "phase",
    "sample_number",
    "sample_period",
    "sample_time",
    "position",
    "velocity",
    "torque",
    "gearbox_temperature",
)
REST_RAD_S = 0.5
RETRY_S = 0.1
"""After a request that failed while stopping or letting go."""

_DRIVE_STATES: Mapping[JobState | None, DriveState] = {
    JobState.RUNNING: DriveState.ON,
    JobState.FAULT: DriveState.FAULT,
}


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
        self._offset_s = math.nan  # from the controller's clock to ours
        self._alive: float | None = None
        self._alive_s = -math.inf
        self._heard_s = -math.inf
        self._trouble = ""
        self._number: int | None = None
        self._account = SyncAccount(reader="modbus", stamps="controller")

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
        self._refuse_unready(first)
        self._opened = True
        config = self._config
        wanted = {**config.parameters, "alive_timeout": config.alive_timeout_s}
        self._write({"command": LET_GO, "axis": config.axis, **wanted})
        self._compare(wanted)
        self._set_clock()
        self._write({"command": SELECT})
        self._await_selection()
        period_s = first["sample_period"].value
        return AxisEvidence(
            identity={"name": self._device.map.device, "where": self._device.connection.where},
            settings={
                "axis": config.axis,
                "operating_mode": int(first["operating_mode"].value),
                "alive_timeout_ms": round(1e3 * config.alive_timeout_s),
                "sample_period_ms": round(1e3 * period_s),
            },
        )

    def start(self) -> None:
        """Let the controller begin."""
        self._write({"command": START})

    def exchange(self) -> JobStatus:
        """Say that we are alive and return what the controller says; one round trip each.

        A request that fails is forgiven until the controller has been silent for the alive
        time-out; the status then says what it said last, without a sample.

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
            self._trouble = error.what
            status = None
        now_s = self._clock.now()
        self._refuse_silence(now_s)
        return status or JobStatus(None, None, 0.0, "")

    def stop(self, deadline_s: float) -> StopReport:
        """Abort, again and again, and wait for a measured standstill. Never raises."""
        samples: list[Sample] = []
        troubles: dict[str, None] = {}
        still_since_s: float | None = None
        while self._clock.now() < deadline_s:
            try:
                self._write({"command": ABORT})
                self._beat()
                sample = self._sample(self._read())
            except DriverError as error:
                troubles[error.what] = None
                sample = None
                self._clock.sleep_until(min(deadline_s, self._clock.now() + RETRY_S))
            if sample is not None:
                samples.append(sample)
                if not abs(sample.velocity_rad_s) < REST_RAD_S:
                    still_since_s = None
                elif still_since_s is None:
                    still_since_s = sample.time_s
                elif sample.time_s - still_since_s >= self._config.rest_s:
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
            return self._account
        self._closed = True
        try:
            if self._opened:
                self._let_go()
        finally:
            self._device.connection.close()
        return self._account

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
        self._heard_s = now_s
        self._trouble = ""
        alive = read["controller_alive"].value
        if alive != self._alive:
            self._alive, self._alive_s = alive, now_s
        self._refuse_stopped(read)
        state = _state(read)
        if state is JobState.FAULT:
            raise DriveFaultError(
                f"The controller's job program is in fault: {_why(read)}.",
                "A person must find the cause and clear it at the controller.",
            )
        phase = int(read["phase"].value)
        return JobStatus(
            self._sample(read),
            state,
            read["progress"].value,
            PHASES[phase] if 0 <= phase < len(PHASES) else "unknown",
            _why(read) if state is JobState.ABORTED else "",
        )

    def _sample(self, read: Mapping[str, Value]) -> Sample | None:
        """Return the controller's sample, None when it is the one that we have; count the lost."""
        number = int(read["sample_number"].value)
        if number == self._number:
            return None
        step = 1 if self._number is None else number - self._number & 0xFFFF
        self._number = number
        account = self._account
        self._account = replace(
            account,
            expected=account.expected + step,
            received=account.received + 1,
            lost=account.lost + step - 1,
        )
        now_s = self._clock.now()
        taken_s = read["sample_time"].value
        # A controller's clock that runs fast would put samples into the future.
        self._offset_s = min(self._offset_s, now_s - taken_s)
        temperature = read["gearbox_temperature"]
        good = temperature.quality is Quality.GOOD
        return Sample(
            time_s=taken_s + self._offset_s,
            received_s=now_s,
            position_rad=read["position"].value,
            velocity_rad_s=read["velocity"].value,
            torque_nm=read["torque"].value,
            gearbox_temperature_degc=temperature.value if good else math.nan,
            state=_DRIVE_STATES.get(_state(read), DriveState.OFF),
            internal_limit_active=False,
            gearbox_temperature_reason=temperature.reason,
        )

    # -- what is refused -----------------------------------------------------------------------

    def _refuse_unready(self, read: Mapping[str, Value]) -> None:
        self._refuse_stopped(read)
        state = _state(read)
        if state is JobState.FAULT:
            raise DriveFaultError(
                f"The controller's job program is in fault: {_why(read)}.",
                "A person must find the cause and clear it at the controller.",
            )
        if state is JobState.RUNNING or read["selected_axis"].value != 0.0:
            raise DriveStateError(
                "The controller already has an axis selected for a job.",
                "Another program may be driving it: end that first.",
            )

    def _refuse_stopped(self, read: Mapping[str, Value]) -> None:
        mode, stops = int(read["operating_mode"].value), int(read["stops"].value)
        active = [name for bit, name in STOPS.items() if stops & bit]
        if active:
            raise DriveStateError(
                f"The controller reports {' and '.join(active)}.",
                "Find out why, and clear it at the controller.",
            )
        if mode not in AUTOMATIC_MODES:
            raise DriveStateError(
                f"The controller is in {MODES.get(mode, f'unknown mode {mode}')}; the stair is a "
                "job for automatic mode.",
                "Switch it to automatic, with the guards closed.",
            )

    def _refuse_silence(self, now_s: float) -> None:
        limit_s = self._config.alive_timeout_s
        if now_s - self._heard_s > limit_s:
            raise HeartbeatLostError(
                f"The controller has been silent for {now_s - self._heard_s:.2f} s: "
                f"{self._trouble}",
                "Check its network and its job program.",
            )
        if now_s - self._alive_s > limit_s:
            raise HeartbeatLostError(
                f"The controller's alive count has stood still for {now_s - self._alive_s:.2f} s.",
                "Its job program hangs or has ended: look at the controller.",
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
        """Find the offset from the controller's clock to ours: the quickest of five looks.

        A sample so has the time at which it was asked for, at the latest: never the future.
        """
        best_s = math.inf
        for _ in range(5):
            asked_s = self._clock.now()
            read = self._read()
            took_s = self._clock.now() - asked_s
            if took_s < best_s:
                best_s = took_s
                self._offset_s = asked_s - read["sample_time"].value
            self._take_alive(read)

    def _take_alive(self, read: Mapping[str, Value]) -> None:
        self._alive = read["controller_alive"].value
        self._alive_s = self._heard_s = self._clock.now()

    def _await_selection(self) -> None:
        deadline_s = self._clock.now() + self._config.answer_timeout_s
        while True:
            self._beat()
            read = self._read()
            self._take_alive(read)
            selected = int(read["selected_axis"].value)
            state = _state(read)
            if selected == self._config.axis and state is JobState.READY:
                return
            if self._clock.now() >= deadline_s:
                raise ConfigurationError(
                    f"The controller did not select axis {self._config.axis} within "
                    f"{self._config.answer_timeout_s} s: it has {selected}, "
                    f"{'unknown' if state is None else state.value}; {_why(read)}.",
                    "Check that its job program runs and accepts the parameters.",
                )
            self._clock.sleep_until(self._clock.now() + 0.01)

    def _let_go(self) -> None:
        deadline_s = self._clock.now() + self._config.answer_timeout_s
        trouble = "it still has the axis selected"
        while self._clock.now() < deadline_s:
            try:
                self._write({"command": LET_GO})
                if self._read()["selected_axis"].value == 0.0:
                    return
            except DriverError as error:
                trouble = error.what
            self._clock.sleep_until(self._clock.now() + RETRY_S)
        raise ConfigurationError(
            f"The controller did not let go of axis {self._config.axis}: {trouble}",
            "Cancel the job at the controller.",
        )


def _state(read: Mapping[str, Value]) -> JobState | None:
    return STATES.get(int(read["job_state"].value))


def _why(read: Mapping[str, Value]) -> str:
    code = int(read["job_error"].value)
    return ERRORS.get(code, "it gives no reason" if code == 0 else f"error {code}")
