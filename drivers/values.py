"""What passes between agent and devices in a tick: orders, answers, readings; motor side, SI."""

from __future__ import annotations

import enum
import math
from typing import NamedTuple


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
    gearbox_temperature_reason: str = ""  # why it is no number, whoever measures it
    move: MoveProgress | None = None  # of a drive that makes its own moves


class Permit(NamedTuple):
    """Whether the cell permits motion now."""

    granted: bool
    reason: str  # why not; empty where it is granted


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
    reason: str = ""  # why it was aborted, or not heard
