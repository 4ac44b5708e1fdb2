"""``NAME.verdict.json``: what was concluded from one recording, and what it takes to do so again.

It names the recording by its content hash and the software by its version, so that anybody can
compute the verdict again and see whether it still stands (`stribeck verify --recompute`). It says
whose joint it is by itself: retention may remove the recording and never the verdict.
"""

from __future__ import annotations

import importlib.metadata
import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from agent.errors import InputError
from agent.record.atomic import publish

SCHEMA = "stribeck.verdict/1"
SUFFIX = ".verdict.json"
ESTIMATE_SUFFIX = ".estimate.json"


def versions() -> dict[str, str]:
    """Return what computes here, with versions: this product, Python, NumPy and SciPy."""
    found = {name: importlib.metadata.version(name) for name in ("stribeck", "numpy", "scipy")}
    return {**found, "python": platform.python_version()}


@dataclass(frozen=True)
class Verdict:
    """What was concluded from one recording.

    Parameters
    ----------
    file, recording_sha256 : str
        The recording: its name, and the content hash that the verdict stands on.
    robot, axis, started_at
        Whose joint, and when it ran.
    made_at : str
        When the verdict was made; a label.
    decidable : bool
        Whether the recording carries an estimate at all.
    alarm : bool
        Whether it is bad news.
    state : str
        ``decidable`` or ``not decidable``; with a baseline ``NF``, ``H0`` or ``H1``.
    sentence : str
        For a person.
    numbers : mapping of str to float
        What was identified, units in the names.
    baseline : tuple of str
        Content hashes of the recordings that it was compared with; none of them is ever removed.
    software : mapping of str to str
        Version of this product and of what computed for it.
    facts : mapping
        What the sentence says, as data (`agent.conclude.facts`): for other languages, and to be
        held against the next verdict. Empty where nothing was compared; older files have none.
    """

    file: str
    recording_sha256: str
    robot: str
    axis: int
    started_at: str
    made_at: str
    decidable: bool
    alarm: bool
    state: str
    sentence: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    baseline: tuple[str, ...] = ()
    software: Mapping[str, str] = field(default_factory=versions)
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def version(self) -> str:
        """Return the version of this product that the verdict was made with."""
        return self.software.get("stribeck", "unknown")

    def dumps(self) -> bytes:
        """Return the document as UTF-8 JSON."""
        document = {"schema": SCHEMA, **asdict(self)}
        return f"{json.dumps(document, ensure_ascii=False, allow_nan=False, indent=2)}\n".encode()


def verdict_path(recording: Path) -> Path:
    """Return where the verdict on a recording stands."""
    return recording.with_suffix(SUFFIX)


def estimate_path(recording: Path) -> Path:
    """Return where the estimate of a recording stands."""
    return recording.with_suffix(ESTIMATE_SUFFIX)


def write_verdict(recording: Path, verdict: Verdict) -> Path:
    """Write the verdict beside its recording, whole or not at all.

    Raises
    ------
    agent.errors.StorageError
        The disk is full or refuses.
    """
    path = verdict_path(recording)
    publish({path: verdict.dumps()}, overwrite=True)
    return path


def read_verdict(path: Path) -> Verdict:
    """Read a verdict.

    Raises
    ------
    agent.errors.InputError
        It cannot be read, is no verdict, or of another schema.
    """
    document = read_json(path)
    if str(document.get("schema", "")).split(".")[:2] != SCHEMA.split(".")[:2]:
        raise InputError(f"{path}: is no verdict that this version reads (expected {SCHEMA}).")
    known = {k: v for k, v in document.items() if k in Verdict.__dataclass_fields__}
    missing = [k for k in Verdict.__dataclass_fields__ if k not in (*known, "facts")]
    if missing:
        raise InputError(f"{path}: the verdict lacks {', '.join(missing)}.")
    kinds = {"axis": int, "decidable": bool, "alarm": bool, "baseline": list}
    kinds |= {"numbers": dict, "software": dict, "facts": dict}
    wrong = [k for k, v in known.items() if not isinstance(v, kinds.get(k, str))]
    if wrong:
        raise InputError(f"{path}: {wrong[0]} is of the wrong kind ({known[wrong[0]]!r:.40}).")
    return Verdict(**{**known, "baseline": tuple(known["baseline"])})


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises
    ------
    agent.errors.InputError
        It cannot be read, or is none.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: cannot be read as JSON ({error}).") from error
    if not isinstance(document, dict):
        raise InputError(f"{path}: is no JSON object.")
    return document
