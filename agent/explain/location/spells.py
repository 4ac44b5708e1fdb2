"""Spells: when a mismatch is there that follows nothing that was recorded."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.located import Spells
from agent.explain.rows.table import Table
from agent.identify.result import Floats

_WINDOW_S = 0.5
_FEWEST = 8  # rows of a window
_SIGMAS = 4.0
_LOUDER = 2.0  # times the noise's energy
_MOST, _HOLD = 0.4, 0.6  # of the time, at most; of the energy above the noise, at least


def spells_of(
    table: Table, rows: NDArray[np.int64], left_nm: Floats, floor_nm: float, independent: float
) -> Spells | None:
    """Return the spells that hold most of what is left; None where it is there all along.

    Parameters
    ----------
    table : Table
    rows : ndarray of int, shape (m,)
        Of the table, that were learnt from.
    left_nm : ndarray, shape (m,)
        What is left there.
    floor_nm : float
        The noise.
    independent : float
        Share of the rows that counts as independent.
    """
    square = np.full(table.used.shape[0], np.nan)
    square[rows] = left_nm**2
    found: list[tuple[float, float, str, float, float]] = []
    above = whole_s = 0.0
    for piece in table.pieces:
        row_s = piece.period_s * piece.stride
        own, time_s = square[piece.rows], table.rows["time_s"][piece.rows]
        there = np.isfinite(own)
        width = max(_FEWEST, round(_WINDOW_S / row_s))
        if there.sum() < width:
            continue
        energy = np.where(there, own, 0.0)
        count = np.convolve(there, np.ones(width), "same")
        mean = np.convolve(energy, np.ones(width), "same") / np.maximum(count, 1.0)
        chance = _SIGMAS * np.sqrt(2.0 / np.maximum(count * independent, 1.0))
        high = there & (mean > floor_nm**2 * np.maximum(_LOUDER, 1.0 + chance))
        above += float(energy.sum()) - floor_nm**2 * float(there.sum())
        whole_s += row_s * float(there.sum())
        high = _closed(high, width)
        ends = np.flatnonzero(np.diff(high.astype(np.int8), prepend=0, append=0))
        name = table.runs[piece.run].name
        for begin, end in zip(ends[::2], ends[1::2], strict=True):
            inside = slice(int(begin), int(end))
            rows_in = float(there[inside].sum())
            excess = float(energy[inside].sum()) - floor_nm**2 * rows_in
            last = float(time_s[inside][-1])
            found.append((excess, row_s * rows_in, name, float(time_s[begin]), last))
    if not found or not above > 0.0:
        return None
    share = math.fsum(excess for excess, *_ in found) / above
    seconds = math.fsum(lasts for _, lasts, *_ in found)
    if share < _HOLD or seconds > _MOST * whole_s:
        return None
    found.sort(key=lambda spell: -spell[0])
    at = tuple((name, begin, end) for _, _, name, begin, end in found)
    return Spells(at, min(share, 1.0), seconds, whole_s)


def _closed(high: NDArray[np.bool_], width: int) -> NDArray[np.bool_]:
    """Return flags with holes closed that are shorter than a window: what is so near is one."""
    near = np.ones(width)
    wider = np.convolve(np.pad(high, width), near, "same") > 0.0
    closed = np.convolve(~wider, near, "same") < 0.5
    return np.asarray(closed[width:-width] | high)
