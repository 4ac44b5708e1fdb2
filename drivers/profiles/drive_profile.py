"""Drive profiles as TOML: what a kind of drive can and lacks, read whole or refused whole.

Every value is a fact with its provenance: R read in a vendor's or project's file, P read on a page,
M measured, U common knowledge that nobody has confirmed. A cell names a profile; what the cell says
itself wins. Shipped profiles are in `drivers/profiles/drives`.
"""

from __future__ import annotations

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

T = TypeVar("T")

DRIVES = "drivers.profiles.drives"
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
    torque: Torque
    position: Position
    velocity: Velocity | None = None
    temperature: list[TemperatureFact] = Field(default=[])
    quirk: list[Quirk] = Field(default=[])


def parse_profile(text: str, source: str = "the drive profile") -> DriveProfile:
    """Parse and validate a drive profile.

    Raises
    ------
    DriveProfileError
        With every mistake on a line of its own.
    """
    try:
        return DriveProfile.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise DriveProfileError(f"{source} is not TOML: {error}.") from error
    except ValidationError as error:
        mistakes = [_mistake(e) for e in error.errors()]
        head = f"{source} has {len(mistakes)} mistake{'s' if len(mistakes) > 1 else ''}:"
        raise DriveProfileError("\n  - ".join([head, *mistakes])) from error


def shipped_profiles() -> tuple[str, ...]:
    """Return the names of the profiles that come with the product."""
    names = (entry.name for entry in files(DRIVES).iterdir())
    return tuple(sorted(n.removesuffix(".toml") for n in names if n.endswith(".toml")))


def load_profile(name_or_path: str, folder: Path | None = None) -> DriveProfile:
    """Return a shipped profile by its name, or one from a file.

    Parameters
    ----------
    name_or_path : str
        A name of `shipped_profiles`, or the path of a TOML file.
    folder : pathlib.Path, optional
        What a relative path is relative to.

    Raises
    ------
    DriveProfileError
        Where there is no such profile, or with every mistake in it.
    """
    if name_or_path in shipped_profiles():
        entry = files(DRIVES).joinpath(f"{name_or_path}.toml")
        return parse_profile(entry.read_text("utf-8"), f"the shipped profile {name_or_path}")
    path = Path(name_or_path) if folder is None else folder / name_or_path
    try:
        return parse_profile(path.read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise DriveProfileError(
            f"The drive profile {path} cannot be read: {error}. Shipped profiles: "
            f"{', '.join(shipped_profiles())}."
        ) from error


def _mistake(error: Any) -> str:
    """Return one of pydantic's errors as a line that names the key as TOML has it."""
    where = ""
    for part in error["loc"]:
        where += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if where else str(part)
    if error["type"] == "extra_forbidden":
        return f"{where}: unknown key"
    if error["type"] == "missing":
        return f"{where}: is missing"
    given = error.get("input")
    shown = "" if isinstance(given, dict | list | tuple) else f" (given: {given!r})"
    return f"{where}: {error['msg']}{shown}"
