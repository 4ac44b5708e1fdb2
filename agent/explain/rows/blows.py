"""Blows of loose teeth: what rings above the compared band after the gear's load changes sides.

Teeth with clearance part where the torque between them changes sides, cross the gap, and meet with
a blow. The motor then swings against the arm at 30 to 120 Hz, above the band in which torques can
be compared, and its velocity shows it. What rings shortly after such an instant is compared with
what rang shortly before and what rings when a blow has died away: noise, gear mesh and whatever
else changes slowly is in all three. Jerk rings, too: what instants with as much of it show anywhere
is taken off first. When the load changes sides depends on the arm's shares of inertia and friction,
and only the right ones find the blows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Ringing
from agent.explain.rows.pieces import Piece
from agent.explain.rows.table import Table
from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass
from agent.physics.derivative import slope

_FROM_HZ, _TO_HZ = 30.0, 120.0
_TO_SHARE, _OCTAVES = 0.24, 0.9  # of the sampling rate; a narrower band hears nothing
_DRIVEN_HZ = 30.0  # what is driven shows below, and the greater part of a blow above
_WINDOW_S, _LEAD_S = 0.04, 0.004
_CLEAR_S = 0.08  # of a reversal or an end: friction turns round there, and rings by itself
_SHARES = tuple(float(x) for x in np.geomspace(0.1, 0.98, 13))
_LEVELS = np.linspace(-0.3, 1.3, 17)  # of the dry friction, in one direction of motion
_FRICTION, _OFFSET = (-1e-9, 1.0), 0.35  # the mean of both directions; half of their difference
_FEWEST = 16  # passages, and half as many in either direction
_SAME_PLACE, _SAME_SPEED = 0.01, 0.03  # of the stroke, and of the greatest speed
_CLEAR = 4.5  # standard errors: the most of two thousand arms and levels
_BOTH_WAYS = 2.0  # standard errors: what sits at one place is met in one direction
_LOUDER = 0.4  # of a logarithm of energy: half as much again
_QUIET = 0.3  # of the usual energy: below it nothing is louder or softer
_KNOTS = 8
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
    """

    arm_share: float
    friction_share: float
    offset_nm: float
    ringing: Ringing


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
    heard = [_heard(table, piece) for piece in table.pieces]
    energy, louder, jerkier = (np.concatenate([part[i] for part in heard]) for i in range(3))
    judged = np.concatenate([part[3] for part in heard])
    if np.count_nonzero(judged) < _KNOTS * _FEWEST or np.isnan(table.full["position_rad"]).any():
        return None
    passage = _passages(table)
    of_jerk = [_of_jerk(louder[:, k], jerkier[:, k], judged) for k in range(2)]
    louder = louder - np.stack(of_jerk, axis=-1)
    period_s = min(piece.period_s for piece in table.pieces)
    spacing = round(2.0 * _WINDOW_S / period_s)
    dry_nm = max(float(theta[2]), 0.0)
    best, shares, instants = _CLEAR, (0.0, 0.0, 0.0), np.zeros(0, dtype=np.int64)
    ways = [np.flatnonzero(judged & (table.full["direction"] * way > 0.0)) for way in _WAYS]
    for share in _SHARES:
        load = share * float(theta[0]) * table.full["acceleration_rad_s2"] + weight_nm
        found = [
            [_instants(way * load[rows] + level * dry_nm, rows, spacing) for level in _LEVELS]
            for way, rows in zip(_WAYS, ways, strict=True)
        ]
        sigmas = np.minimum(
            *(_sigmas_of(*(_sums(each, side, passage) for each in found)) for side in louder.T)
        )
        i, j = (int(x) for x in np.unravel_index(int(np.argmax(sigmas)), sigmas.shape))
        if sigmas[i, j] >= best:
            friction, offset = 0.5 * (_LEVELS[i] + _LEVELS[j]), 0.5 * (_LEVELS[i] - _LEVELS[j])
            best, shares = float(sigmas[i, j]), (share, float(friction), float(offset) * dry_nm)
            instants = np.concatenate((found[0][i], found[1][j]))
    if not instants.size:
        return None
    factor = math.exp(float(louder[instants].mean()))
    return Blows(*shares, _about(energy, judged, instants, period_s, factor, best))


def _heard(table: Table, piece: Piece) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Return how strongly it rings, (n,); louder than around, jerk's, (n, 2); what is judged."""
    velocity, period_s = table.full["velocity_raw_rad_s"][piece.full], piece.period_s
    upper = min(_TO_HZ, _TO_SHARE / period_s)
    if upper < _FROM_HZ * 2.0**_OCTAVES or not piece.shows_changes:
        nothing, pair = np.zeros_like(velocity), np.zeros((velocity.shape[0], 2))
        return nothing, pair, pair, nothing > 0.0
    ringing = lowpass(velocity, period_s, upper) - lowpass(velocity, period_s, _FROM_HZ)
    driven = lowpass(velocity, period_s, _DRIVEN_HZ)
    jerk = slope(slope(driven, period_s), period_s)
    window, lead = round(_WINDOW_S / period_s), round(_LEAD_S / period_s)
    judged = _judged(table, piece, window + lead)
    return (
        ringing**2,
        _louder(ringing**2, window, lead, judged),
        _louder(jerk**2, window, 0, judged),
        judged,
    )


def _judged(table: Table, piece: Piece, reach: int) -> NDArray[np.bool_]:
    """Return which samples are away from reversals, standstill, gaps and ends, shape (n,)."""
    full, at = table.full, piece.full
    count = at.stop - at.start
    used = np.repeat(table.used[piece.rows], piece.stride)[:count]
    direction = full["direction"][at]
    bad = ~used | (direction == 0.0) | (full["bridged"][at] > 0.0)
    bad[1:] |= direction[1:] != direction[:-1]
    clear = max(round(_CLEAR_S / piece.period_s), reach)
    many = np.concatenate(([0], np.cumsum(bad)))
    index = np.arange(count)
    near = many[np.minimum(index + clear + 1, count)] - many[np.maximum(index - clear, 0)]
    near[:clear] = near[max(count - clear, 0) :] = 1
    return np.asarray(near == 0)


def _louder(energy: Floats, window: int, lead: int, judged: NDArray[np.bool_]) -> Floats:
    """Return the logarithm of the energy right after each sample over that around it, (n, 2).

    Over the energy right before, and over that two windows later. What rises all the way, as on the
    approach of a reversal, or stays high, as a wave that has come into the band, is no burst.
    """
    total, last = np.concatenate(([0.0], np.cumsum(energy))), energy.shape[0]
    usual = float(np.median(energy[judged])) if judged.any() else 1.0
    quiet = max(_QUIET * window * usual, 1e-300)

    def logarithm(begin: int) -> Floats:
        at = np.clip(np.arange(last) + begin, 0, last)
        within = total[np.minimum(at + window, last)] - total[at]
        return np.asarray(np.log(within + quiet))

    after = logarithm(lead)
    return np.stack((after - logarithm(-window), after - logarithm(lead + 2 * window)), axis=-1)


def _of_jerk(louder: Floats, jerkier: Floats, judged: NDArray[np.bool_]) -> Floats:
    """Return what a change of the jerk alone makes of the ringing, at every sample, shape (n,)."""
    knots = np.unique(np.quantile(jerkier[judged], np.linspace(0.0, 1.0, _KNOTS)))
    hats = np.stack([np.interp(jerkier, knots, row) for row in np.eye(knots.size)], axis=-1)
    numbers = np.linalg.lstsq(hats[judged], louder[judged], rcond=1e-9)[0]
    return np.asarray(hats @ numbers)


def _instants(load: Floats, rows: NDArray[np.int64], spacing: int) -> NDArray[np.int64]:
    """Return where the load at some samples changes sides, windows not overlapping."""
    sides = load > 0.0
    found = rows[1:][(sides[1:] != sides[:-1]) & (np.diff(rows) == 1)]
    kept: list[int] = []
    for at in found.tolist():
        if not kept or at - kept[-1] > spacing:
            kept.append(at)
    return np.array(kept, dtype=np.int64)


def _passages(table: Table) -> NDArray[np.int64]:
    """Return a number of each place passed at each speed, shape (N,): cycles repeat, and noise not.

    What rings alike in every repeat of a cycle is one observation, however often it is driven.
    """
    position, velocity = table.full["position_rad"], table.full["velocity_rad_s"]
    stroke, fastest = float(np.ptp(position)), float(np.max(np.abs(velocity)))
    place = np.round((position - position.min()) / max(_SAME_PLACE * stroke, 1e-12))
    pace = np.round((velocity + fastest) / max(_SAME_SPEED * fastest, 1e-12))
    return np.asarray(place * 1_000_000 + pace, dtype=np.int64)


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
