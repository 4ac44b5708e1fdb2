"""The steady windows of a recording: where the joint passes at constant velocity.

Found from the velocity, in any unit of time or speed. The velocity is averaged over blocks, cut
into levels (`segments`), and every level is trimmed at both ends to where it has settled. Torque
settles later than velocity where the arm is soft: the first tenth of the windows is left out too
where the torque is another one there, as judged by the last tenth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.result import Floats
from agent.identify.signals.preprocess import Motion
from agent.identify.signals.sampling import Stretch
from agent.identify.signals.segments import merge_steady, monotone_chain, partition, trend_of

_BLOCKS = 2500  # per recording: 16 ms blocks in a 40 s stair
_BLOCK_S = 0.06  # at most: a long recording's ramps are as short as a short one's
_MOST_BLOCKS = 50_000  # of which some seconds of a processor are enough, even at standstill
_BLOCK_SAMPLES = 4
_WINDOW_BLOCKS = 6
_WINDOW_SAMPLES = 24
_RELATIVE = 0.03  # of the level: how far a steady velocity may drift over its window
_SLOWEST = 2e-3  # of the fastest: below, the joint is called standing
_SHORTEST = 0.25  # of the typical window
_HEAD = 0.10  # of the window: left out where the torque has not settled in it
_FEWEST_HEADS = 6  # less tells nothing about the heads, and they are left out
_SHIFT = 2.0  # standard errors by which the heads may lean towards where the joint came from
_RATIO = 2.5  # of the heads' variance to the tails': the 98th percentile of chance with 20 windows
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


def find_windows(
    motion: Motion, recording: int = 0, *, with_heads: bool = False, compiled: bool = False
) -> tuple[SteadyWindow, ...]:
    """Return the steady windows of one recording in order of time.

    Parameters
    ----------
    motion : Motion
        The recording's velocity in stretches.
    recording : int
        Number that the windows carry.
    with_heads : bool
        Keep every window's first tenth, for whoever judges by himself whether it has settled.
    compiled : bool
        See `segments.partition`.
    """
    samples = sum(v.shape[0] for v in motion.velocity_rad_s)
    if not samples:
        return ()
    fastest = float(np.quantile(np.abs(np.concatenate(motion.velocity_rad_s)), 0.98))
    longest = max(round(_BLOCK_S * motion.timing.sample_rate_hz), samples // _MOST_BLOCKS)
    per_block = max(_BLOCK_SAMPLES, min(samples // _BLOCKS, longest))
    found: list[_Level] = []
    for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):
        size = min(per_block, max(velocity.shape[0] // (4 * _WINDOW_BLOCKS), 1))
        found += _levels(motion, stretch, velocity, size, fastest, compiled=compiled)
    whole = with_heads or _heads_settled(motion, found)
    kept = found if whole else [level.without_head() for level in found]
    windows = []
    for level in kept:
        first, last = _own_samples(motion, level.stretch, level.start, level.stop)
        windows.append(SteadyWindow(recording, first, last, level.mean_rad_s, level.error_rad_s))
    return _long_enough(windows, motion.signals.time_s)


@dataclass(frozen=True)
class _Level:
    """A steady part of a stretch's grid: the velocity there, and how many samples its head has."""

    stretch: Stretch
    velocity: Floats
    start: int
    stop: int
    head: int
    error_rad_s: float

    @property
    def mean_rad_s(self) -> float:
        return float(np.mean(self.velocity[self.start : self.stop]))

    def without_head(self) -> _Level:
        return replace(self, start=self.start + self.head, head=0)


def _heads_settled(motion: Motion, levels: Sequence[_Level]) -> bool:
    """Tell whether the torque has settled when the velocity has, over all windows together.

    A line through the middle of each window is drawn out to both ends, so that gravity's slope
    along the pass counts for nothing. The tails show how far chance lets an end stray from it; the
    heads may stray no further, and not lean to one side of the speed change before them.
    """
    heads, tails, previous = [], [], 0.0
    stretch, whole = None, np.zeros(0)
    for level in levels:
        came = np.sign(level.mean_rad_s - previous)
        previous = level.mean_rad_s
        if level.stretch is not stretch:  # once a stretch: it may have thousands of levels
            stretch = level.stretch
            whole = stretch.on_grid(motion.signals, motion.signals.torque_nm)
        torque = whole[level.start : level.stop]
        middle = np.arange(level.head, torque.shape[0] - level.head)
        if level.head < 1 or middle.size < 2 * level.head:
            continue
        slope, base = np.polyfit(middle, torque[middle], 1)
        beyond = torque - (base + slope * np.arange(torque.shape[0]))
        heads.append(float(came) * float(np.mean(beyond[: level.head])))
        tails.append(float(np.mean(beyond[-level.head :])))
    if len(heads) < _FEWEST_HEADS:
        return False
    chance = float(np.mean(np.square(tails)))
    lean = abs(float(np.mean(heads))) / np.sqrt(max(chance, 1e-300) / len(heads))
    return bool(lean < _SHIFT and float(np.mean(np.square(heads))) < _RATIO * chance)


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


def _levels(
    motion: Motion,
    stretch: Stretch,
    velocity: Floats,
    size: int,
    fastest: float,
    *,
    compiled: bool,
) -> list[_Level]:
    """Return one stretch's steady levels, each with its head."""
    count = velocity.shape[0] // size
    if count < _WINDOW_BLOCKS or fastest <= 0.0:
        return []
    blocks = velocity[: count * size].reshape(count, size).mean(axis=1)
    noise = float(np.median(np.abs(np.diff(blocks)))) / (0.6745 * np.sqrt(2.0))
    variance = max(noise, _SLOWEST * fastest) ** 2
    penalty = 3.0 * variance * float(np.log(max(count, 3)))
    pieces = partition(blocks, penalty, compiled=compiled)
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
        head = settled[2] * size
        if last - first - head >= _WINDOW_SAMPLES and moves:
            out.append(_Level(stretch, velocity, first, last, head, float(error)))
    return out


def _settled(blocks: Floats, start: int, stop: int) -> tuple[int, int, int] | None:
    """Return the part of a level in which the velocity has settled and its head, or None.

    Level and scatter come from the quieter of the middle half and a later one. What lies outside
    three times the scatter (or 0.4 % of the level) at either end belongs to the ramps, and so do
    the first block after one and the last before one, where a gentle ramp has not yet, or already,
    begun without leaving the tolerance. The head is the next tenth after a ramp.
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
    head = 0
    if first > 0:
        head = max(1, int(np.ceil(_HEAD * (last - first)))) - 1
        first += 1
    if last < blocks.shape[0]:
        last -= 1 if last - first < 2 * _WINDOW_BLOCKS else 2
    if last - first - head < _WINDOW_BLOCKS - 2:
        return None
    if not trend_of(blocks[first + head : last]).is_steady(last - first - head, _RELATIVE):
        return None
    return first, last, head


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
