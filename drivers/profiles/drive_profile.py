"""Drive profiles as TOML: what a kind of drive can and lacks, read whole or refused whole.

Every value is a fact with its provenance: R read in a vendor's or project's file, P read on a page,
M measured, U common knowledge that nobody has confirmed. A cell names a profile; what the cell says
itself wins. Shipped profiles are in `drivers/profiles/drives`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Generic, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from drivers.described import Shelf

T = TypeVar("T")

SCHEMA = "stribeck.drive-profile/1"
Provenance = Literal["R", "P", "M", "U"]
ModeWord = Literal["pv", "csv", "vl", "csp", "ip", "pp"]
ObjectKey = Annotated[str, Field(pattern=r"^0x[0-9A-F]{4}:[0-9A-F]{2}$")]


class DriveProfileError(ValueError):
    """A drive profile cannot be used; the message names every mistake."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, populate_by_name=True)


class Fact(_Part, Generic[T]):
    """One value, where it is known from, and what one should know of it."""

    value: T
    provenance: Provenance = Field(alias="from")
    note: str = ""


class Modes(_Part):
    """What the drive offers of the ladder, for one whose 0x6502 does not say."""

    offered: Fact[list[ModeWord]]


class Watchdog(_Part):
    """How the drive can be made to stop by itself, and how it is got out of its fault."""

    heartbeat_consumer: Fact[bool]
    abort_connection: Fact[bool]
    quick_stop_option: Fact[int | Literal["absent"]]
    after_heartbeat_fault: Fact[Literal["fault reset", "reset communication"]] | None = None


class Ramps(_Part):
    """Which ramps can be set beside 0x6083: for braking (0x6084), and for a quick stop (0x6085)."""

    deceleration: Fact[bool]
    quick_stop_deceleration: Fact[bool]


class Torque(_Part):
    """Where the torque comes from, and whether the drive says what 1000 per mille are."""

    object: Fact[Literal["0x6077:00"]]
    rated_torque: Fact[Literal["value", "zero", "absent"]]


class Position(_Part):
    """Whether the drive keeps software limits (0x607D)."""

    software_limits: Fact[bool]


class Velocity(_Part):
    """The unit of 0x606C and 0x60FF as the drive ships."""

    unit: Fact[Literal["counts_per_s", "rpm", "milli_rpm"]]


class TemperatureFact(_Part):
    """A temperature that the drive has: never that of the gearbox."""

    place: str = Field(min_length=1)
    object: ObjectKey
    type: Literal["u8", "i8", "u16", "i16", "u32", "i32", "f32"]
    degc_per_count: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] = 1.0
    mappable: bool
    provenance: Provenance = Field(alias="from")
    note: str = ""


class Quirk(_Part):
    """What a technician, or a driver, should know besides."""

    text: str = Field(min_length=1)
    provenance: Provenance = Field(alias="from")


class DriveProfile(_Part):
    """One kind of drive."""

    schema_: Literal["stribeck.drive-profile/1"] = Field(alias="schema")
    title: str = Field(min_length=1)
    modes: Modes
    watchdog: Watchdog
    ramps: Ramps | None = None  # None: both, as CiA 402 has them
    torque: Torque
    position: Position
    velocity: Velocity | None = None
    temperature: list[TemperatureFact] = Field(default=[])
    quirk: list[Quirk] = Field(default=[])


DRIVES = "drivers.profiles.drives"
_SHELF = Shelf(DriveProfile, DRIVES, "drive profile", DriveProfileError)


def parse_profile(text: str, source: str = "the drive profile") -> DriveProfile:
    """Parse and validate a drive profile.

    Raises
    ------
    DriveProfileError
        With every mistake on a line of its own.
    """
    return _SHELF.parse(text, source)


def shipped_profiles() -> tuple[str, ...]:
    """Return the names of the profiles that come with the product."""
    return _SHELF.shipped()


def load_profile(name_or_path: str, folder: Path | None = None) -> DriveProfile:
    """Return a shipped profile by its name, or one from a file (`drivers.described.Shelf.load`).

    Raises
    ------
    DriveProfileError
        Where there is no such profile, or with every mistake in it.
    """
    return _SHELF.load(name_or_path, folder)
