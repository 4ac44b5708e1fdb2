"""Whether columns are a recording at all: what is needed, in which unit, in which order."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import numpy as np

from agent.errors import InputError
from agent.record.recording import (
    FLOAT_COLUMNS,
    MINIMUM_SAMPLES,
    MOTION_COLUMNS,
    NEEDED_COLUMNS,
    Column,
)

_LOOKS_LIKE: Mapping[str, re.Pattern[str]] = {
    name: re.compile(pattern, re.IGNORECASE)
    for name, pattern in {
        "time_s": r"(^|_)(time|t|timestamp|stamp|seconds|millis|micros)(_|$)|^time",
        "torque_nm": r"torque|moment|effort|current|(^|_)(tau|iq|trq|mnm|ncm)(_|$)",
        "position_rad": r"position|angle|(^|_)(pos|q|theta|phi|deg|counts|revs?|turns)(_|$)",
        "velocity_rad_s": r"velocity|speed|omega|(^|_)(vel|rpm|rps|qd|dps)(_|$)",
    }.items()
}
_HOTTEST_DEGC = 200.0  # windings end at 180; a room has 290 K
_COLDEST_DEGC = -100.0  # what transmitters send for a sensor that is not there: -200, -273, -3276.8
_NOT_MEASURED = re.compile(
    r"command|target|setpoint|demand|simulated|(^|_)arm(_|$)|temperature|limit"
)


def check(columns: Mapping[str, Column], where: str) -> None:
    """Refuse columns that no estimate could stand on.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        Contract columns are float64 already.
    where : str
        The file, for messages.

    Raises
    ------
    InputError
        A needed column missing (and which one looks like it in another unit), fewer than 100
        samples, time that does not increase, a temperature in kelvin: one sentence, with the row
        where there is one.
    """
    check_names(columns, where)
    count = len(columns["time_s"])
    if count < MINIMUM_SAMPLES:
        raise InputError(
            f"{where}: holds {_samples(count)}, but at least {MINIMUM_SAMPLES} are needed."
        )
    _check_time(columns["time_s"], where)
    for name in FLOAT_COLUMNS:
        if name.endswith("_degc") and name in columns:
            _check_celsius(columns[name], name, where)


def check_names(names: Iterable[str], where: str) -> None:
    """Refuse a set of column names in which a needed one is missing; see `check`."""
    names = list(names)
    for needed in NEEDED_COLUMNS:
        if needed not in names:
            raise _missing((needed,), names, where)
    if not set(MOTION_COLUMNS) & set(names):
        raise _missing(MOTION_COLUMNS, names, where)


def _missing(wanted: tuple[str, ...], names: list[str], where: str) -> InputError:
    """Return the refusal of a file that lacks all of `wanted`, pointing at look-alikes."""
    what = " or ".join(f"{name} ({FLOAT_COLUMNS[name]})" for name in wanted)
    alike = [
        (found, name)
        for name in wanted
        for found in names
        if found not in FLOAT_COLUMNS
        and _LOOKS_LIKE[name].search(found)
        and not _NOT_MEASURED.search(found)
    ]
    if alike:
        found, name = alike[0]
        return InputError(
            f"{where}: needs column {what}; {found} looks like {name} in another unit or under "
            f"another name.",
            f"Convert it to {FLOAT_COLUMNS[name]} and name it {name}.",
        )
    shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return InputError(f"{where}: needs column {what}; the file has {shown or 'no columns'}.")


def _check_time(time_s: Column, where: str) -> None:
    """Refuse time that stands still or runs backwards; samples without a time are masked later."""
    rows = np.flatnonzero(np.isfinite(time_s))
    if len(rows) < MINIMUM_SAMPLES:
        raise InputError(
            f"{where}: column time_s is a finite number in {len(rows)} of {len(time_s)} rows, but "
            f"at least {MINIMUM_SAMPLES} are needed."
        )
    steps = np.diff(time_s[rows])
    wrong = np.flatnonzero(steps <= 0.0)
    if len(wrong):
        first = int(wrong[0])
        more = f" ({len(wrong) - 1} more such rows)" if len(wrong) > 1 else ""
        raise InputError(
            f"{where}: column time_s must increase, but row {rows[first + 1] + 1} holds "
            f"{time_s[rows[first + 1]]:.9g} after {time_s[rows[first]]:.9g}{more}."
        )


def _check_celsius(degc: Column, name: str, where: str) -> None:
    """Refuse a temperature that no joint survives: it is in kelvin, or nobody measured it."""
    known = degc[np.isfinite(degc)]
    usual = float(np.median(known)) if known.size else 0.0
    if usual > _HOTTEST_DEGC:
        dead = "" if np.ptp(known) else ", or, as it never changes, like a sensor that is not there"
        raise InputError(
            f"{where}: column {name} is {usual:.4g} in the median, which no joint bears as degrees "
            f"Celsius; it looks like kelvin{dead}.",
            "Take 273.15 off, or leave the column out.",
        )
    if usual < _COLDEST_DEGC:
        raise InputError(
            f"{where}: column {name} is {usual:.4g} in the median, which no joint bears as degrees "
            "Celsius; it looks like a sensor that is not there.",
            "Leave the column out.",
        )


def _samples(count: int) -> str:
    return {0: "no samples", 1: "1 sample"}.get(count, f"{count} samples")
