"""Blows of loose teeth: what rings above the compared band after the gear's load changes sides.

Teeth with clearance part where the torque between them changes sides, cross the gap, and meet with
a blow. The motor then swings against the arm at 30 to 120 Hz, above the band in which torques can
be compared, and its velocity shows it: `louder` says how much more it rings right after an instant
than around it. When the load changes sides depends on the arm's shares of inertia and friction, and
only the right ones find the blows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Ringing
from agent.explain.rows.louder import WINDOW_S
from agent.explain.rows.table import Table
from agent.identify.result import Floats

_SHARES = tuple(float(x) for x in np.geomspace(0.1, 0.98, 13))
_LEVELS = np.linspace(-0.3, 1.3, 17)  # of the dry friction, in one direction of motion
_FRICTION, _OFFSET = (-1e-9, 1.0), 0.35  # the mean of both directions; half of their difference
_FEWEST = 16  # passages, and half as many in either direction
_CLEAR = 4.5  # standard errors: the most of two thousand arms and levels
_BOTH_WAYS = 2.0  # standard errors: what sits at one place is met in one direction
_LOUDER = math.log(2.25)  # of energy: what was no gap reached 2, gaps ring up to ninety times
_WAYS = (1.0, -1.0)
_BEFORE_S, _AFTER_S, _BIN_S = 0.08, 0.16, 0.004  # of the picture
_NORMAL = 1.96


@dataclass(frozen=True)
class Blows:
    """Blows that were heard.

    Parameters
    ----------
    arm_share, friction_share : float
        The arm's shares of the inertia and of the dry friction that tell best when they come.
    offset_nm : float
        What the arm is held against beside its weight, as far as that tells it.
    ringing : Ringing
        About those instants, reversals left out; what jerk makes of it is taken off the factor.
    instants : ndarray, shape (k,)
        The full-rate samples of those instants.
    """

    arm_share: float
    friction_share: float
    offset_nm: float
    ringing: Ringing
    instants: NDArray[np.int64] = field(compare=False, repr=False)


def blows_of(table: Table, theta: Floats, weight_nm: Floats) -> Blows | None:
    """Return the blows of a gear's clearance; None where none are heard.

    Parameters
    ----------
    table : Table
    theta : ndarray, shape (5,)
        The twin's numbers, in the order of `table.BASE`.
    weight_nm : ndarray, shape (N,)
        What the arm is held against at full rate.
    """
    above = table.above_band
    if above is None or table.gear_ratio == 1.0:  # a direct drive has no teeth
        return None
    period_s = min(piece.period_s for piece in table.pieces)
    spacing = round(2.0 * WINDOW_S / period_s)
    dry_nm = max(float(theta[2]), 0.0)
    best, shares, instants = _CLEAR, (0.0, 0.0, 0.0), np.zeros(0, dtype=np.int64)
    ways = [np.flatnonzero(above.judged & (table.full["direction"] * way > 0.0)) for way in _WAYS]
    for share in _SHARES:
        load = share * float(theta[0]) * table.full["acceleration_rad_s2"] + weight_nm
        found = [
            [_instants(way * load[rows] + level * dry_nm, rows, spacing) for level in _LEVELS]
            for way, rows in zip(_WAYS, ways, strict=True)
        ]
        sigmas = np.minimum(
            *(
                _sigmas_of(*(_sums(each, side, above.passage) for each in found))
                for side in above.louder.T
            )
        )
        i, j = (int(x) for x in np.unravel_index(int(np.argmax(sigmas)), sigmas.shape))
        if sigmas[i, j] >= best:
            friction, offset = 0.5 * (_LEVELS[i] + _LEVELS[j]), 0.5 * (_LEVELS[i] - _LEVELS[j])
            best, shares = float(sigmas[i, j]), (share, float(friction), float(offset) * dry_nm)
            instants = np.concatenate((found[0][i], found[1][j]))
    if not instants.size:
        return None
    factor = math.exp(float(above.louder[instants].mean()))
    ringing = _about(above.energy, above.judged, instants, period_s, factor, best)
    return Blows(*shares, ringing, instants)


def _instants(load: Floats, rows: NDArray[np.int64], spacing: int) -> NDArray[np.int64]:
    """Return where the load at some samples changes sides, windows not overlapping."""
    sides = load > 0.0
    found = rows[1:][(sides[1:] != sides[:-1]) & (np.diff(rows) == 1)]
    kept: list[int] = []
    for at in found.tolist():
        if not kept or at - kept[-1] > spacing:
            kept.append(at)
    return np.array(kept, dtype=np.int64)


def _sums(found: Sequence[NDArray[np.int64]], louder: Floats, passage: NDArray[np.int64]) -> Floats:
    """Return number, sum and sum of squares of what is heard at each level's instants, (3, k).

    The mean of every passage counts once.
    """
    out = np.zeros((3, len(found)))
    for k, at in enumerate(found):
        if at.size:
            own = np.unique(passage[at], return_inverse=True)[1].reshape(-1)
            means = np.bincount(own, louder[at]) / np.bincount(own)
            out[:, k] = means.size, means.sum(), means @ means
    return out


def _sigmas_of(forward: Floats, backward: Floats) -> Floats:
    """Return by how many standard errors it rings more, by both directions' levels, (k, k).

    Zero where the arm cannot be like that, and where there is no clear answer: too few instants,
    or more does not ring in both directions of motion.
    """
    mean_level = 0.5 * (_LEVELS[:, np.newaxis] + _LEVELS)
    apart = 0.5 * np.abs(_LEVELS[:, np.newaxis] - _LEVELS)
    count, total, square = forward[:, :, np.newaxis] + backward[:, np.newaxis, :]
    possible = (mean_level >= _FRICTION[0]) & (mean_level <= _FRICTION[1]) & (apart <= _OFFSET)
    possible &= (count >= _FEWEST) & (total >= _LOUDER * count)
    one, other = (way[0] >= _FEWEST // 2 for way in (forward, backward))
    possible &= one[:, np.newaxis] & other
    one, other = (_sigmas(*way) >= _BOTH_WAYS for way in (forward, backward))
    possible &= one[:, np.newaxis] & other
    return np.where(possible, _sigmas(count, total, square), 0.0)


def _sigmas(count: Floats, total: Floats, square: Floats) -> Floats:
    """Return a mean over its standard error, from number, sum and sum of squares."""
    count = np.maximum(count, 2.0)
    variance = np.maximum(square - total**2 / count, 1e-12) / (count - 1.0)
    return np.asarray(total / np.sqrt(count * variance))


def _about(
    energy: Floats,
    judged: NDArray[np.bool_],
    instants: NDArray[np.int64],
    period_s: float,
    louder: float,
    sigmas: float,
) -> Ringing:
    """Return the mean ringing from shortly before some instants until it has died away."""
    per_bin = max(round(_BIN_S / period_s), 1)
    first, bins = -round(_BEFORE_S / period_s), round((_BEFORE_S + _AFTER_S) / _BIN_S)
    offsets = first + np.arange(bins * per_bin)
    at = np.clip(instants[:, np.newaxis] + offsets, 0, energy.shape[0] - 1)
    each = energy[at].reshape(instants.size, bins, per_bin).mean(axis=2)
    mean, error = each.mean(axis=0), each.std(axis=0, ddof=1) / math.sqrt(instants.size)
    return Ringing(
        np.asarray((first + per_bin * (np.arange(bins) + 0.5)) * period_s),
        np.sqrt(mean),
        np.sqrt(np.maximum(mean - _NORMAL * error, 0.0)),
        np.sqrt(mean + _NORMAL * error),
        math.sqrt(float(energy[judged].mean())),
        int(instants.size),
        louder,
        sigmas,
    )
