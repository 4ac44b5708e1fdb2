"""What a recording says about itself: robot, axis, gear, trajectory, loss. JSON in, JSON out.

Every value is checked when the object is made, so that metadata which could not be written later
is refused before the joint moves, not after.
"""

from __future__ import annotations

import datetime
import json
import sys
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from agent.errors import InputError

SCHEMA = "stribeck.recording/1"
KEY = "stribeck"  # the key in the file's key-value metadata

_NEEDED = ("schema", "robot", "axis", "gear_ratio")


@dataclass(frozen=True)
class Metadata:
    """The metadata of one run of one trajectory on one axis (contract section 2).

    Parameters
    ----------
    robot : str
        Which robot; together with `axis` the identity of the joint.
    axis : int
        Number of the axis.
    gear_ratio : float
        Motor turns per arm turn, at least 1.
    started_at : str
        ISO 8601, UTC; a label. Empty where it is not known.
    trajectory : mapping
        Name and parameters; a bare name that was found in a file becomes ``{"name": ...}``.
    payload_kg : float or None
        Payload at the flange, kilograms.
    ambient_degc : float or None
        Ambient temperature, degrees Celsius.
    drive : str, mapping or None
        Identity of the drive.
    notes : str
        Anything that a reader should know.
    software : str, mapping or None
        What wrote the recording.
    samples_lost : int or None
        Samples known to be missing; None where nobody knows.
    extra : mapping
        Keys that this version does not know, kept and written back.
    schema : str
        ``stribeck.recording/1``, possibly with a minor number behind a point.

    Raises
    ------
    ValueError
        Naming every key whose value cannot be used.
    """

    robot: str
    axis: int
    gear_ratio: float
    started_at: str = ""
    trajectory: Mapping[str, Any] = field(default_factory=dict)
    payload_kg: float | None = None
    ambient_degc: float | None = None
    drive: str | Mapping[str, Any] | None = None
    notes: str = ""
    software: str | Mapping[str, Any] | None = None
    samples_lost: int | None = None
    extra: Mapping[str, Any] = field(default_factory=dict)
    schema: str = SCHEMA

    def __post_init__(self) -> None:
        problems = [
            f"{key} must be {expected}, got {_shown(getattr(self, key))}"
            for key, (accepts, expected) in _RULES.items()
            if not accepts(getattr(self, key))
        ]
        for key in ("trajectory", "drive", "software", "extra"):
            try:
                normal = json.loads(json.dumps(getattr(self, key), allow_nan=False))
            except (TypeError, ValueError) as error:
                problems.append(f"{key} cannot be written as JSON ({error})")
            else:  # a copy of our own, in the form in which it comes back from a file
                object.__setattr__(self, key, normal)
        known = sorted(set(self.extra) & set(_KNOWN))
        if known:
            problems.append(f"extra must not repeat {', '.join(known)}")
        if problems:
            raise ValueError("metadata: " + "; ".join(problems))
        object.__setattr__(self, "axis", int(self.axis))
        object.__setattr__(self, "gear_ratio", float(self.gear_ratio))

    @classmethod
    def from_json(cls, document: object, where: str) -> Metadata:
        """Take the contract's JSON document.

        Parameters
        ----------
        document : object
            What `json.loads` returned.
        where : str
            The file, for messages.

        Raises
        ------
        InputError
            Another major schema, a key missing, a value of the wrong kind: all in one sentence.
        """
        if not isinstance(document, dict):
            raise InputError(
                f"{where}: the metadata must be a JSON object, got {_shown(document)}."
            )
        schema = document.get("schema")
        if schema is not None and not _same_major(schema):
            raise InputError(
                f"{where}: schema {_shown(schema)} is not one that this version reads "
                f"(expected {SCHEMA})."
            )
        missing = [key for key in _NEEDED if document.get(key) is None]
        if missing:
            raise InputError(
                f"{where}: the metadata lacks {', '.join(missing)}.",
                f'schema is "{SCHEMA}"; gear_ratio is motor turns per arm turn; robot and axis '
                "name the joint.",
            )
        known = {k: v for k, v in document.items() if k in _KNOWN and v is not None}
        if isinstance(known.get("trajectory"), str):
            known["trajectory"] = {"name": known["trajectory"]}
        extra = {k: v for k, v in document.items() if k not in _KNOWN}
        try:
            return cls(**known, extra=extra)
        except ValueError as error:
            raise InputError(f"{where}: {error}.") from error

    @classmethod
    def loads(cls, text: bytes | str, where: str) -> Metadata:
        """Parse UTF-8 JSON text; see `from_json`."""
        try:
            if isinstance(text, bytes):
                text = text.decode("utf-8-sig")
            document = json.loads(text, parse_constant=_refuse_constant)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{where}: the metadata is not UTF-8 JSON ({error}).") from error
        return cls.from_json(document, where)

    def to_json(self) -> dict[str, Any]:
        """Return the contract's document; what is not known is left out, what is extra is kept."""
        out: dict[str, Any] = {key: getattr(self, key) for key in _KNOWN}
        out = {k: v for k, v in out.items() if k in _NEEDED or v not in (None, "", {})}
        return {**out, **self.extra}

    def dumps(self, indent: int | None = None) -> bytes:
        """Return the document as UTF-8 JSON."""
        document = self.to_json()
        try:
            return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=indent).encode()
        except UnicodeEncodeError:  # half a surrogate pair, which only an escape can carry
            return json.dumps(document, allow_nan=False, indent=indent).encode()

    def updated(self, changes: Mapping[str, Any]) -> Metadata:
        """Return metadata with some keys, known or not, set anew.

        Raises
        ------
        ValueError
            When a new value cannot be used.
        """
        known = {key: getattr(self, key) for key in _KNOWN}
        known.update({k: v for k, v in changes.items() if k in _KNOWN})
        extra = {**self.extra, **{k: v for k, v in changes.items() if k not in _KNOWN}}
        return Metadata(**known, extra=extra)

    def noted(self, sentence: str) -> Metadata:
        """Return metadata with `sentence` added to the notes."""
        return self.updated({"notes": f"{self.notes} {sentence}".strip()})


_KNOWN = ("schema", *(f.name for f in fields(Metadata) if f.name not in ("extra", "schema")))


def _same_major(schema: object) -> bool:
    """Tell whether `schema` is ours, whatever its minor number."""
    return isinstance(schema, str) and schema.split(".", 2)[:2] == SCHEMA.split(".", 2)[:2]


def _number(value: object) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return abs(value) <= sys.float_info.max  # False for NaN, too


def _whole(value: object) -> bool:
    return isinstance(value, int | float) and _number(value) and value >= 0 and value == int(value)


def _a_name(value: object) -> bool:
    """Return whether a terminal would show a name, and obey nothing in it."""
    if not isinstance(value, str) or not value.strip():
        return False
    return all(unicodedata.category(character) != "Cc" for character in value)


def _iso_8601(value: object) -> bool:
    if not isinstance(value, str):
        return False
    try:
        datetime.datetime.fromisoformat(value or "1970-01-01")
    except ValueError:
        return False
    return True


def _text_or_mapping(value: object) -> bool:
    return value is None or isinstance(value, str | Mapping)


_RULES: dict[str, tuple[Callable[[Any], bool], str]] = {
    "schema": (_same_major, SCHEMA),
    "robot": (_a_name, "a name without control characters"),
    "axis": (_whole, "a whole number"),
    "gear_ratio": (
        lambda v: _number(v) and v >= 1,
        "motor turns per arm turn, a number of at least 1",
    ),
    "started_at": (_iso_8601, "a date and time in ISO 8601"),
    "trajectory": (lambda v: isinstance(v, Mapping), "an object with a name and parameters"),
    "payload_kg": (lambda v: v is None or (_number(v) and v >= 0), "a number of kilograms"),
    "ambient_degc": (lambda v: v is None or _number(v), "a number of degrees Celsius"),
    "drive": (_text_or_mapping, "text or an object"),
    "notes": (lambda v: isinstance(v, str), "text"),
    "software": (_text_or_mapping, "text or an object"),
    "samples_lost": (lambda v: v is None or _whole(v), "a whole number"),
    "extra": (
        lambda v: isinstance(v, Mapping) and all(isinstance(k, str) for k in v),
        "an object",
    ),
}


def _refuse_constant(name: str) -> float:
    """Refuse NaN and Infinity, which Python's parser would let through."""
    raise ValueError(f"{name} is not JSON")


def _shown(value: object) -> str:
    """Return `value` short enough for a sentence."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
