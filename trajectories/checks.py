"""The one error of this package and the sentences for arguments that cannot be used."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

ParameterValue = float | int | bool | str | tuple[float, ...]


class TrajectoryError(ValueError):
    """A motion that cannot be made, or a file that does not describe one; the message says why."""


def finite(name: str, value: object) -> float:
    """Return `value` as a float, or raise with the name of what it was for.

    Raises
    ------
    TrajectoryError
        It is not a number, or it is NaN or infinite.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TrajectoryError(f"{name} must be a number, got {value!r}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise TrajectoryError(f"{name} must be finite, got {number}")
    return number


def positive(name: str, value: object) -> float:
    """Return `value` as a float above zero, or raise `TrajectoryError`."""
    number = finite(name, value)
    if number <= 0.0:
        raise TrajectoryError(f"{name} must be above zero, got {number:g}")
    return number


def not_negative(name: str, value: object) -> float:
    """Return `value` as a float of zero or more, or raise `TrajectoryError`."""
    number = finite(name, value)
    if number < 0.0:
        raise TrajectoryError(f"{name} must not be negative, got {number:g}")
    return number


def whole(name: str, value: object, least: int) -> int:
    """Return `value` as an int of at least `least`, or raise `TrajectoryError`."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise TrajectoryError(f"{name} must be a whole number of at least {least}, got {value!r}")
    return value


def word(name: str, value: object) -> str:
    """Return `value` as text with something in it, or raise `TrajectoryError`."""
    if not isinstance(value, str) or not value.strip():
        raise TrajectoryError(f"{name} must be a word, got {value!r}")
    return value


def distinct_speeds(name: str, values: object) -> tuple[float, ...]:
    """Return speeds as floats: at least one, all above zero, no two alike."""
    if isinstance(values, str) or not isinstance(values, Sequence):
        raise TrajectoryError(f"{name} must be a sequence of speeds, got {values!r}")
    speeds = tuple(positive(f"{name}[{i}]", v) for i, v in enumerate(values))
    if not speeds:
        raise TrajectoryError(f"{name} must hold at least one speed, got none")
    if len(set(speeds)) != len(speeds):
        raise TrajectoryError(f"{name} must not repeat a speed, got {list(speeds)}")
    return speeds


def frozen_parameters(parameters: object) -> dict[str, ParameterValue]:
    """Return a trajectory's parameters as immutable values: numbers, words, tuples of numbers."""
    if not isinstance(parameters, Mapping):
        raise TrajectoryError(f"parameters must be a mapping, got {parameters!r}")
    out: dict[str, ParameterValue] = {}
    for key, value in parameters.items():
        if not isinstance(key, str):
            raise TrajectoryError(f"a parameter's name must be text, got {key!r}")
        if isinstance(value, (bool, str)):
            out[key] = value
        elif isinstance(value, Sequence):
            out[key] = tuple(finite(f"parameter {key}[{i}]", v) for i, v in enumerate(value))
        elif isinstance(value, int):
            out[key] = value
        else:
            out[key] = finite(f"parameter {key}", value)
    return out
