"""A trajectory as JSON, schema `stribeck.trajectory/1`.

::

    {"schema": "stribeck.trajectory/1", "name": "...", "parameters": {...},
     "start_position_rad": 0.0,
     "segments": [{"phase": "ramp", "duration_s": 0.1, "velocity_start_rad_s": 0.0,
                   "velocity_end_rad_s": 5.0, "jerk_time_s": 0.02}, ...]}

Python's JSON writes every float so that it reads back as the same float: the round trip is exact.
A key that is not in the schema is refused, because a misspelt one would change a motion in silence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

from trajectories.checks import ParameterValue, TrajectoryError
from trajectories.segment import Segment

SCHEMA = "stribeck.trajectory/1"
_KEYS = ("schema", "name", "parameters", "start_position_rad", "segments")
_SEGMENT_KEYS = tuple(f.name for f in fields(Segment))


def write(
    name: str,
    parameters: Mapping[str, ParameterValue],
    start_position_rad: float,
    segments: Sequence[Segment],
) -> dict[str, Any]:
    """Return plain dicts, lists, numbers and strings."""
    return {
        "schema": SCHEMA,
        "name": name,
        "parameters": {
            key: list(value) if isinstance(value, tuple) else value
            for key, value in parameters.items()
        },
        "start_position_rad": start_position_rad,
        "segments": [{key: getattr(segment, key) for key in _SEGMENT_KEYS} for segment in segments],
    }


def read(document: object) -> tuple[Any, Any, Any, tuple[Segment, ...]]:
    """Return name, parameters, start position (for the trajectory to check) and segments.

    Raises
    ------
    TrajectoryError
        A key is missing or unknown, or a segment contradicts itself.
    """
    body = _mapping("a trajectory", document)
    if body.get("schema") != SCHEMA:
        raise TrajectoryError(f"expected schema {SCHEMA!r}, got {body.get('schema')!r}")
    _check_keys("a trajectory", body, _KEYS)
    if not isinstance(body["segments"], list):
        raise TrajectoryError(f"segments must be a list, got {body['segments']!r}")
    segments = tuple(_segment(i, entry) for i, entry in enumerate(body["segments"], start=1))
    return body["name"], body["parameters"], body["start_position_rad"], segments


def _segment(number: int, entry: object) -> Segment:
    where = f"segment {number}"
    values = _mapping(where, entry)
    _check_keys(where, values, _SEGMENT_KEYS)
    try:
        return Segment(**values)
    except TrajectoryError as error:
        raise TrajectoryError(f"{where}: {error}") from error


def _mapping(where: str, value: object) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise TrajectoryError(f"{where} must be a JSON object, got {value!r}")
    return value


def _check_keys(where: str, values: Mapping[str, Any], expected: tuple[str, ...]) -> None:
    missing = [key for key in expected if key not in values]
    unknown = [str(key) for key in values if key not in expected]
    if missing:
        raise TrajectoryError(f"{where} lacks {', '.join(missing)}")
    if unknown:
        raise TrajectoryError(
            f"{where} has unknown keys: {', '.join(unknown)} (known: {', '.join(expected)})"
        )
