"""Several recordings as one history: which temperature was when, on the clock of `started_at`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import numpy as np

from agent.conclude.outcome import signals_of
from agent.errors import InputError
from agent.identify.result import Floats
from agent.record.recording import Recording
from trajectories import lasting

SENSORS = ("gearbox_temperature_degc", "motor_temperature_degc")
AMBIENT = "ambient_temperature_degc"
_SET_CLOCK = datetime(2000, 1, 1, tzinfo=UTC)  # a clock that shows less was never set


@dataclass(frozen=True)
class History:
    """Temperature over time.

    Parameters
    ----------
    sensor : str
        The column that the temperature is from.
    starts_s : tuple of float or None
        When each recording started, counted from the first; None where they cannot be ordered.
    time_s, temperature_degc : ndarray, shape (n,)
        Of all recordings; empty where they cannot be ordered.
    ambient_degc : ndarray, shape (n,), optional
    reason : str
        Why they cannot be ordered; empty otherwise.
    """

    sensor: str
    starts_s: tuple[float, ...] | None
    time_s: Floats
    temperature_degc: Floats
    ambient_degc: Floats | None
    reason: str = ""


def history_of(recordings: Sequence[Recording]) -> History:
    """Put the recordings' temperatures on one axis of time.

    Raises
    ------
    agent.errors.InputError
        None has a temperature, or two overlap in time: one joint cannot run two cycles at once.
    """
    sensor = next((s for s in SENSORS if any(s in r for r in recordings)), None)
    if sensor is None:
        raise InputError(
            "None of the recordings has a temperature.",
            f"Record the column {SENSORS[0]} (oil or housing).",
        )
    starts = [_started(r) for r in recordings]
    known = [s for s in starts if s is not None]
    if len(recordings) == 1:
        known = [0.0]
    elif len(known) < len(recordings):
        nameless = [r for r, s in zip(recordings, starts, strict=True) if s is None]
        reason = (
            f"not identified: {_named(nameless)} of {len(recordings)} recordings do not say when "
            "they started (started_at), so that they cannot be joined to one curve; take one "
            "recording by itself"
        )
        return History(sensor, None, np.empty(0), np.empty(0), None, reason)
    first = min(known)
    offsets = tuple(s - first for s in known)
    _refuse_overlap(recordings, offsets)
    return _joined(recordings, offsets, sensor)


def temperatures_of(recordings: Sequence[Recording], sensor: str) -> list[Floats | None]:
    """Return each recording's temperature on the samples that the estimators see."""
    out: list[Floats | None] = []
    for recording in recordings:
        if sensor not in recording:
            out.append(None)
            continue
        at = np.asarray(recording["time_s"], dtype=np.float64)
        values = np.asarray(recording[sensor], dtype=np.float64)
        kept = np.isfinite(values)
        seen = signals_of(recording).time_s
        out.append(np.interp(seen, at[kept], values[kept]) if kept.any() else None)
    return out


def _started(recording: Recording) -> float | None:
    """Return when a recording started, in seconds, where a clock that was set says so."""
    text = recording.metadata.started_at
    if not text:
        return None
    try:
        start = datetime.fromisoformat(text)
    except ValueError:
        return None
    start = start if start.tzinfo is not None else start.replace(tzinfo=UTC)
    return start.timestamp() if start >= _SET_CLOCK else None


def _named(recordings: Sequence[Recording]) -> str:
    names = [Path(r.source).name for r in recordings]
    rest = f" and {len(names) - 2} more" if len(names) > 2 else ""
    return f"{len(names)} ({', '.join(names[:2])}{rest})"


def _refuse_overlap(recordings: Sequence[Recording], offsets_s: Sequence[float]) -> None:
    order = sorted(range(len(recordings)), key=lambda i: offsets_s[i])
    for earlier, later in pairwise(order):
        ends = offsets_s[earlier] + float(np.nanmax(recordings[earlier]["time_s"]))
        if ends > offsets_s[later]:
            names = " and ".join(Path(recordings[i].source).name for i in (earlier, later))
            raise InputError(
                f"{names} overlap in time by {lasting(ends - offsets_s[later])}: one joint cannot "
                "run two cycles at once.",
                "One is a copy of the other, or a clock was set back: leave one out, or correct "
                "started_at.",
            )


def _joined(recordings: Sequence[Recording], offsets_s: tuple[float, ...], sensor: str) -> History:
    pieces = sorted(
        ((start, r) for start, r in zip(offsets_s, recordings, strict=True) if sensor in r),
        key=lambda piece: piece[0],
    )

    def column(name: str) -> Floats:
        return np.concatenate([np.asarray(r[name], dtype=np.float64) for _, r in pieces])

    time = np.concatenate([s + np.asarray(r["time_s"], dtype=np.float64) for s, r in pieces])
    temperature = column(sensor)
    ambient = column(AMBIENT) if all(AMBIENT in r for _, r in pieces) else None
    kept = np.flatnonzero(np.isfinite(temperature) & np.isfinite(time))
    # A recording may start at the very moment that the one before it ended.
    kept = kept[np.diff(time[kept], prepend=-np.inf) > 0.0]
    air = None if ambient is None else ambient[kept]
    return History(sensor, offsets_s, time[kept], temperature[kept], air)
