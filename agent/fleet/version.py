"""What a result was computed with: it is computed again only when that changes."""

from __future__ import annotations

import functools
import hashlib
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from importlib.resources.abc import Traversable

# Every room that an estimate passes through; a change to the page or a driver changes no figure.
_ROOMS = ("conclude", "identify", "physics", "record", "numbers.py", "acquisition.py")
_MONITOR = ("monitor",)
_EXPLAIN = ("explain",)


@functools.cache
def estimate_version() -> str:
    """Return the version of all that an estimate depends on: release, and its sources' hash."""
    return _version(_ROOMS)


@functools.cache
def monitor_version() -> str:
    """Return the version of all that a joint's verdict depends on."""
    return _version(_ROOMS + _MONITOR)


@functools.cache
def explain_version() -> str:
    """Return the version of all that an explanation depends on."""
    return _version(_ROOMS + _EXPLAIN)


def _version(rooms: tuple[str, ...]) -> str:
    try:
        release = version("stribeck")
    except PackageNotFoundError:  # run from a checkout that is not installed
        release = "0"
    digest = hashlib.sha256()
    root = files("agent")
    for name, content in sorted(s for room in rooms for s in _sources(root.joinpath(room), room)):
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return f"{release}-{digest.hexdigest()[:12]}"


def _sources(place: Traversable, name: str) -> list[tuple[str, bytes]]:
    if place.is_file():
        return [(name, place.read_bytes())] if name.endswith(".py") else []
    return [s for child in place.iterdir() for s in _sources(child, f"{name}/{child.name}")]
