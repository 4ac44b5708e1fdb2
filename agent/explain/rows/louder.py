"""What rings above the compared band, and how much more right after each instant than around it.

What rings shortly after an instant is compared with what rang shortly before and what rings when a
blow has died away: noise, gear mesh and whatever else changes slowly is in all three. Jerk rings,
too: what instants with as much of it show anywhere is taken off first. All of this is the motion's
alone: no number of the twin's is in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.pieces import Piece
from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass
from agent.physics.derivative import slope

if TYPE_CHECKING:
    from agent.explain.rows.table import Table

WINDOW_S = 0.04
"""In which ringing is summed, s."""

_LEAD_S = 0.004
_FROM_HZ, _TO_HZ = 30.0, 120.0
_TO_SHARE, _OCTAVES = 0.24, 0.9  # of the sampling rate; a narrower band hears nothing
_DRIVEN_HZ = 30.0  # what is driven shows below, and the greater part of a blow above
_CLEAR_S = 0.08  # of a reversal or an end: friction turns round there, and rings by itself
_FEWEST = 16  # samples for each knot of what jerk makes of it
_SAME_PLACE, _SAME_SPEED = 0.01, 0.03  # of the stroke, and of the greatest speed
_QUIET = 0.3  # of the usual energy: below it nothing is louder or softer
_KNOTS = 8


@dataclass(frozen=True)
class AboveBand:
    """What rings above the band, at full rate.

    Parameters
    ----------
    energy : ndarray, shape (N,)
        Of the velocity's swing, (rad/s)^2.
    louder : ndarray, shape (N, 2)
        Logarithm of the energy right after each sample over that right before, and over that two
        windows later; less what its jerk makes of it.
    judged : ndarray of bool, shape (N,)
        Away from reversals, standstill, gaps and ends.
    passage : ndarray of int, shape (N,)
        The same number wherever a place is passed at the same speed: cycles repeat, and noise not.
    """

    energy: Floats
    louder: Floats
    judged: NDArray[np.bool_]
    passage: NDArray[np.int64]


def above_band(table: Table) -> AboveBand | None:
    """Return what rings above a table's band; None where too little of it can be judged."""
    heard = [_heard(table, piece) for piece in table.pieces]
    energy, louder, jerkier = (np.concatenate([part[i] for part in heard]) for i in range(3))
    judged = np.concatenate([part[3] for part in heard])
    if np.count_nonzero(judged) < _KNOTS * _FEWEST or np.isnan(table.full["position_rad"]).any():
        return None
    of_jerk = [_of_jerk(louder[:, k], jerkier[:, k], judged) for k in range(2)]
    return AboveBand(energy, louder - np.stack(of_jerk, axis=-1), judged, _passages(table))


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
    window, lead = round(WINDOW_S / period_s), round(_LEAD_S / period_s)
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


def _passages(table: Table) -> NDArray[np.int64]:
    """Return a number of each place passed at each speed, shape (N,).

    What rings alike in every repeat of a cycle is one observation, however often it is driven.
    """
    position, velocity = table.full["position_rad"], table.full["velocity_rad_s"]
    stroke, fastest = float(np.ptp(position)), float(np.max(np.abs(velocity)))
    place = np.round((position - position.min()) / max(_SAME_PLACE * stroke, 1e-12))
    pace = np.round((velocity + fastest) / max(_SAME_SPEED * fastest, 1e-12))
    return np.asarray(place * 1_000_000 + pace, dtype=np.int64)
