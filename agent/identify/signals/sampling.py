"""When the samples were taken: gaps, irregular time, and stretches that may be filtered.

A stretch is a run of valid samples without a gap. Nothing is ever filtered or differentiated
across a gap. Time that is uneven inside a stretch (jitter of the sampling itself, single lost or
masked samples) is brought onto an even grid, by a cubic through four neighbours, and a note says
so: a straight line between two positions is off by an eighth of what the joint accelerates in one
period, a hundred steps of a servo motor's encoder.

Stamps that vary by little may be the instants of sampling, or those at which a computer got round
to the clock. The motion tells which: a joint moves smoothly in its own time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.physics.reported import at_times

GAP_PERIODS = 4.5  # three samples lost in a row are bridged, four make a gap
_EVEN = 0.1  # standard deviation of the period, in periods: with more, time is uneven
_VARIES = 1e-4  # the same: with less, stamps were rounded and no more
_ASTRAY = 10.0  # periods that a stamp may be off
_SMOOTHER = 0.9  # of the position's fourth differences, rms: so much less decides
_MISSED = 1.5  # periods from one sample to the next: with more, one is missing between them
_AT_ONCE = 1 << 16  # medians: eleven numbers are copied for each
_SHORTEST = 8  # samples; less carries neither a window nor an acceleration


@dataclass(frozen=True)
class Stretch:
    """Valid samples of one recording without a gap between them.

    Parameters
    ----------
    index : ndarray of int, shape (m,)
        Where they stand in the recording.
    time_s : ndarray, shape (n,)
        The even grid that they are brought onto; n = m where time was even already.
    period_s : float
        The grid's period.
    resampled : bool
        Whether values are interpolated onto the grid.
    uneven : bool
        Whether its time varies by more than a tenth of a period, or samples are missing.
    """

    index: NDArray[np.int64]
    time_s: Floats
    period_s: float
    resampled: bool
    uneven: bool

    def on_grid(self, signals: Signals, values: Floats) -> Floats:
        """Return a recording's column, shape (samples,), on this stretch's grid, shape (n,)."""
        own = values[self.index]
        if not self.resampled:
            return own
        return through_neighbours(self.time_s, signals.time_s[self.index], own)

    def off_grid(self, signals: Signals, values: Floats) -> Floats:
        """Return grid values, shape (n,), at this stretch's own samples, shape (m,)."""
        if not self.resampled:
            return values
        return np.interp(signals.time_s[self.index], self.time_s, values)


@dataclass(frozen=True)
class Timing:
    """How a recording was sampled.

    `period_s` is the median period; `jitter_s` the standard deviation of the period against its
    local median, inside stretches.
    """

    period_s: float
    jitter_s: float
    stretches: tuple[Stretch, ...]

    @property
    def sample_rate_hz(self) -> float:
        """Return the reciprocal of the median period."""
        return 1.0 / self.period_s if self.period_s > 0.0 else 0.0


def through_neighbours(at_s: Floats, time_s: Floats, values: Floats) -> Floats:
    """Return values between samples, shape (n,): of the cubic through the four nearest.

    Parameters
    ----------
    at_s : ndarray, shape (n,)
        When they are asked for, within the samples' time.
    time_s, values : ndarray, shape (m,)
        The samples, rising in time; m >= 4. Where a neighbour is not a number, two points' line
        stands.
    """
    out = at_times(time_s, values, at_s)
    unknown = ~np.isfinite(out)
    out[unknown] = np.interp(at_s[unknown], time_s, values)
    return out


def find_stretches(signals: Signals) -> Timing:
    """Cut a recording at its gaps.

    A gap is a time step of more than 4.5 local periods between valid samples; the local period
    is the median over the neighbourhood, because recordings made pass by pass change their rate.
    """
    valid = np.flatnonzero(signals.valid)
    if valid.size < _SHORTEST:
        return Timing(0.0, 0.0, ())
    time_s = signals.time_s[valid]
    step_s = np.diff(time_s)
    if _even_after_all(time_s, signals, valid):
        # A stamp that is late by some periods is no gap.
        even_s = np.linspace(time_s[0], time_s[-1], time_s.size)
        mean_s = float(np.mean(step_s))
        stretch = Stretch(valid, even_s, mean_s, resampled=False, uneven=True)
        return Timing(mean_s, float(np.std(step_s)), (stretch,))
    local_s = _local_median(step_s)
    cuts = np.flatnonzero(step_s > GAP_PERIODS * local_s) + 1
    inside = step_s <= GAP_PERIODS * local_s
    jitter_s = float(np.std(step_s[inside] - local_s[inside])) if inside.any() else 0.0
    stretches = tuple(
        _stretch(piece, signals.time_s[piece], signals.position_rad)
        for piece in np.split(valid, cuts)
        if piece.size >= _SHORTEST
    )
    return Timing(float(np.median(step_s)), jitter_s, stretches)


def _stretch(index: NDArray[np.int64], time_s: Floats, position_rad: Floats | None) -> Stretch:
    """Return the stretch on an even grid of its median period."""
    step_s = np.diff(time_s)
    period_s = float(np.median(step_s))
    mean_s = float((time_s[-1] - time_s[0]) / step_s.size)
    varies = float(np.std(step_s)) / period_s
    uneven = varies > _EVEN or abs(mean_s - period_s) > _EVEN * period_s
    # A few missing samples hardly show in either; taken for even, each would be a jump in time.
    uneven = uneven or float(step_s.max()) > _MISSED * period_s
    resampled = uneven
    if not uneven and position_rad is not None and varies > _VARIES:
        resampled = _smoother_as_stamped(time_s, position_rad[index]) > 1.0 / _SMOOTHER
    if not resampled:
        return Stretch(index, time_s, mean_s, resampled=False, uneven=False)
    count = max(round(float(time_s[-1] - time_s[0]) / period_s), 1) + 1
    grid_s = np.linspace(time_s[0], time_s[-1], count)
    return Stretch(index, grid_s, float(grid_s[1] - grid_s[0]), resampled=True, uneven=uneven)


def _even_after_all(time_s: Floats, signals: Signals, valid: NDArray[np.int64]) -> bool:
    """Return whether stamps, shape (m,), are clearly uneven and the motion as clearly is not.

    Not of a recorder that keeps account of every sample: its stamps are the samples' own.
    """
    if signals.acquisition is not None:
        return False
    step_s = np.diff(time_s)
    mean_s = float(np.mean(step_s))
    astray = np.abs(time_s - np.linspace(time_s[0], time_s[-1], time_s.size)).max()
    varies = float(np.std(step_s)) > _EVEN * mean_s
    # Rows that are missing while the joint rests show in no motion, but make another period.
    if signals.position_rad is None or not varies or astray > _ASTRAY * mean_s:
        return False
    return _smoother_as_stamped(time_s, signals.position_rad[valid]) < _SMOOTHER


def _smoother_as_stamped(time_s: Floats, position_rad: Floats) -> float:
    """Return how many times smoother the motion is at the stamps, shape (m,), than in even time.

    Five neighbours' fourth divided difference is what no cubic in time passes through; weighed to
    unit length it takes an encoder's noise for the same in both. Where rows are missing even time
    is a row of jumps.
    """
    even_s = np.arange(time_s.shape[0], dtype=np.float64)
    stamped, even = (
        float(np.linalg.norm(_off_a_cubic(at, position_rad - position_rad[0])))
        for at in (time_s, even_s)
    )
    return even / stamped if stamped > 0.0 else 1.0


def _off_a_cubic(time_s: Floats, values: Floats) -> Floats:
    """Return by how much every five neighbours are off a cubic in time, shape (m - 4,)."""
    size = time_s.shape[0] - 4
    at = [time_s[k : k + size] for k in range(5)]
    weights = np.stack(
        [1.0 / np.prod([own - other for other in at if other is not own], axis=0) for own in at]
    )
    neighbours = np.stack([values[k : k + size] for k in range(5)])
    return np.asarray(np.sum(weights * neighbours, axis=0) / np.linalg.norm(weights, axis=0))


def _local_median(step_s: Floats, reach: int = 25) -> Floats:
    """Return the running median of the time steps, over `reach` steps to either side.

    Even time is the rule and needs no median: it is recognised first.
    """
    typical_s = float(np.median(step_s))
    if step_s.max() <= 1.5 * typical_s and step_s.min() >= 0.5 * typical_s:
        return np.full_like(step_s, typical_s)
    if step_s.size <= 2 * reach:
        return np.full_like(step_s, typical_s)
    padded = np.pad(step_s, reach, mode="reflect")
    views = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    # Every fifth neighbour is as good a median and five times as fast.
    out = np.empty_like(step_s)
    for first in range(0, out.size, _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        out[part] = np.median(views[part, ::5], axis=1)
    return out
