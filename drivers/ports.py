"""What the agent asks of a device. A port has at most five methods; SI units, motor side.

What passes through the ports is in `drivers.values` and `drivers.evidence`, and offered here with
them. Implementations live in the other rooms of `drivers`; fakes speak bytes, never these classes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from drivers.evidence import AxisEvidence, StopReport, SyncAccount, WatchdogProof
from drivers.values import (
    Command,
    DriveState,
    Goal,
    JobState,
    JobStatus,
    Move,
    MoveProgress,
    MoveState,
    Permit,
    Quality,
    Sample,
    SetPoints,
    TemperatureReading,
)

__all__ = [
    "Axis",
    "AxisEvidence",
    "Command",
    "DriveState",
    "Goal",
    "JobController",
    "JobState",
    "JobStatus",
    "Move",
    "MoveProgress",
    "MoveState",
    "Permit",
    "Quality",
    "Release",
    "Sample",
    "SetPoints",
    "StopReport",
    "SyncAccount",
    "TemperatureProbe",
    "TemperatureReading",
    "WatchdogProof",
]


class Axis(Protocol):
    """One drive under test. Not thread-safe: called from the control tick alone."""

    def open(self) -> AxisEvidence:
        """Identify, snapshot, map and arm the drive; it stays without torque.

        Raises
        ------
        drivers.errors.DriverError
            With the reason; whatever had been written is restored by `close`.
        """
        ...

    def send(self, command: Command) -> None:
        """Send set-point, SYNC and (when due) the heartbeat; never waits for an answer."""
        ...

    def receive(self) -> tuple[Sample, ...]:
        """Return all samples that have arrived since the last call, oldest first; never waits.

        Raises
        ------
        drivers.errors.DriverError
            EMCY, fault, heartbeat lost, SYNC unanswered, bus or worker dead.
        """
        ...

    def stop(self, deadline_s: float) -> StopReport:
        """Quick-stop and wait, up to the clock's `deadline_s`, for a measured standstill.

        Never raises: whatever fails is in the report, and the other means are still tried.
        """
        ...

    def close(self) -> SyncAccount:
        """Take torque away, restore what `open` changed, let go of the node. May be repeated.

        Raises
        ------
        drivers.errors.ConfigurationError
            Naming every object that could not be restored.
        """
        ...


class Release(Protocol):
    """The cell's release: its PLC, or a contact. Called from the control tick.

    It is no safety function: guards, E-stop and enabling belong to the hardware.
    """

    def open(self) -> None:
        """Reach whoever gives the permit.

        Raises
        ------
        drivers.errors.DriverError
            Nobody answers.
        """
        ...

    def request(self) -> None:
        """Ask for the permit."""
        ...

    def permit(self) -> Permit:
        """Return whether motion is permitted now, and say that we are alive; never waits.

        Once per control tick: a permit that is stale, or not heard yet, is none.

        Raises
        ------
        drivers.errors.WorkerDiedError
            Nobody listens any more.
        """
        ...

    def done(self, *, well: bool) -> None:
        """Take the request back and say how the cycle ended.

        Raises
        ------
        drivers.errors.DriverError
            It cannot be told.
        """
        ...

    def close(self) -> None:
        """Let go. May be repeated."""
        ...


class JobController(Protocol):
    """A robot controller that runs the stair itself. Called from the control tick alone.

    It stops the axis by itself when `exchange` is no longer called (its watchdog on our count).
    """

    def open(self) -> AxisEvidence:
        """Check mode and stops, select the axis, write the parameters and read them back.

        Raises
        ------
        drivers.errors.DriverError
            With the reason; nothing has moved.
        """
        ...

    def start(self) -> None:
        """Let the job begin."""
        ...

    def exchange(self) -> JobStatus:
        """Say that we are alive, and return what the controller says; one round trip each.

        Raises
        ------
        drivers.errors.DriverError
            Silence, a count that stands still, no automatic mode, a stop, a fault.
        """
        ...

    def stop(self, deadline_s: float) -> StopReport:
        """Abort and wait, up to the clock's `deadline_s`, for a measured standstill; no raise."""
        ...

    def close(self) -> SyncAccount:
        """Let go of the axis and of the connection. May be repeated.

        Raises
        ------
        drivers.errors.ConfigurationError
            The controller does not let go.
        """
        ...


class TemperatureProbe(Protocol):
    """A device that measures a gearbox's temperature beside the drive.

    Called from the control tick: only `open` waits.
    """

    def open(self) -> Mapping[str, str | int | float]:
        """Reach the device, take the first reading, and return what the device is.

        Raises
        ------
        drivers.errors.DriverError
            Nobody answers, or another device than the cell describes.
        """
        ...

    def latest(self) -> TemperatureReading:
        """Return the newest reading, however old; never waits.

        Raises
        ------
        drivers.errors.WorkerDiedError
            Whoever reads the device has ended.
        """
        ...

    def close(self) -> None:
        """Let the device go. May be repeated."""
        ...
