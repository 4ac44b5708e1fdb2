"""Every precondition of motion by its name: when it is judged, and what it asks. One list.

Each blocks with its reason. A dry run shows the whole list: what is judged without the bus is
judged, of the rest it says when it will be.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from agent.cell.cell import Axis, Cell


class Judged(enum.Enum):
    """When a precondition is judged; the value completes the sentence of a dry run."""

    WITHOUT_BUS = "now"
    BY_CELL = "by the cell's release, before the drive is reached and at every tick"
    BY_DRIVE = "by what the drive answers, before it has torque"
    AT_STANDSTILL = "by a fifth of a second of samples, before it has torque"
    BY_SILENCE = "at standstill under torque, before the first motion"
    BY_CONTROLLER = "by the controller's own words, before the job and at every exchange"


@dataclass(frozen=True)
class Precondition:
    """One precondition: its name, when it is judged, and what it asks."""

    name: str
    judged: Judged
    asks: str


_CELL = (
    Precondition("commissioned", Judged.WITHOUT_BUS, "a responsible person has checked the limits"),
    Precondition("payload confirmed", Judged.WITHOUT_BUS, "the cell says what the arm carries"),
    Precondition(
        "inside limits",
        Judged.WITHOUT_BUS,
        "path with stopping distance, speed, acceleration, jerk and estimated torque fit",
    ),
    Precondition("disk space", Judged.WITHOUT_BUS, "the recording and a reserve have room"),
    Precondition("no other owner", Judged.WITHOUT_BUS, "no other program holds the axis"),
)
_RELEASE = Precondition(
    "release present",
    Judged.BY_CELL,
    "the cell is closed, free, in automatic, and nothing is stopped",
)
_DRIVE = (
    Precondition(
        "operating mode", Judged.BY_CELL, "AUTOMATIC or AUTOMATIC_EXTERNAL: the release says so"
    ),
    Precondition(
        "no stop active",
        Judged.BY_CELL,
        "neither EmergencyStop nor ProtectiveStop: the release says so",
    ),
    Precondition("identity", Judged.BY_DRIVE, "vendor, product and serial number are the cell's"),
    Precondition("drive healthy", Judged.BY_DRIVE, "no fault, and nobody has given it torque"),
    Precondition(
        "limits of the drive",
        Judged.BY_DRIVE,
        "the window is not wider than the software limits found in the drive, if it has any",
    ),
    Precondition(
        "units of the drive",
        Judged.BY_DRIVE,
        "gear ratio, feed constant, polarity and the like are as when the axis was last driven",
    ),
    Precondition(
        "nobody else at work", Judged.BY_DRIVE, "no other heartbeat, order or SYNC like ours"
    ),
    Precondition(
        "settings read back equal",
        Judged.BY_DRIVE,
        "PDO maps, watchdog, quick stop, ramps and software limits hold what was written",
    ),
)
_CONTROLLER = (
    Precondition("operating mode", Judged.BY_CONTROLLER, "AUTOMATIC or AUTOMATIC_EXTERNAL"),
    Precondition(
        "no stop active", Judged.BY_CONTROLLER, "neither EmergencyStop nor ProtectiveStop"
    ),
    Precondition("settings read back equal", Judged.BY_CONTROLLER, "the job's parameters"),
)
_STANDSTILL = (
    Precondition("answers SYNC", Judged.AT_STANDSTILL, "samples come"),
    Precondition("without torque", Judged.AT_STANDSTILL, "the drive is off"),
    Precondition("at standstill", Judged.AT_STANDSTILL, "the joint does not move"),
    Precondition("inside its window", Judged.AT_STANDSTILL, "the arm stands where it may"),
    Precondition(
        "gearbox temperature", Judged.AT_STANDSTILL, "known where it is measured, and in range"
    ),
)
_WATCHDOG = Precondition(
    "watchdog proven",
    Judged.BY_SILENCE,
    "the drive lets go when the agent falls silent; not asked in pp, whose moves end by themselves",
)


def preconditions(cell: Cell, axis: Axis) -> tuple[Precondition, ...]:
    """Return every precondition of a cycle on this axis, in the order in which they are judged."""
    release = (_RELEASE,) if cell.release is not None else ()
    if axis.job is not None:
        return (*_CELL, *release, *_CONTROLLER, *_STANDSTILL)
    if cell.bus.replays:  # nothing moves: there is neither a drive nor a cell to answer
        return (*_CELL, *_STANDSTILL)
    return (*_CELL, *release, *_DRIVE, *_STANDSTILL, _WATCHDOG)
