"""Whether what is left is noise in kind, though more than the noise at held speeds.

The noise floor is measured where a speed is held. Where it changes, an encoder's steps shake the
loop more and torque may be half as noisy again, which is no missing physics. Noise forgets itself
within the filter's memory, and is spread evenly; what physics leaves goes on for tenths of a
second, or comes in spells.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.pieces import Piece
from agent.explain.rows.table import Table
from agent.identify.result import Floats

FEWEST = 1000
"""Rows, and products at a lag, from which on a correlation is known well enough."""

_ALIKE = 0.1  # correlation beyond the filter's memory: so little is none,
_SURELY = 3.5  # or so many standard errors of it: a hundred lags are looked at
_LONGEST_S = 0.6
_SPELL_S = 0.1
_MOST_SPELLS = 50  # one in so many, the loudest,
_IN_SPELLS = 0.14  # may hold so much of the energy; of noise they hold 0.05 to 0.1


def is_noise_in_kind(table: Table, rows: NDArray[np.int64], left_nm: Floats) -> bool:
    """Return whether what is left keeps no memory, and comes in no spells.

    Parameters
    ----------
    table : Table
    rows : ndarray of int, shape (m,)
        Of the table.
    left_nm : ndarray, shape (m,)
        What a model leaves there.
    """
    if rows.shape[0] < FEWEST:
        return False
    left = np.full(table.used.shape[0], np.nan)
    left[rows] = left_nm - float(np.mean(left_nm))
    by_period: dict[float, list[Piece]] = {}
    for piece in table.pieces:
        by_period.setdefault(round(piece.period_s * piece.stride, 6), []).append(piece)
    spells = [_spells(left, pieces, period_s) for period_s, pieces in by_period.items()]
    loudest = np.sort(np.concatenate(spells))[::-1]
    count = max(1, loudest.shape[0] // _MOST_SPELLS)
    if float(loudest[:count].sum()) > _IN_SPELLS * float(loudest.sum()):
        return False
    return all(_keeps_no_memory(left, pieces, period_s) for period_s, pieces in by_period.items())


def _keeps_no_memory(left: Floats, pieces: list[Piece], period_s: float) -> bool:
    first = math.ceil(2.0 / (min(piece.cutoff_hz for piece in pieces) * period_s))
    # Of noise that the filter makes alike over so many rows (Bartlett, J. R. Stat. Soc. Suppl. 8
    # (1946) 27).
    memory = [_correlation(left, pieces, lag)[0] for lag in range(1, first)]
    rows_a_sample = 1.0 + 2.0 * sum(alike**2 for alike in memory)
    for lag in range(first, math.ceil(_LONGEST_S / period_s) + 1):
        alike, count = _correlation(left, pieces, lag)
        if count < FEWEST:
            continue
        if abs(alike) > max(_ALIKE, _SURELY * math.sqrt(rows_a_sample / count)):
            return False
    return True


def _correlation(left: Floats, pieces: list[Piece], lag: int) -> tuple[float, int]:
    """Return how alike rows are that stand so far apart, and of how many products that is."""
    pairs = [(left[p.rows][lag:], left[p.rows][:-lag]) for p in pieces]
    now, before = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    both = np.isfinite(now) & np.isfinite(before)
    now, before = now[both], before[both]
    scale = math.sqrt(float(now @ now) * float(before @ before))
    return (float(now @ before) / scale if scale > 0.0 else 0.0), now.shape[0]


def _spells(left: Floats, pieces: list[Piece], period_s: float) -> Floats:
    """Return the energy of each tenth of a second, shape (s,)."""
    length = max(2, round(_SPELL_S / period_s))
    out = []
    for piece in pieces:
        own = left[piece.rows]
        own = own[np.isfinite(own)]
        whole = own.shape[0] // length * length
        out.append(np.sum(own[:whole].reshape(-1, length) ** 2, axis=1))
    return np.concatenate(out)
