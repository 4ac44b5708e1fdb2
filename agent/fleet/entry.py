"""A recording in the lake, as its path tells it.

::

    recordings/site=S/robot=R/axis=N/month=2026-11/20261121T221742Z-9f86d081884c7d65.parquet

The name ends with the first 16 digits of the content's SHA-256: what is delivered twice has the
same name and is there once, and a file that was changed on its way is known by its name. Site and
robot are percent-encoded, so that any name is one path element. A path sorts its recordings by
joint, then by time.
"""

from __future__ import annotations

import datetime
import hashlib
import re
from dataclasses import dataclass, field
from urllib.parse import quote, unquote

from agent.record.recording import Metadata

RECORDINGS = "recordings"
UNKNOWN = "unknown"
_DIGITS = 16  # of the content hash in a name: 64 bits, no two of a billion files alike
_NAME = re.compile(
    r"recordings/site=(?P<site>[^/]+)/robot=(?P<robot>[^/]+)/axis=(?P<axis>-?\d+)"
    rf"/month=(?P<month>\d{{4}}-\d{{2}}|{UNKNOWN})/(?P<started>[0-9TZ]+|{UNKNOWN})"
    rf"-(?P<digest>[0-9a-f]{{{_DIGITS}}})\.parquet$"
)


@dataclass(frozen=True, order=True, slots=True)
class Entry:
    """One recording in the lake.

    Parameters
    ----------
    site, robot : str
        Whose it is.
    axis : int
    started : str
        ISO 8601 basic form, UTC; ``unknown`` where the recording does not say.
    digest : str
        The first 16 digits of its content's SHA-256.
    path : str
        Below the lake's root: also its name where it is in a pack.
    size_bytes : int
    pack : str
        The pack that holds it; empty where it lies by itself.
    offset : int
        Where in the pack it begins.
    """

    site: str
    robot: str
    axis: int
    started: str
    digest: str
    path: str
    size_bytes: int = field(compare=False)
    pack: str = field(default="", compare=False)
    offset: int = field(default=0, compare=False)

    @property
    def joint(self) -> tuple[str, str, int]:
        """Return whose joint it is: site, robot, axis."""
        return self.site, self.robot, self.axis

    @property
    def month(self) -> str:
        """Return the month that it is of: ``2026-11``, or ``unknown``."""
        return month_of(self.path)


def entry_of(path: str, size_bytes: int, pack: str = "", offset: int = 0) -> Entry | None:
    """Return what a path below the root says, or None where it is not one of a recording."""
    match = _NAME.fullmatch(path)
    if match is None:
        return None
    return Entry(
        site=unquote(match["site"]),
        robot=unquote(match["robot"]),
        axis=int(match["axis"]),
        started=match["started"],
        digest=match["digest"],
        path=path,
        size_bytes=size_bytes,
        pack=pack,
        offset=offset,
    )


def is_recording(path: str) -> bool:
    """Tell whether a path is one of a recording."""
    return _NAME.fullmatch(path) is not None


def month_of(path: str) -> str:
    """Return the month that a recording's path names."""
    return path.rsplit("/", 2)[1].removeprefix("month=")


def joint_of(path: str) -> str:
    """Return what the paths of all recordings of a recording's joint begin with."""
    return path.rsplit("/", 2)[0]


def path_of(site: str, metadata: Metadata, content: bytes) -> str:
    """Return a recording's path below the root."""
    try:
        start = datetime.datetime.fromisoformat(metadata.started_at).astimezone(datetime.UTC)
        month, started = f"{start:%Y-%m}", f"{start:%Y%m%dT%H%M%S}Z"
    except ValueError:
        month = started = UNKNOWN
    joint = f"site={_element(site)}/robot={_element(metadata.robot)}/axis={metadata.axis}"
    return f"{RECORDINGS}/{joint}/month={month}/{started}-{digest_of(content)}.parquet"


def digest_of(content: bytes) -> str:
    """Return the part of a content's SHA-256 that its name ends with."""
    return hashlib.sha256(content).hexdigest()[:_DIGITS]


def _element(name: str) -> str:
    """Return a name as one path element, also where it is `..` or has a slash in it."""
    return quote(name, safe="").replace(".", "%2E") if set(name) <= {"."} else quote(name, safe="")
