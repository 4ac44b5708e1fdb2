"""CELL.night.toml: when each axis runs by itself, how warm, and who is told of it.

A file of its own beside the cell's: the cell is what a responsible person has checked before
anything moved (docs/decisions/0018), and a quiet window that is shifted by an hour must not touch
it. It holds no secret: those come from the environment or from files that it names.
"""

from __future__ import annotations

import datetime
import os
import re
import zoneinfo
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from agent.cell.devices import Part, Positive
from agent.errors import InputError
from drivers.described import validated
from drivers.errors import why_unreadable

SCHEMA = "stribeck.night/1"
Day = Literal["mon", "tue", "wed", "thu", "fri", "sat", "sun"]
Kind = Literal["run", "alarm", "skip", "stopped", "failed", "wait", "missed"]
DAYS: tuple[Day, ...] = ("mon", "tue", "wed", "thu", "fri", "sat", "sun")
KINDS: tuple[Kind, ...] = ("run", "alarm", "skip", "stopped", "failed", "wait", "missed")
"""What the night may tell; `docs/night.md` says when."""

_BAD_NEWS: tuple[Kind, ...] = ("alarm", "skip", "stopped", "failed", "missed")
_WINDOW = re.compile(r"^([01]\d|2[0-3]):([0-5]\d)-([01]\d|2[0-3]):([0-5]\d)$")
_LONGEST_H = 16.0

Header = Annotated[str, Field(pattern=r"^[^\r\n]+$")]


class AxisNight(Part):
    """One axis's quiet window, and the gearbox temperature at which its cycles are comparable."""

    number: int = Field(ge=1, le=99)
    days: tuple[Day, ...] = Field(default=DAYS, strict=False, min_length=1)
    window: str
    temperature_degc: float | None = Field(default=None, allow_inf_nan=False)
    temperature_tolerance_k: Positive = 2.0

    @property
    def begins(self) -> datetime.time:
        """Return when the window begins, on the clock of the cell's zone."""
        return self._times()[0]

    @property
    def ends(self) -> datetime.time:
        """Return when it ends; on the next day where that is not later than its beginning."""
        return self._times()[1]

    def _times(self) -> tuple[datetime.time, datetime.time]:
        begin, _, end = self.window.partition("-")
        return datetime.time.fromisoformat(begin), datetime.time.fromisoformat(end)

    @model_validator(mode="after")
    def _a_window(self) -> Self:
        if not _WINDOW.match(self.window):
            raise ValueError('window must be "HH:MM-HH:MM", such as "22:00-05:00"')
        minutes = [t.hour * 60 + t.minute for t in self._times()]
        length_h = (minutes[1] - minutes[0]) % (24 * 60) / 60
        if not 0.0 < length_h <= _LONGEST_H:
            raise ValueError(f"a window is longer than nothing and at most {_LONGEST_H:.0f} h")
        return self


class Disk(Part):
    """How much the recordings may take; beyond it no night runs."""

    limit_mb: Positive | None = None


class Told(Part):
    """What somebody is told of, and for how long that is tried.

    `every`: also what is no news (`agent.night.news`), such as the same alarm once more.
    """

    tell: tuple[Kind, ...] = Field(default=_BAD_NEWS, strict=False)
    every: bool = False
    timeout_s: Positive = 10.0
    tries: int = Field(default=3, ge=1, le=10)


class Webhook(Told):
    """An HTTP POST of JSON; with a secret, signed with HMAC-SHA-256."""

    kind: Literal["webhook"]
    url: str = Field(pattern=r"^https?://[^\s]+$")
    secret_env: str = ""
    secret_file: str = ""


class Email(Told):
    """Mail by SMTP; without `starttls = false` nothing is sent over a line that is not encrypted.

    `ca_file` is a certificate to trust besides the system's.
    """

    kind: Literal["email"]
    host: str = Field(min_length=1)
    port: int = Field(default=587, ge=1, le=65535)
    starttls: bool = True
    ca_file: str = ""
    sender: Header
    to: tuple[Header, ...] = Field(strict=False, min_length=1)
    user: str = ""
    password_env: str = ""
    password_file: str = ""


class Mqtt(Told):
    """Sparkplug B over MQTT, publish only."""

    kind: Literal["mqtt"]
    host: str = Field(min_length=1)
    port: int = Field(default=1883, ge=1, le=65535)
    tls: bool = False
    ca_file: str = ""
    group: str = Field(default="stribeck", pattern=r"^[^/+#\s]+$")
    node: str = Field(default="", pattern=r"^[^/+#\s]*$")
    user: str = ""
    password_env: str = ""
    password_file: str = ""
    tell: tuple[Kind, ...] = Field(default=KINDS, strict=False)
    every: bool = True


Sink = Annotated[Webhook | Email | Mqtt, Field(discriminator="kind")]


class NightDescription(Part):
    """Everything that a cell's night needs to know besides the cell."""

    schema_: Literal["stribeck.night/1"] = Field(alias="schema")
    time_zone: str
    axis: tuple[AxisNight, ...] = Field(strict=False, min_length=1)
    disk: Disk = Disk()
    notify: tuple[Sink, ...] = Field(default=(), strict=False)

    @property
    def zone(self) -> zoneinfo.ZoneInfo:
        """Return the zone that the windows are told in."""
        return zoneinfo.ZoneInfo(self.time_zone)

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        try:
            zoneinfo.ZoneInfo(self.time_zone)
        except (zoneinfo.ZoneInfoNotFoundError, ValueError, OSError):
            raise ValueError(
                f"time_zone {self.time_zone!r} is not known (for example Europe/Berlin)"
            ) from None
        numbers = [axis.number for axis in self.axis]
        twice = sorted({n for n in numbers if numbers.count(n) > 1})
        if twice:
            raise ValueError(f"axis {twice[0]} is described more than once")
        return self


def night_path(cell: Path) -> Path:
    """Return where a cell's night is described: cell.toml has cell.night.toml."""
    return cell.with_name(f"{cell.stem}.night.toml")


def read_night(path: Path) -> NightDescription:
    """Read and validate the night's description.

    Raises
    ------
    agent.errors.InputError
        It cannot be read, or with every mistake on a line of its own.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise InputError(
            f"{path} is not there: it says when the axes run by themselves.",
            "`stribeck night example` prints one to begin with.",
        ) from error
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read: {why_unreadable(error)}.") from error
    return validated(NightDescription, text, str(path), InputError, whole="the file")


def secret(what: str, env: str, file: str, folder: Path) -> str:
    """Return a secret from the environment or a file; empty where neither is named.

    Parameters
    ----------
    what : str
        What it is for, for the message; the secret itself is in no message.
    env : str
        Name of an environment variable.
    file : str
        Name of a file, relative to `folder`.
    folder : pathlib.Path
        Of the night's description.

    Raises
    ------
    agent.errors.InputError
        It is named and not there.
    """
    if env:
        value = os.environ.get(env, "")
        if not value:
            raise InputError(f"{what}: the environment variable {env} is not set.")
        return value
    if file:
        try:
            return (folder / file).read_text(encoding="utf-8").strip()
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{what}: {folder / file} cannot be read.") from error
    return ""
