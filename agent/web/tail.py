"""A recording read while it grows: whole batches as they come, thinned to what a screen shows."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from agent.record.formats.plain_arrow import ForeignStreamError, columns_of, next_message, rows_of

POINT_PERIOD_S = 0.05
"""A screen gets twenty points a second."""

NUMBERS = (
    "velocity_rad_s",
    "velocity_command_rad_s",
    "torque_nm",
    "position_rad",
    "gearbox_temperature_degc",
)
Rows = Mapping[str, Sequence[Any]]
_MOST_BYTES = 4 << 20  # of one look: whatever has come together meanwhile is read in turns


class Point(NamedTuple):
    """Twenty of these a second; motor side, NaN where a channel is not measured.

    The time is the middle of its 50 ms, torque their mean, the rest their last sample.
    """

    time_s: float
    velocity_rad_s: float
    velocity_command_rad_s: float
    torque_nm: float
    position_rad: float
    gearbox_temperature_degc: float
    phase: str


class StreamTail:
    """Reads what a recorder adds to its stream; never writes, never locks, never waits.

    Parameters
    ----------
    path : pathlib.Path
        ``NAME.arrows``. It stays readable through this object when its writer has removed it.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0))
        self._offset = 0
        self._columns: tuple[tuple[str, int], ...] = ()

    def read(self) -> Iterator[Rows]:
        """Yield the rows of every whole batch that has come since the last call, by column."""
        os.lseek(self._descriptor, self._offset, os.SEEK_SET)
        content = memoryview(os.read(self._descriptor, _MOST_BYTES))
        at = 0
        while True:
            try:
                message = next_message(content, at)
                if message is None:
                    return  # not whole yet, or the mark of the end
                if self._columns:
                    yield rows_of(message, self._columns)
                else:
                    self._columns = columns_of(message)
            except ForeignStreamError:
                return  # whoever finishes the recording says what is wrong with it
            self._offset += message.ended - at
            at = message.ended

    def close(self) -> None:
        """Let go of the file."""
        os.close(self._descriptor)


@dataclass
class _Bin:
    """Samples of the same 50 ms."""

    number: int
    torque_sum_nm: float = 0.0
    samples: int = 0


class Thinner:
    """Makes twenty points a second of rows at any rate."""

    def __init__(self) -> None:
        self._bin = _Bin(-1)
        self._last: Point | None = None

    def points(self, rows: Rows) -> list[Point]:
        """Return the points that more rows complete."""
        count = len(rows["time_s"])
        missing: Sequence[Any] = [math.nan] * count
        columns = [rows["time_s"], *(rows.get(name, missing) for name in NUMBERS)]
        phases = rows.get("phase", [""] * count)
        out: list[Point] = []
        for row in zip(*columns, phases, strict=True):
            point = Point(*row)
            number = math.floor(point.time_s / POINT_PERIOD_S)
            if number != self._bin.number:
                if self._last is not None:
                    out.append(self._finished(self._last))
                self._bin = _Bin(number)
            if math.isfinite(point.torque_nm):
                self._bin.torque_sum_nm += point.torque_nm
                self._bin.samples += 1
            self._last = point
        return out

    def _finished(self, last: Point) -> Point:
        samples = self._bin.samples
        mean_nm = self._bin.torque_sum_nm / samples if samples else math.nan
        middle_s = (self._bin.number + 0.5) * POINT_PERIOD_S
        return last._replace(time_s=middle_s, torque_nm=mean_nm)
