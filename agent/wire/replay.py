"""The composition root's replay: a recording becomes an axis. No device is reached from here."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agent.acquisition import Acquisition
from agent.cell.cell import Axis, Cell
from agent.cycle.stage import Stage
from agent.errors import InputError
from agent.record.reading import read
from agent.record.recording import Column, Recording
from agent.replayed import Replayed
from drivers.clock import Clock, MonotonicClock, SteppedClock
from drivers.ports import Quality
from drivers.recorded import Recorded
from drivers.replay import ReplayAxis

NEEDED = ("position_rad", "velocity_rad_s")
"""What a recording may lack, and an axis cannot: the gate judges both at every tick."""

DRIVES_OWN_MOVES = "pp"
"""The mode in which the drive, not the plan, says when a move has ended."""

AGE, QUALITY = "gearbox_temperature_age_s", "gearbox_temperature_quality"


@dataclass(frozen=True)
class Replay:
    """A recording, and the axis that plays it."""

    recording: Recording
    axis: ReplayAxis

    @property
    def torque_source(self) -> Mapping[str, object]:
        """Return where the torque comes from: whatever the recording says of its drive."""
        drive = self.recording.metadata.drive
        return {"torque_source": "the recording's", **({"recorded_drive": drive} if drive else {})}

    def played(self) -> Replayed:
        """Return what was played so far, and how the set-points compare."""
        comparison = self.axis.comparison
        first_s = comparison.first_s
        return Replayed(
            source=Path(self.recording.source).name,
            started_at=self.recording.metadata.started_at,
            compared=comparison.compared,
            different=comparison.different,
            largest_difference_rad_s=comparison.largest_rad_s,
            first_difference_s=None if math.isnan(first_s) else first_s,
            held=self.axis.held,
        )


def clock_for(cell: Cell) -> Clock:
    """Return real time, but for a replay that need not take as long as its recording."""
    bus = cell.bus_
    in_real_time = bus is None or not bus.replays or bus.in_real_time
    return MonotonicClock() if in_real_time else SteppedClock()


def open_replay(cell: Cell, axis: Axis, clock: Clock) -> Replay:
    """Read the recording that the cell names and return the axis that plays it.

    Raises
    ------
    agent.errors.InputError
        It cannot be read, is another joint's, or lacks what an axis must tell.
    """
    recording = read(str(cell.bus.channel))
    where = recording.source
    ours = (cell.robot, axis.number, axis.gear_ratio)
    theirs = (recording.robot, recording.axis, recording.gear_ratio)
    if ours != theirs:
        raise InputError(
            f"{where} is of {_joint(*theirs)}; the cell describes {_joint(*ours)}.",
            "Play a recording of the joint that the cell describes.",
        )
    missing = [name for name in NEEDED if name not in recording]
    if missing:
        raise InputError(
            f"{where} has no {missing[0]}, and an axis tells its position and its velocity.",
            "Play a recording that has both.",
        )
    drive = recording.metadata.drive
    if isinstance(drive, Mapping) and drive.get("mode") == DRIVES_OWN_MOVES:
        raise InputError(
            f"{where} was made in profile position ({DRIVES_OWN_MOVES}): a move ended when the "
            "drive said so, and a recording does not carry that.",
            "Play a recording of another mode.",
        )
    return Replay(recording, ReplayAxis(_recorded(recording), clock))


def _recorded(recording: Recording) -> Recorded:
    """Return the recording's columns as the driver takes them."""
    account = Acquisition.from_metadata(recording.metadata.extra, recording.source)
    enabled_from = _enabled_from(recording)
    return Recorded(
        time_s=recording["time_s"],
        position_rad=recording["position_rad"],
        velocity_rad_s=recording["velocity_rad_s"],
        torque_nm=recording["torque_nm"],
        gearbox_temperature_degc=_column(recording, "gearbox_temperature_degc"),
        gearbox_temperature_age_s=_column(recording, AGE),
        gearbox_temperature_quality=_qualities(recording),
        velocity_command_rad_s=_column(recording, "velocity_command_rad_s"),
        enabled_from=0 if enabled_from is None else enabled_from,
        begins_with_enabling=enabled_from is not None,
        samples_lost=recording.samples_lost,
        dropped_by_kernel=None if account is None else account.dropped_by_kernel,
        undecided=0 if account is None else account.undecided,
        doubtful=0 if account is None else account.doubtful,
        doubtful_s=None if account is None else account.doubtful_s,
        changed=() if account is None else account.changed,
        identity={"name": "replay", "recording": Path(recording.source).name},
    )


def _enabled_from(recording: Recording) -> int | None:
    """Return the first sample with the drive enabled; None where no cycle of ours begins it.

    The sample that shows the drive enabled is the last one of the phase: the next tick knows it.
    """
    if "phase" not in recording or recording["phase"][0] != Stage.ENABLE.value:
        return None
    later = np.flatnonzero(recording["phase"] != Stage.ENABLE.value)
    return max(int(later[0]) - 1, 0) if later.size else len(recording)


def _column(recording: Recording, name: str) -> Column | None:
    """Return a column of numbers, None where there is none of this name."""
    if name not in recording:
        return None
    try:
        return np.asarray(recording[name], dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{recording.source}: {name} should hold numbers.") from error


def _qualities(recording: Recording) -> tuple[Quality, ...] | None:
    """Return what each temperature is worth, None where the drive measured it."""
    if QUALITY not in recording:
        return None
    try:
        return tuple(Quality(word) for word in recording[QUALITY])
    except ValueError as error:
        words = ", ".join(quality.value for quality in Quality)
        raise InputError(f"{recording.source}: {QUALITY}: {error}; known are {words}.") from error


def _joint(robot: str, axis: int, gear_ratio: float) -> str:
    return f"{robot}, axis {axis}, gear ratio {gear_ratio:g}"
