"""What the agent asks of a device. A port has at most five methods; SI units, motor side.

Implementations live in the other rooms of `drivers`; fakes speak bytes, never these classes.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol


class Goal(enum.Enum):
    """The state that the agent wants the drive to be in."""

    OFF = "off"
    ON = "on"
    QUICK_STOP = "quick-stop"


class DriveState(enum.Enum):
    """The state that the drive says it is in, reduced to what decisions need."""

    OFF = "off"  # power stage off, no fault
    ON = "on"  # operation enabled: set-points are followed
    QUICK_STOP = "quick-stop"
    FAULT = "fault"


class SetPoints(enum.Enum):
    """What a drive is fed with; the mode of operation decides."""

    VELOCITY = "velocity"  # each tick: pv, csv, vl
    POSITION = "position"  # each tick: csp, ip
    MOVE = "move"  # now and then, and the drive's own profile leads there: pp


class Move(NamedTuple):
    """One motion from rest to rest that the drive's own profile makes; motor side."""

    number: int  # another one than the move before
    position_rad: float  # where it ends
    velocity_rad_s: float  # its highest speed, above zero


class MoveState(enum.Enum):
    """How far the drive is with a `Move`."""

    OFFERED = "offered"  # sent, and not acknowledged yet
    RUNNING = "running"
    DONE = "done"  # the drive says that it stands at its target


class MoveProgress(NamedTuple):
    """What the drive says of the last `Move`."""

    number: int
    state: MoveState


class Command(NamedTuple):
    """One tick's order to an axis; motor side, and ignored unless the goal is ON.

    Which of the three set-points acts is `AxisEvidence.set_points`; the velocity always says what
    is planned for this moment.
    """

    goal: Goal
    velocity_rad_s: float
    position_rad: float = math.nan
    move: Move | None = None


class Quality(enum.Enum):
    """What a measured value is worth; the value is the word that a recording uses."""

    GOOD = "good"
    ABSENT = "no-sensor"  # the device says so, with a sentinel
    BAD = "bad"  # the device or its map calls the value wrong
    STALE = "stale"  # nothing new has come for too long


class TemperatureReading(NamedTuple):
    """One temperature from a device of its own. Anything but GOOD is NaN, with its reason."""

    degc: float
    taken_s: float  # when it was asked for, on the injected clock
    quality: Quality
    reason: str = ""  # why it is no number; or, of a GOOD one, why none has followed it


class Sample(NamedTuple):
    """One answer of the drive to one SYNC."""

    time_s: float  # when the SYNC was sent, on the injected clock
    received_s: float  # when the answer was taken from the bus, same clock
    position_rad: float
    velocity_rad_s: float
    torque_nm: float
    gearbox_temperature_degc: float  # NaN: no sensor, or its value is a sentinel
    state: DriveState
    internal_limit_active: bool
    # Of a temperature that another device measures, NaN and GOOD where the drive measures it:
    gearbox_temperature_age_s: float = math.nan
    gearbox_temperature_quality: Quality = Quality.GOOD
    gearbox_temperature_reason: str = ""
    move: MoveProgress | None = None  # of a drive that makes its own moves


@dataclass(frozen=True)
class AxisEvidence:
    """What `open` found and set, kept with the recording.

    Parameters
    ----------
    identity : mapping
        `vendor_id`, `product_code`, `revision`, `serial`, `name` as read.
    settings : mapping
        Every object that was read back after it was set, "0x6007:00" -> value.
    found : mapping
        The same objects as they were found, so that they can be restored.
    mode, mode_reason : str
        The mode of operation ("pv", "csp" ...) and why it is this one; empty where there is none.
    set_points : SetPoints
        What the drive is fed with.
    """

    identity: Mapping[str, int | str]
    settings: Mapping[str, int] = field(default_factory=dict)
    found: Mapping[str, int] = field(default_factory=dict)
    mode: str = ""
    mode_reason: str = ""
    set_points: SetPoints = SetPoints.VELOCITY


@dataclass(frozen=True)
class SyncAccount:
    """How many samples were asked for and what became of them.

    Parameters
    ----------
    expected, received, lost : int
        SYNCs that were sent; that were answered; that were not, while somebody listened.
    late : int
        Answers that came after the next SYNC had been sent.
    jitter_s : float
        Standard deviation of the answers' delay, in seconds.
    duplicates, unmatched : int
        Answers that no SYNC was open for: the last answer once more; anything else.
    not_asked : int
        SYNCs that the computer should have sent by its own sample rate and did not.
    longest_gap_s : float
        Between two SYNCs, in seconds.
    dropped_by_kernel : int or None
        Frames, of whatever kind, that the kernel had no room for; None where nobody can tell.
    reader, stamps : str
        Who received ("process", "thread", "stepped"), who stamped ("kernel", "host").
    receive_buffer_bytes : int or None
        What the kernel granted; None where nobody asked.
    undecided : int
        Of the lost ones: an answer came that may have been theirs, and nobody could tell.
    doubtful : int
        Of the received ones: they may stand in their neighbour's place in time.
    """

    expected: int = 0
    received: int = 0
    lost: int = 0
    late: int = 0
    jitter_s: float = 0.0
    duplicates: int = 0
    unmatched: int = 0
    not_asked: int = 0
    longest_gap_s: float = 0.0
    dropped_by_kernel: int | None = None
    reader: str = ""
    stamps: str = ""
    receive_buffer_bytes: int | None = None
    undecided: int = 0
    doubtful: int = 0


@dataclass(frozen=True)
class WatchdogProof:
    """What a drive did when it no longer heard our heartbeat, at standstill and under torque.

    Parameters
    ----------
    reacted : bool
        Whether it left operation enabled by itself, in time.
    timeout_s : float
        The silence after which it was told to react.
    still_enabled_s, reaction_s : float
        After our last heartbeat: until when it was seen enabled at least, and when it was first
        seen not to be; it reacted between the two. `reaction_s` is NaN where it did not.
    state : str
        Where it went, in CiA 402's words.
    emergencies : tuple of str
        What it sent meanwhile, as "0x8130".
    recovery : str
        What it needed to be ready again: "start", "fault reset" or "reset communication".
    """

    reacted: bool
    timeout_s: float
    still_enabled_s: float
    reaction_s: float
    state: str
    emergencies: tuple[str, ...]
    recovery: str


@dataclass(frozen=True)
class StopReport:
    """How a stop ended. `at_rest` is True only when standstill was measured."""

    at_rest: bool
    samples: tuple[Sample, ...]
    reason: str


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


class Permit(NamedTuple):
    """Whether the cell permits motion now."""

    granted: bool
    reason: str  # why not; empty where it is granted


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


class JobState(enum.Enum):
    """What a controller's job program says of itself."""

    IDLE = "idle"
    READY = "ready"  # the axis is selected, nothing moves
    RUNNING = "running"
    DONE = "done"
    ABORTED = "aborted"
    FAULT = "fault"


class JobStatus(NamedTuple):
    """What a controller that runs the stair itself said in one exchange."""

    sample: Sample | None  # None: none that is new
    state: JobState | None  # None: it was not heard this time
    progress: float  # share of the stair, 0 to 1
    phase: str
    reason: str = ""  # why it was aborted


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
