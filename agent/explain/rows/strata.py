"""Steady, accelerating, edge: which rows are compared, and in which blocks they are left out.

Standstill, where friction is indeterminate, and the filter's own ends are left out; so are edges,
the first travel after a start or a reversal, widened by the filter's memory of their misfit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.pieces import Piece, banded, thinned
from agent.identify.result import Floats

STEADY, ACCELERATING, EDGE = 0, 1, 2
END_PERIODS = 1.5
"""Of the cutoff's period: so far a stretch's end reaches into the filter."""

RUNS_FOR_FOLDS = 4
"""So many recordings are left out whole; of fewer, velocity steps."""

EDGE_ARM_RAD = 2e-4
"""Travel of the arm after a start or a reversal that is an edge."""

STANDING_S = 0.1
"""A reversal crosses zero faster; longer is standstill."""

_BLOCK_S = 2.0
_MOST_BLOCKS = 240
_AT_ONE_SPEED = 0.5  # of the speed below which it may rest; a turn goes through twice that speed
_SLIDES = 10.0  # times an edge's travel: by then contacts of most joints have slipped
_UNKNOWN_SHARE = 0.05
_MEMORY = 1.0  # of the cutoff's period: so far an edge's misfit reaches through the filter
_STEADY_SHARE = 0.03  # of the 99 % acceleration


def travel_rad(full: Mapping[str, Floats], pieces: Sequence[Piece]) -> Floats:
    """Return the motor's travel since it last started or turned round, rad, shape (N,).

    What was under way before its stretch began has the longest travel of all: that start is past.
    """
    return _since_start(full, pieces, lambda at: np.abs(full["velocity_rad_s"][at]))


def since_s(full: Mapping[str, Floats], pieces: Sequence[Piece]) -> Floats:
    """Return the time since the motor last started or turned round, shape (N,); as `travel_rad`."""
    return _since_start(full, pieces, lambda at: np.ones(at.stop - at.start))


def _since_start(
    full: Mapping[str, Floats], pieces: Sequence[Piece], rate: Callable[[slice], Floats]
) -> Floats:
    """Return the integral of a rate, slice to (n,), since the last start or reversal, (N,)."""
    out, longest = np.zeros(full["time_s"].shape[0]), 0.0
    for piece in pieces:
        sign = full["direction"][piece.full]
        way = np.cumsum(rate(piece.full)) * piece.period_s
        known = sign != 0.0
        last = sign[known]
        start = np.zeros(sign.shape[0], dtype=np.bool_)
        start[np.flatnonzero(known)] = np.diff(last, prepend=0.0) != 0.0
        start |= known & ~np.concatenate(([False], known[:-1]))
        anchor = np.maximum.accumulate(np.where(start, np.arange(sign.shape[0]), 0))
        # Until the first start or reversal that was recorded.
        begun = (start & (np.arange(start.shape[0]) > 0)).cumsum() > 0
        out[piece.full] = np.where(begun | (sign == 0.0), way - way[anchor], np.inf)
        longest = max(longest, float(way[-1]))
    return np.minimum(out, longest)


def after_a_turn(rows: Mapping[str, Floats], pieces: Sequence[Piece]) -> NDArray[np.bool_]:
    """Return which rows are nearer to the last start or reversal than to the next one, shape (n,).

    A filter that knows no direction puts part of what happens after a turn before it. Until the
    first turn that was recorded no row is after one; after the last one all are.
    """
    since, time = rows["since_s"], rows["time_s"]
    out = np.zeros(since.shape[0], dtype=np.bool_)
    for piece in pieces:
        at = np.arange(piece.rows.start, piece.rows.stop)
        turns = at[1:][np.diff(since[at]) < 0.0]
        following = np.searchsorted(turns, at, side="right")
        ahead = np.append(time[turns], np.inf)[following] - time[at]
        out[at] = (following > 0) & (since[at] <= ahead)
    return out


def strata_of(
    full: Mapping[str, Floats],
    pieces: Sequence[Piece],
    acceleration_rad_s2: Floats,
    gear_ratio: float,
    creep_rad_s: float = 0.0,
    late_s: float = 0.0,
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Return which rows are used, and steady, accelerating or edge for each, shape (n,).

    Parameters
    ----------
    full : mapping of str to ndarray, shape (N,)
        Motion at full rate.
    pieces : sequence of Piece
    acceleration_rad_s2 : ndarray, shape (n,)
        At the rows.
    gear_ratio : float
    creep_rad_s : float
        Slower is an edge, too.
    late_s : float
        By how much the torque is later than the motion: so much later it starts and turns round.
    """
    standing = np.zeros(full["time_s"].shape[0])
    edge, apart = np.zeros_like(standing), np.zeros_like(standing)
    reach = EDGE_ARM_RAD * gear_ratio
    travel = travel_rad(full, pieces)
    ends = np.zeros(acceleration_rad_s2.shape[0], dtype=np.bool_)
    for piece in pieces:
        memory = round(_MEMORY / (piece.cutoff_hz * piece.period_s))
        sign = full["direction"][piece.full]
        standing[piece.full] = np.maximum(
            lasting(sign == 0.0, STANDING_S / piece.period_s), _resting(full, piece, reach)
        )
        near = (sign == 0.0) | (travel[piece.full] < reach)
        near |= np.abs(full["velocity_rad_s"][piece.full]) < creep_rad_s
        near |= _later(near, round(late_s / piece.period_s))
        edge[piece.full] = _widened(near, memory)
        apart[piece.full] = _widened(full["bridged"][piece.full] > 0.0, memory)
        if piece.slow:
            # Speed changes between its samples: only what lies well inside a pass is known.
            edge[piece.full] = _widened(full["held_rad_s"][piece.full] == 0.0, memory)
        end = math.ceil(END_PERIODS / (piece.cutoff_hz * piece.period_s * piece.stride))
        ends[piece.rows.start : piece.rows.start + end] = True
        ends[max(piece.rows.stop - end, piece.rows.start) : piece.rows.stop] = True
    edges = thinned(edge, pieces) > 0.5
    bridged = thinned(apart, pieces) > 0.5
    used = (banded(standing, pieces) < _UNKNOWN_SHARE) & ~(edges | ends | bridged)
    size = np.abs(acceleration_rad_s2)
    for piece in pieces:
        if not piece.shows_changes:
            size[piece.rows] = 0.0  # unrest of a pass is no acceleration that was driven
    hard = float(np.quantile(size[used], 0.99)) if used.any() else 0.0
    stratum = np.where(size > _STEADY_SHARE * hard, ACCELERATING, STEADY)
    stratum = np.where(edges, EDGE, stratum)
    return np.asarray(used), stratum.astype(np.int64)


def _resting(full: Mapping[str, Floats], piece: Piece, reach_rad: float) -> Floats:
    """Return 1 where a joint rests between two moves though its velocity is not nothing, (n,).

    It creeps at one speed, so slowly that in the time of a standstill it gets no farther than
    friction yields; and a pass would slide. Friction is then what the rest needs. A joint that
    turns round slowly goes through these speeds evenly.
    """
    slow_rad_s = reach_rad / STANDING_S
    speed = np.abs(full["velocity_rad_s"][piece.full])
    held = full["held_rad_s"][piece.full] != 0.0
    change = np.abs(full["acceleration_rad_s2"][piece.full]) * piece.period_s
    out = lasting(speed < slow_rad_s, STANDING_S / piece.period_s)
    edges = np.flatnonzero(np.diff(out, prepend=0.0, append=0.0))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        turns = (end - begin) * float(np.median(change[begin:end])) > _AT_ONE_SPEED * slow_rad_s
        passed_rad = float(np.sum(speed[begin:end])) * piece.period_s
        slides = held[begin:end].any() and passed_rad > _SLIDES * reach_rad
        if turns or slides:
            out[begin:end] = 0.0
    return out


def _later(flag: NDArray[np.bool_], samples: int) -> NDArray[np.bool_]:
    """Return a flag so many samples later, shape (n,); earlier below zero."""
    at = np.arange(flag.shape[0]) - samples
    return np.asarray(flag[np.clip(at, 0, flag.shape[0] - 1)])


def _widened(flag: NDArray[np.bool_], samples: int) -> Floats:
    """Return 1 where a flag holds within so many samples, shape (n,)."""
    count = np.cumsum(np.concatenate(([0], flag.astype(np.int64))))
    at = np.arange(flag.shape[0])
    low = np.maximum(at - samples, 0)
    high = np.minimum(at + samples + 1, flag.shape[0])
    return (count[high] > count[low]).astype(np.float64)


def lasting(flag: NDArray[np.bool_], samples: float) -> Floats:
    """Return 1 where a flag holds for at least so many samples in a row, shape (n,)."""
    edges = np.flatnonzero(np.diff(flag.astype(np.int8), prepend=0, append=0))
    out = np.zeros(flag.shape[0])
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        if end - begin >= samples:
            out[begin:end] = 1.0
    return out


def blocks_of(pieces: Sequence[Piece], time_s: Floats, step: Floats) -> NDArray[np.int64]:
    """Return the number of the block of time of every row, rising over the table.

    Two seconds or more, and within one velocity step where few recordings are left out by steps.
    """
    by_step = len({piece.run for piece in pieces}) < RUNS_FOR_FOLDS
    total_s = sum(float(np.ptp(time_s[p.rows])) for p in pieces)
    length_s = max(_BLOCK_S, total_s / _MOST_BLOCKS)
    out = np.empty(time_s.shape[0], dtype=np.int64)
    first = 0
    for piece in pieces:
        changes = np.flatnonzero(np.diff(step[piece.rows])) + 1 if by_step else ()
        for rows in np.split(np.arange(piece.rows.start, piece.rows.stop), changes):
            time = time_s[rows] - time_s[rows[0]]
            count = max(1, round(float(time[-1]) / length_s))
            number = time / max(float(time[-1]), 1e-12) * count
            out[rows] = first + np.minimum(number.astype(np.int64), count - 1)
            first += count
    return out
