"""CELL.toml's CAN bus and the drives on it: how they are reached, who they are, what they lack."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from agent.cell.devices import Part, Positive, beside_the_cell
from drivers.profiles.drive_profile import load_profile

REPLAY = "replay"
REAL_TIME = "real_time"


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


ProfileName = Annotated[str, AfterValidator(_a_profile)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Bus(Part):
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


class TemperatureObject(Part):
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


class Drive(Part):
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
    encoder_resolution: bool = True  # whether 0x608F or 0x6092, where it has them, say its counts
    direction: Literal[1, -1] = 1
    zero_position_counts: int = 0
    gearbox_temperature: TemperatureObject | None = None
    watched: bool = True  # while another axis of the cell is under test
