"""A recording's columns as an axis would tell them, and how set-points compare with its own.

Values alone: nothing here reads a file or knows a clock.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.ports import DriveState, Quality, Sample

Values = NDArray[np.float64]

SET_POINT_SLACK_S = 0.05
"""A set-point is the recorded one if it lies between those recorded within this time of it.

In real time no two runs tick alike: each wait for standstill ends up to one tick earlier or later,
and a cycle has half a dozen of them, at ticks of up to 20 ms.
"""

_ROUNDING_RAD_S = 1e-6
_BOOKED = ("doubtful_s", "changed")
"""What is a tuple and no column."""


class Range(NamedTuple):
    """The lowest and the highest of some velocities."""

    low_rad_s: float
    high_rad_s: float


@dataclass(frozen=True)
class Recorded:
    """The columns of one recording, motor side, and how it began.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Strictly increasing, seconds.
    position_rad, velocity_rad_s, torque_nm : ndarray, shape (n,)
        As measured; NaN where they were not.
    gearbox_temperature_degc, gearbox_temperature_age_s : ndarray, shape (n,), optional
        NaN or None where nothing is known.
    gearbox_temperature_quality : tuple of Quality, length n, optional
        None where the drive measured the temperature.
    velocity_command_rad_s : ndarray, shape (n,), optional
        The set-points that it was driven with; None where they were not recorded.
    enabled_from : int
        The first sample that was taken with the drive enabled.
    begins_with_enabling : bool
        Whether the first sample answers the first request for torque; else playing starts with
        the first set-point that asks for motion.
    samples_lost, dropped_by_kernel : int, int or None
        Samples that are known to be missing in it; frames that the kernel dropped then.
    undecided, doubtful, doubtful_s, changed
        As `drivers.evidence.SyncAccount` has them, the intervals in `time_s`.
    identity : mapping
        What `open` says that the axis is.

    Raises
    ------
    ValueError
        Columns of different length, fewer than two samples, or time that does not increase.
    """

    time_s: Values
    position_rad: Values
    velocity_rad_s: Values
    torque_nm: Values
    gearbox_temperature_degc: Values | None = None
    gearbox_temperature_age_s: Values | None = None
    gearbox_temperature_quality: tuple[Quality, ...] | None = None
    velocity_command_rad_s: Values | None = None
    enabled_from: int = 0
    begins_with_enabling: bool = False
    samples_lost: int = 0
    dropped_by_kernel: int | None = None
    undecided: int = 0
    doubtful: int = 0
    doubtful_s: tuple[tuple[float, float], ...] | None = None
    changed: tuple[str, ...] = ()
    identity: Mapping[str, int | str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = len(self.time_s)
        if n < 2 or not np.all(np.diff(self.time_s) > 0.0):
            raise ValueError("time_s must have at least two samples and increase strictly")
        for name, values in vars(self).items():
            if name in _BOOKED:
                continue
            if isinstance(values, np.ndarray | tuple) and len(values) != n:
                raise ValueError(f"{name} has {len(values)} samples, time_s has {n}")

    @property
    def period_s(self) -> float:
        """Return the usual time between two samples."""
        return float(np.median(np.diff(self.time_s)))

    def set_points_near(self, elapsed_s: float) -> Range | None:
        """Return between which set-points it was driven about a time, None where none is known.

        Parameters
        ----------
        elapsed_s : float
            Since the first sample; `SET_POINT_SLACK_S` before and after it are looked at.
        """
        if self.velocity_command_rad_s is None:
            return None
        at_s = float(self.time_s[0]) + elapsed_s
        first, last = np.searchsorted(
            self.time_s, [at_s - SET_POINT_SLACK_S, at_s + SET_POINT_SLACK_S]
        )
        near = self.velocity_command_rad_s[first:last]
        near = near[np.isfinite(near)]
        if not near.size:
            return None
        # Between two samples a curve leaves their chord by |v''| dt^2 / 8 at most, and where v''
        # jumps the second differences show half of it: a tick that falls there meets a peak that
        # the recording's own ticks have stepped over.
        over = float(np.max(np.abs(np.diff(near, 2)), initial=0.0)) / 4.0
        return Range(float(near.min()) - over, float(near.max()) + over)

    def doubts(self, rows: int, origin_s: float) -> tuple[tuple[float, float], ...] | None:
        """Return in which intervals of the first `rows` rows may stand in another's place.

        Parameters
        ----------
        rows : int
            How many have been played.
        origin_s : float
            When the first one was, on the clock that the intervals are to be on.
        """
        if self.doubtful_s is None:
            return None
        first_s = float(self.time_s[0])
        last_s = float(self.time_s[rows - 1]) if rows else -math.inf
        return tuple(
            (origin_s + begin_s - first_s, origin_s + end_s - first_s)
            for begin_s, end_s in self.doubtful_s
            if begin_s <= last_s
        )

    def sample(self, row: int, time_s: float, state: DriveState) -> Sample:
        """Return one row as a sample taken at `time_s`; `received_s` is that time, too."""
        degc, age_s = self.gearbox_temperature_degc, self.gearbox_temperature_age_s
        qualities = self.gearbox_temperature_quality
        quality = Quality.GOOD if qualities is None else qualities[row]
        return Sample(
            time_s=time_s,
            received_s=time_s,
            position_rad=float(self.position_rad[row]),
            velocity_rad_s=float(self.velocity_rad_s[row]),
            torque_nm=float(self.torque_nm[row]),
            gearbox_temperature_degc=math.nan if degc is None else float(degc[row]),
            state=state,
            internal_limit_active=False,
            gearbox_temperature_age_s=math.nan if age_s is None else float(age_s[row]),
            gearbox_temperature_quality=quality,
            gearbox_temperature_reason=""
            if quality is Quality.GOOD
            else f"recorded as '{quality.value}'",
        )


@dataclass(frozen=True)
class Comparison:
    """How the set-points that were sent compare with those that were recorded.

    Parameters
    ----------
    compared, different : int
        Set-points that had recorded ones beside them; that were not among those.
    largest_rad_s : float
        The largest distance from the recorded ones.
    first_s : float
        When the first one differed, in the recording's time; NaN where none did.
    """

    compared: int = 0
    different: int = 0
    largest_rad_s: float = 0.0
    first_s: float = math.nan

    def after(self, velocity_rad_s: float, near: Range, elapsed_s: float) -> Comparison:
        """Return the comparison with one more set-point in it."""
        apart = max(near.low_rad_s - velocity_rad_s, velocity_rad_s - near.high_rad_s, 0.0)
        differs = apart > _ROUNDING_RAD_S
        return Comparison(
            compared=self.compared + 1,
            different=self.different + differs,
            largest_rad_s=max(self.largest_rad_s, apart),
            first_s=elapsed_s if differs and not self.different else self.first_s,
        )
