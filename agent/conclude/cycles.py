"""Recordings as cycles: each is estimated once, and what came out is kept by its content.

The cache holds one small JSON file a recording, named by the SHA-256 of the recording's bytes (and
of its side file) and of the code that estimates: another recording or another version has another
name, so nothing in it can be out of date. It may be deleted at any time. It lies in the folder that
STRIBECK_CACHE names, else where the system keeps caches.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib import resources
from pathlib import Path

import numpy as np

from agent.conclude.outcome import signals_of
from agent.errors import InputError, StorageError
from agent.identify.estimate import estimate
from agent.identify.result import Estimate
from agent.monitor.history.cycle import Cycle, cycle_of
from agent.record.atomic import publish
from agent.record.reading import read, side_file
from agent.record.recording import Recording

SENSOR = "gearbox_temperature_degc"
_PACKAGES = ("agent.identify", "agent.physics", "agent.monitor", "agent.record", "agent.conclude")
_CODE_OF = {"agent.monitor": ("cycle.py",), "agent.conclude": ("outcome.py", "cycles.py")}


@dataclass(frozen=True)
class Unreadable:
    """A file that is no recording, and why."""

    name: str
    reason: str


def nothing_usable(unreadable: Sequence[Unreadable]) -> InputError:
    """Return what is to be said where no file of a history is a recording."""
    more = f" (and {len(unreadable) - 1} more like it)" if len(unreadable) > 1 else ""
    return InputError(f"{unreadable[0].reason}{more}", "Nothing of this history can be used.")


def cycles_of(
    paths: Sequence[Path],
    folder: Path | None,
    moved: Callable[[str, float], None] = lambda _what, _share: None,
) -> tuple[tuple[Cycle, ...], tuple[Unreadable, ...]]:
    """Return the cycle of every recording, and the files that are none.

    Parameters
    ----------
    paths : sequence of Path
        Recordings.
    folder : Path or None
        The cache; None for none.
    moved : callable
        Told what is being done and the share that is done, while there is something to estimate;
        and in the end, if there was.
    """
    cycles, bad, told = [], [], []

    def about_to(i: int) -> None:
        told.append(i)
        moved(_of(i, paths), i / len(paths))

    for i, path in enumerate(paths):
        try:
            cycles.append(_cycle(path, folder, partial(about_to, i)))
        except InputError as error:
            bad.append(Unreadable(path.name, str(error)))
    if told:
        moved(_of(told[-1], paths), 1.0)
    return tuple(cycles), tuple(bad)


def _of(i: int, paths: Sequence[Path]) -> str:
    return f"cycle {i + 1} of {len(paths)}"


def cycle_from(recording: Recording, estimated: Estimate | None = None) -> Cycle:
    """Return the cycle that one recording is; it is estimated by itself unless it was already."""
    columns, time_s = recording.columns, np.asarray(recording["time_s"], dtype=np.float64)
    degc = np.asarray(columns[SENSOR], dtype=np.float64) if SENSOR in columns else np.zeros(0)
    degc = degc[np.isfinite(degc)]
    return cycle_of(
        estimate([signals_of(recording)]) if estimated is None else estimated,
        recording.metadata.to_json(),
        name=Path(recording.source).name,
        duration_s=float(np.nanmax(time_s) - np.nanmin(time_s)),
        temperature_degc=float(degc.mean()) if degc.size else float("nan"),
        fingerprint=fingerprint_of(recording),
    )


def fingerprint_of(recording: Recording) -> str:
    """Return what two recordings of the same samples have in common, whatever they are called."""
    digest = hashlib.sha256()
    for name in ("time_s", "torque_nm"):
        digest.update(np.ascontiguousarray(recording[name], dtype=np.float64).tobytes())
    return digest.hexdigest()


def cache_folder() -> Path:
    """Return where the cache lies."""
    own = os.environ.get("STRIBECK_CACHE")
    if own:
        return Path(own)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", str(Path.home()))) / "stribeck" / "cache"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "stribeck"


def _cycle(path: Path, folder: Path | None, about_to: Callable[[], None]) -> Cycle:
    """Take the cycle from the cache, or estimate it and leave it there."""
    kept = None if folder is None else folder / f"cycle-{_key(path)}.json"
    if kept is not None:
        # What is not there, or not to be read, is estimated.
        with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
            found = Cycle.from_json(json.loads(kept.read_text(encoding="utf-8")))
            return replace(found, name=path.name)
    recording = read(path)
    about_to()  # what cannot be read is refused without a bar before it
    cycle = cycle_from(recording)
    if kept is not None:
        # A cache that cannot be written costs time, and nothing else.
        with contextlib.suppress(OSError, StorageError):
            kept.parent.mkdir(parents=True, exist_ok=True)
            publish({kept: json.dumps(cycle.to_json()).encode()}, overwrite=True)
    return cycle


def _key(path: Path) -> str:
    """Return the hash of a recording's bytes and of the code that estimates it."""
    digest = hashlib.sha256(_code().encode())
    for part in (path, side_file(path)):
        with contextlib.suppress(OSError):  # most have no side file; `read` refuses what has to be
            digest.update(part.read_bytes())
        digest.update(b"\0")
    return digest.hexdigest()


@cache
def _code() -> str:
    """Return the hash of the code that makes a cycle of a recording."""
    digest = hashlib.sha256()
    for package in _PACKAGES:
        files = sorted(_sources(package), key=lambda found: found[0])
        for name, text in files:
            digest.update(f"{package}/{name}\0".encode() + text)
    return digest.hexdigest()


def _sources(package: str) -> list[tuple[str, bytes]]:
    """Return name and content of a package's modules that count, subpackages included."""
    out = []
    folders = [("", resources.files(package))]
    while folders:
        prefix, folder = folders.pop()
        for entry in folder.iterdir():
            if entry.is_dir() and entry.name != "__pycache__":
                folders.append((f"{prefix}{entry.name}/", entry))
            elif entry.name.endswith(".py") and entry.name in _CODE_OF.get(package, (entry.name,)):
                out.append((prefix + entry.name, entry.read_bytes()))
    return out
