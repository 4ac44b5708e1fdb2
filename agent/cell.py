"""CELL.toml: one robot cell, its bus and its axes, as a frozen and validated description.

Units are in the names. Unknown keys are refused, and every mistake is reported at once. Angles of
the arm are in degrees here, because that is what a technician reads from the robot's pendant; they
are converted to motor-side radians once, in this module.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import (
    AfterValidator,
    Field,
    ValidationInfo,
    model_validator,
)

from agent.cell_devices import (
    ContactRelease,
    Job,
    Positive,
    Release,
    Temperature,
    beside_the_cell,
    shared_places,
)
from agent.cell_devices import Part as _Part
from agent.errors import InputError
from drivers.described import validated
from drivers.profiles.drive_profile import load_profile
from trajectories import AxisLimits, TorqueModel, motor_rad

SCHEMA = "stribeck.cell/1"
REPLAY = "replay"
REAL_TIME = "real_time"


def _a_name(text: str) -> str:
    """Return `text` when it can stand in a file name on every system."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", text):
        raise ValueError(
            "expected letters, digits, '.', '_' or '-', starting with a letter or digit"
        )
    return text


def _beside_the_cell(channel: str | int, info: ValidationInfo) -> str | int:
    """Return a recording's path relative to the cell's own file; a bus's channel as it is."""
    folder = info.context.get("folder") if isinstance(info.context, dict) else None
    if info.data.get("interface") != REPLAY or folder is None:
        return channel
    return str(Path(folder) / str(channel))


def _a_profile(name: str, info: ValidationInfo) -> str:
    """Return a profile's name, or the path of its file, once it has been read without mistakes."""
    place = beside_the_cell(name, info)
    load_profile(place)
    return place


Name = Annotated[str, AfterValidator(_a_name)]
ProfileName = Annotated[str, AfterValidator(_a_profile)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Bus(_Part):
    """How the CAN bus is reached; names as python-can has them.

    `fast_reader` lets a process of its own receive where that is possible (SocketCAN on Linux).
    The interface `replay` is ours: `channel` is a recording, played in place of the drive.
    """

    interface: str = Field(min_length=1)
    channel: Annotated[str | int, AfterValidator(_beside_the_cell)]
    bitrate: int = Field(default=1_000_000, gt=0)
    fast_reader: bool = True
    options: dict[str, str | int | float | bool] = Field(default={})

    @property
    def replays(self) -> bool:
        """Return whether a recording is played instead of a bus opened."""
        return self.interface == REPLAY

    @property
    def in_real_time(self) -> bool:
        """Return whether a recording is played at its own pace, not as fast as it can be."""
        return bool(self.options.get(REAL_TIME, True))

    @model_validator(mode="after")
    def _replay_takes_one_option(self) -> Self:
        if self.replays and not isinstance(self.options.get(REAL_TIME, True), bool):
            raise ValueError(f"the option {REAL_TIME} of a replay is true or false")
        if self.replays and set(self.options) - {REAL_TIME}:
            raise ValueError(f"a replay has one option, {REAL_TIME}")
        return self


class TemperatureObject(_Part):
    """A gearbox temperature that the drive passes on as a 16-bit object."""

    object: Annotated[str, Field(pattern=r"^0x[0-9A-Fa-f]{4}:[0-9A-Fa-f]{2}$")]
    degc_per_count: Positive = 0.1
    offset_degc: Finite = 0.0
    no_sensor_counts: tuple[int, ...] = Field(default=(-32768,), strict=False)

    @property
    def index(self) -> int:
        """Return the object's index."""
        return int(self.object[2:6], 16)

    @property
    def subindex(self) -> int:
        """Return the object's sub-index."""
        return int(self.object[7:9], 16)


class Drive(_Part):
    """The servo drive: who it must be, what it can, and what its numbers mean.

    What it lacks - a consumer heartbeat (0x1016), an abort connection option (0x6007), software
    limits (0x607D) - comes from its profile, unless the cell says it itself.
    """

    node_id: int = Field(ge=1, le=126)
    vendor_id: int = Field(ge=0, le=0xFFFFFFFF)
    product_code: int = Field(ge=0, le=0xFFFFFFFF)
    serial: int | None = Field(default=None, ge=0, le=0xFFFFFFFF)
    rated_torque_nm: Positive
    encoder_counts_per_motor_rev: int = Field(gt=0)
    profile: ProfileName | None = None
    velocity_unit: Literal["counts_per_s", "rpm", "milli_rpm"] = "counts_per_s"
    mode: Literal["auto", "pv", "csv", "vl", "csp", "ip", "pp"] = "auto"
    heartbeat_consumer: bool | None = None  # None: as the profile says, else that it is there
    abort_connection: bool | None = None
    software_limits: bool | None = None
    direction: Literal[1, -1] = 1
    zero_position_counts: int = 0
    gearbox_temperature: TemperatureObject | None = None
    watched: bool = True  # while another axis of the cell is under test


class Limits(_Part):
    """What this axis may never exceed; the gate refuses what would."""

    arm_position_min_deg: Finite
    arm_position_max_deg: Finite
    motor_velocity_max_rad_s: Positive
    motor_acceleration_max_rad_s2: Positive
    motor_jerk_max_rad_s3: Positive
    motor_torque_max_nm: Positive
    stopping_deceleration_rad_s2: Positive
    velocity_error_max_rad_s: Positive
    following_error_max_arm_deg: Positive
    gearbox_temperature_min_degc: Finite = 0.0
    gearbox_temperature_max_degc: Finite = 80.0

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.arm_position_min_deg >= self.arm_position_max_deg:
            raise ValueError("arm_position_min_deg must be below arm_position_max_deg")
        if self.gearbox_temperature_min_degc >= self.gearbox_temperature_max_degc:
            raise ValueError(
                "gearbox_temperature_min_degc must be below gearbox_temperature_max_degc"
            )
        return self


class Supervision(_Part):
    """How quickly silence is noticed, by us and by the drive."""

    agent_node_id: int = Field(default=127, ge=1, le=127)
    heartbeat_period_s: Positive = 0.02
    heartbeat_timeout_s: Positive = 0.15
    drive_heartbeat_period_s: Positive = 0.1
    sample_age_max_s: Positive = 0.1
    samples_lost_in_a_row_max: int = Field(default=3, ge=1)

    @property
    def reaction_time_s(self) -> float:
        """Return how long the joint may go on before anything brakes it, in seconds."""
        return max(self.heartbeat_timeout_s + self.heartbeat_period_s, self.sample_age_max_s)

    @model_validator(mode="after")
    def _heartbeats_fit(self) -> Self:
        if self.heartbeat_timeout_s < 3.0 * self.heartbeat_period_s:
            raise ValueError("heartbeat_timeout_s must be at least three heartbeat_period_s")
        return self


class Stair(_Part):
    """The identification cycle: each speed forward and backward, between two arm positions."""

    kind: Literal["paired", "between"] = "paired"
    arm_from_deg: Finite = -50.0
    arm_to_deg: Finite = 50.0
    speeds: int = Field(default=11, ge=2, le=60)
    motor_velocity_min_rad_s: Positive
    motor_velocity_max_rad_s: Positive
    motor_acceleration_rad_s2: Positive
    motor_jerk_rad_s3: Positive
    duration_s: Positive = 40.0
    approach_velocity_rad_s: Positive
    start_tolerance_arm_deg: Positive = 0.5

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.motor_velocity_min_rad_s >= self.motor_velocity_max_rad_s:
            raise ValueError("motor_velocity_min_rad_s must be below motor_velocity_max_rad_s")
        if self.arm_from_deg >= self.arm_to_deg:
            raise ValueError("arm_from_deg must be below arm_to_deg")
        return self


class Expected(_Part):
    """A rough idea of the joint, for the torque estimate of the dry run; motor side."""

    inertia_kg_m2: NonNegative = 0.0
    coulomb_nm: NonNegative = 0.0
    viscous_nm_s_per_rad: NonNegative = 0.0
    gravity_peak_nm: NonNegative = 0.0


class Axis(_Part):
    """One joint: its drive, its limits, its cycle, and who has commissioned it."""

    number: int = Field(ge=1, le=99)
    commissioned: bool = False
    commissioned_by: str = ""
    gear_ratio: Annotated[float, Field(ge=1.0, allow_inf_nan=False)]
    gearbox_serial: str = ""
    payload_kg: NonNegative | None = None
    drive_: Drive | None = Field(default=None, alias="drive")
    job: Job | None = None
    limits: Limits
    stair: Stair
    supervision: Supervision = Supervision()
    expected: Expected | None = None
    temperature: Temperature | None = None

    @property
    def drive(self) -> Drive:
        """Return the servo drive, or refuse: a controller may run the axis by itself."""
        if self.drive_ is None:
            raise InputError(
                f"Axis {self.number} has no drive of its own: a controller runs it as a job."
            )
        return self.drive_

    @property
    def has_gearbox_temperature(self) -> bool:
        """Return whether a gearbox temperature is measured: by drive, probe or controller."""
        by_drive = self.drive_ is not None and self.drive_.gearbox_temperature is not None
        by_controller = self.job is not None and self.job.gearbox_temperature
        return by_drive or self.temperature is not None or by_controller

    def motor_rad(self, arm_deg: float) -> float:
        """Return the motor angle, in radians, of an arm angle in degrees."""
        return motor_rad(arm_deg, self.gear_ratio)

    @property
    def motor_limits(self) -> AxisLimits:
        """Return the limits on the motor side, in radians."""
        return AxisLimits(
            position_min_rad=self.motor_rad(self.limits.arm_position_min_deg),
            position_max_rad=self.motor_rad(self.limits.arm_position_max_deg),
            velocity_max_rad_s=self.limits.motor_velocity_max_rad_s,
            acceleration_max_rad_s2=self.limits.motor_acceleration_max_rad_s2,
            jerk_max_rad_s3=self.limits.motor_jerk_max_rad_s3,
            torque_max_nm=self.limits.motor_torque_max_nm,
            stopping_deceleration_rad_s2=self.limits.stopping_deceleration_rad_s2,
            reaction_time_s=self.reaction_time_s,
        )

    @property
    def reaction_time_s(self) -> float:
        """Return how long the joint may go on before anything brakes it, in seconds."""
        if self.job is None:
            return self.supervision.reaction_time_s
        silence_s = self.job.alive_timeout_s + self.job.timeout_s
        return max(silence_s, self.supervision.sample_age_max_s)

    @property
    def torque_model(self) -> TorqueModel | None:
        """Return the rough torque model of the dry run, where the cell gives one."""
        if self.expected is None:
            return None
        return TorqueModel(
            inertia_kg_m2=self.expected.inertia_kg_m2,
            coulomb_nm=self.expected.coulomb_nm,
            viscous_nm_s_per_rad=self.expected.viscous_nm_s_per_rad,
            gravity_nm=self.expected.gravity_peak_nm,
        )

    @model_validator(mode="after")
    def _someone_answers_for_it(self) -> Self:
        if self.commissioned and not self.commissioned_by.strip():
            raise ValueError("commissioned = true needs commissioned_by: who, and when")
        return self

    @model_validator(mode="after")
    def _one_driver_one_temperature(self) -> Self:
        if (self.drive_ is None) == (self.job is None):
            raise ValueError("an axis needs either [axis.drive] or [axis.job]")
        if self.job is not None and self.temperature is not None:
            raise ValueError("with [axis.job] the temperature comes from the controller")
        by_drive = self.drive_ is not None and self.drive_.gearbox_temperature is not None
        if by_drive and self.temperature is not None:
            raise ValueError(
                "the gearbox temperature comes from drive.gearbox_temperature or from "
                "[axis.temperature], not from both"
            )
        return self


class Recording(_Part):
    """Where and how often samples are kept."""

    folder: str = "recordings"
    sample_rate_hz: Annotated[float, Field(ge=50.0, le=1000.0)] = 500.0
    disk_reserve_mb: Annotated[float, Field(ge=0.0)] = 200.0


class Cell(_Part):
    """One robot cell."""

    schema_: Literal["stribeck.cell/1"] = Field(alias="schema")
    robot: Name
    bus_: Bus | None = Field(default=None, alias="bus")
    recording: Recording = Recording()
    release: Release | None = None
    axis: tuple[Axis, ...] = Field(strict=False)

    @model_validator(mode="after")
    def _axes_are_distinct(self) -> Self:
        if not self.axis:
            raise ValueError("a cell needs at least one [[axis]]")
        drives = [axis.drive_ for axis in self.axis if axis.drive_ is not None]
        if drives and self.bus_ is None:
            raise ValueError("[bus] is missing: how the drives are reached")
        by_job = [str(axis.number) for axis in self.axis if axis.job is not None]
        if self.bus_ is not None and self.bus_.replays and by_job:
            # Somebody who believes that all is replayed would be driving a robot.
            raise ValueError(f"a replay has drives only: axis {', '.join(by_job)} has [axis.job]")
        if isinstance(self.release, ContactRelease) and not drives:
            raise ValueError("a release on a CAN input needs a drive on [bus] beside it")
        for what in ("number", "node_id"):
            values = [a.number for a in self.axis]
            if what == "node_id":
                values = [drive.node_id for drive in drives]
            twice = sorted({v for v in values if values.count(v) > 1})
            if twice:
                raise ValueError(f"{what} {twice[0]} is given to more than one axis")
        for axis in self.axis:
            drive = axis.drive_
            node = None if drive is None else drive.node_id
            shared = shared_places(node, axis.temperature, axis.job, self.release)
            if shared:
                raise ValueError(f"axis {axis.number}: {'; '.join(shared)}")
            if drive is not None and axis.supervision.agent_node_id == drive.node_id:
                raise ValueError(f"axis {axis.number}: agent_node_id is the drive's own node_id")
        return self

    @property
    def bus(self) -> Bus:
        """Return the CAN bus, or refuse where the cell has none."""
        if self.bus_ is None:
            raise InputError(f"The cell {self.robot} has no CAN bus.")
        return self.bus_

    def axis_numbered(self, number: int) -> Axis:
        """Return the axis with this number, or refuse, naming those there are."""
        for axis in self.axis:
            if axis.number == number:
                return axis
        known = ", ".join(str(a.number) for a in self.axis)
        raise InputError(f"The cell {self.robot} has no axis {number}; it has {known}.")


def parse_cell(text: str, source: str = "CELL.toml", folder: Path | None = None) -> Cell:
    """Parse and validate a cell description.

    Parameters
    ----------
    text : str
        TOML.
    source : str
        What to call it in messages.
    folder : pathlib.Path, optional
        What the files that the cell names are relative to.

    Raises
    ------
    agent.errors.InputError
        With every mistake on a line of its own.
    """
    return validated(Cell, text, source, InputError, whole="the cell", context={"folder": folder})


def read_cell(path: Path) -> Cell:
    """Read and validate CELL.toml.

    Raises
    ------
    agent.errors.InputError
        Where the file cannot be read, or with every mistake in it.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"The cell description {path} cannot be read: {error}.") from error
    return parse_cell(text, source=str(path), folder=path.parent)
