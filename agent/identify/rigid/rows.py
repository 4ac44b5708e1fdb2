"""The rows of the rigid body's regression: what is filtered and usable, of all recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.preprocess import SPEED_CHANGE, FilteredStretch
from agent.physics.rigid_body import PARAMETERS

_NOISE_SHARE = 0.3  # of the acceleration's root mean square: the inertia is 9 % too low


@dataclass(frozen=True)
class Unfiltered:
    """A stretch's motion before the filter, n samples, and which of them are rows.

    Parameters
    ----------
    velocity_rad_s : ndarray, shape (n,)
    direction : ndarray of int8, shape (n,)
        Its thresholded sign.
    usable : ndarray of bool, shape (n,)
    period_s : float
        Time between samples.
    """

    velocity_rad_s: Floats
    direction: NDArray[np.int8]
    usable: NDArray[np.bool_]
    period_s: float


@dataclass(frozen=True)
class Rows:
    """Filtered, usable samples of all recordings: N rows.

    Parameters
    ----------
    columns : ndarray, shape (N, 6)
        In the order of `PARAMETERS`.
    torque_nm : ndarray, shape (N,)
        Filtered alike.
    time_s : ndarray, shape (N,)
        Time of filtering units, rising without gaps or overlaps over stretches and recordings.
    snap_rad_s4 : ndarray, shape (N,)
        Second derivative of the acceleration column.
    inertia_hidden : str
        Why the inertia is not felt: velocity that hardly changes, noise; empty where it is.
    arm_stroke_rad : float
        How far the arm moved; NaN without a position.
    unfiltered : tuple of Unfiltered
        The motion that the rows were made of, stretch by stretch.
    """

    columns: Floats
    torque_nm: Floats
    time_s: Floats
    snap_rad_s4: Floats
    inertia_hidden: str
    arm_stroke_rad: float
    unfiltered: tuple[Unfiltered, ...] = ()

    @property
    def one_way(self) -> bool:
        """Whether the joint moves in one direction only: a constant torque is friction then."""
        way = self.columns[:, PARAMETERS.index("coulomb_nm")]
        return bool(way.size) and not (way.min() < 0.0 < way.max())

    def some(self, kept: Sequence[int]) -> Floats:
        """Return these columns, shape (N, k); all of them without a copy."""
        return self.columns if len(kept) == self.columns.shape[1] else self.columns[:, kept]


def collect_rows(
    stretches: Sequence[FilteredStretch],
    arm_stroke_rad: float,
    noise_share: float = 0.0,
    inertia_hidden: str = "",
) -> Rows:
    """Put the usable samples of all filtered stretches under each other.

    Parameters
    ----------
    stretches : sequence of FilteredStretch
        Of all recordings.
    arm_stroke_rad : float
        How far the arm moved; NaN without a position.
    noise_share : float
        Measuring noise in the filtered acceleration, as a share of its root mean square.
    inertia_hidden : str
        Why the inertia is not felt, where that is known beforehand.
    """
    columns, torques, times, snaps = [], [], [], []
    clock_s = 0.0
    for s in stretches:
        time_s = s.stretch.time_s - s.stretch.time_s[0] + clock_s
        clock_s = float(time_s[-1]) + s.stretch.period_s
        columns.append(s.regressor[s.usable])
        torques.append(s.torque_nm[s.usable])
        times.append(time_s[s.usable])
        snaps.append(s.snap_rad_s4[s.usable])
    fastest = max((float(np.abs(s.velocity_rad_s).max()) for s in stretches), default=0.0)
    change = max((float(np.ptp(s.velocity_rad_s)) for s in stretches), default=0.0)
    hidden = inertia_hidden
    if change <= SPEED_CHANGE * fastest:
        hidden = "the velocity hardly changes inside any stretch of data"
    elif noise_share > _NOISE_SHARE:
        hidden = "the acceleration is drowned in measuring noise"
    return Rows(
        np.concatenate(columns) if columns else np.zeros((0, len(PARAMETERS))),
        np.concatenate(torques) if torques else np.zeros(0),
        np.concatenate(times) if times else np.zeros(0),
        np.concatenate(snaps) if snaps else np.zeros(0),
        inertia_hidden=hidden,
        arm_stroke_rad=arm_stroke_rad,
        unfiltered=tuple(
            Unfiltered(s.unfiltered_rad_s, s.direction, s.usable, s.stretch.period_s)
            for s in stretches
        ),
    )
