"""The steady windows of a recording: where the joint passes at constant velocity.

Found from the velocity alone, in any unit of time or speed. The velocity is averaged over blocks,
cut into levels (`segments`), and every level is trimmed at both ends to where it has settled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.preprocess import Motion
from agent.identify.result import Floats
from agent.identify.sampling import Stretch
from agent.identify.segments import merge_steady, monotone_chain, partition, trend_of

_BLOCKS = 2500  # per recording: 16 ms blocks in a 40 s stair
_BLOCK_SAMPLES = 4
_WINDOW_BLOCKS = 6
_WINDOW_SAMPLES = 24
_RELATIVE = 0.03  # of the level: how far a steady velocity may drift over its window
_SLOWEST = 2e-3  # of the fastest: below, the joint is called standing
_SHORTEST = 0.25  # of the typical window
_SETTLE = 0.10  # of the window: left out after the velocity has come within its tolerance
_SETTLED_TO = 0.004  # of the level: a loop that settles from further off still accelerates


@dataclass(frozen=True)
class SteadyWindow:
    """Samples `start` to `stop` (exclusive) of a recording, passed at one steady velocity.

    Parameters
    ----------
    recording : int
        Which of the recordings.
    start, stop : int
        Index range into the recording's own arrays; masked samples inside it are not used.
    velocity_rad_s : float
        The window's mean velocity, motor side.
    velocity_error_rad_s : float
        Its standard error.
    """

    recording: int
    start: int
    stop: int
    velocity_rad_s: float
    velocity_error_rad_s: float = 0.0


def find_windows(motion: Motion, recording: int = 0) -> tuple[SteadyWindow, ...]:
    """Return the steady windows of one recording in order of time.

    Parameters
    ----------
    motion : Motion
        The recording's velocity in stretches.
    recording : int
        Number that the windows carry.
    """
    samples = sum(v.shape[0] for v in motion.velocity_rad_s)
    if not samples:
        return ()
    fastest = float(np.quantile(np.abs(np.concatenate(motion.velocity_rad_s)), 0.98))
    per_block = max(_BLOCK_SAMPLES, samples // _BLOCKS)
    windows: list[SteadyWindow] = []
    for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):
        size = min(per_block, max(velocity.shape[0] // (4 * _WINDOW_BLOCKS), 1))
        for start, stop, level, error in _steady_pieces(motion, velocity, size, fastest):
            first, last = _own_samples(motion, stretch, start, stop)
            windows.append(SteadyWindow(recording, first, last, level, error))
    return _long_enough(windows, motion.signals.time_s)


def _long_enough(windows: Sequence[SteadyWindow], time_s: Floats) -> tuple[SteadyWindow, ...]:
    """Leave out what is far shorter, in time and in distance, than a window of this recording is.

    Where a loop swings through the top of an overshoot, or creeps into standstill, its velocity
    stands still for a moment. A fast pass may be short in time, a slow one in distance.
    """
    if not windows:
        return ()
    duration_s = np.array([time_s[w.stop - 1] - time_s[w.start] for w in windows])
    distance_rad = duration_s * np.abs([w.velocity_rad_s for w in windows])
    kept = (duration_s >= _SHORTEST * _typical(duration_s)) | (
        distance_rad >= _SHORTEST * _typical(distance_rad)
    )
    return tuple(w for w, long in zip(windows, kept, strict=True) if long)


def _typical(lengths: Floats) -> float:
    """Return the length that half of the sum is in windows of at least."""
    rising = np.sort(lengths)
    return float(rising[np.searchsorted(np.cumsum(rising), 0.5 * rising.sum())])


def _steady_pieces(
    motion: Motion, velocity: Floats, size: int, fastest: float
) -> list[tuple[int, int, float, float]]:
    """Return grid ranges, mean velocities and their errors of one stretch's steady windows."""
    count = velocity.shape[0] // size
    if count < _WINDOW_BLOCKS or fastest <= 0.0:
        return []
    blocks = velocity[: count * size].reshape(count, size).mean(axis=1)
    noise = float(np.median(np.abs(np.diff(blocks)))) / (0.6745 * np.sqrt(2.0))
    variance = max(noise, _SLOWEST * fastest) ** 2
    pieces = partition(blocks, 3.0 * variance * float(np.log(max(count, 3))))
    pieces = merge_steady(blocks, pieces, _RELATIVE)
    chain = monotone_chain(
        np.array([blocks[a:b].mean() for a, b in pieces]),
        0.0 if motion.velocity_derived else _resolution(velocity, fastest),
    )
    out = []
    for (start, stop), on_ramp in zip(pieces, chain, strict=True):
        if on_ramp:
            continue
        settled = _settled(blocks, start, stop)
        if settled is None:
            continue
        first, last = settled[0] * size, settled[1] * size
        if stop == count and settled[1] == count:
            last = velocity.shape[0]  # the last samples that fill no block of their own
        level = float(np.mean(velocity[first:last]))
        inside = blocks[settled[0] : settled[1]]
        # A third of the blocks counts as independent: stick-slip and ripple are coloured.
        error = float(np.std(inside)) / np.sqrt(max(inside.shape[0] / 3.0, 1.0))
        moves = abs(level) > max(_SLOWEST * fastest, 4.0 * error)
        if last - first >= _WINDOW_SAMPLES and moves:
            out.append((first, last, level, float(error)))
    return out


def _settled(blocks: Floats, start: int, stop: int) -> tuple[int, int] | None:
    """Return the part of a level in which the velocity has settled, or None.

    Level and scatter come from the quieter of the middle half and a later one. What lies outside
    three times the scatter (or 0.4 % of the level) at either end belongs to the ramps. After a
    ramp, another tenth of the window is left out, so that the torque has settled too; before one,
    the last blocks, where a gentle ramp has begun without leaving the tolerance.
    """
    length = stop - start
    if length < _WINDOW_BLOCKS:
        return None
    parts = [blocks[start + length * a // 8 : stop - length * b // 8] for a, b in ((2, 2), (3, 1))]
    quiet = min(parts, key=lambda part: float(np.std(part)))
    level = float(np.mean(quiet))
    tolerance = max(_SETTLED_TO * abs(level), 3.0 * float(np.std(quiet)))
    inside = np.flatnonzero(np.abs(blocks[start:stop] - level) <= tolerance)
    if not inside.size:
        return None
    first, last = start + int(inside[0]), start + int(inside[-1]) + 1
    if first > 0:
        first += max(1, int(np.ceil(_SETTLE * (last - first))))
    if last < blocks.shape[0]:
        last -= 1 if last - first < 2 * _WINDOW_BLOCKS else 2
    if last - first < _WINDOW_BLOCKS - 2:
        return None
    if not trend_of(blocks[first:last]).is_steady(last - first, _RELATIVE):
        return None
    return first, last


def _resolution(velocity: Floats, fastest: float) -> float:
    """Return the step of a coarsely quantised velocity, 0 where it is fine."""
    values = np.unique(velocity)
    if values.shape[0] < 2:
        return 0.0
    step = float(np.min(np.diff(values)))
    return step if step > 1.5 * _SLOWEST * fastest else 0.0


def _own_samples(motion: Motion, stretch: Stretch, start: int, stop: int) -> tuple[int, int]:
    """Return the recording's index range that a stretch's grid range covers."""
    if not stretch.resampled:
        return int(stretch.index[start]), int(stretch.index[stop - 1]) + 1
    time_s = motion.signals.time_s[stretch.index]
    first = int(np.searchsorted(time_s, stretch.time_s[start], side="left"))
    last = int(np.searchsorted(time_s, stretch.time_s[stop - 1], side="right"))
    return int(stretch.index[first]), int(stretch.index[max(last, first + 1) - 1]) + 1
