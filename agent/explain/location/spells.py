"""Spells: when a mismatch is there that follows nothing that was recorded."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

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
    found: list[_Spell] = []
    above = whole_s = 0.0
    for piece in table.pieces:
        row_s = piece.period_s * piece.stride
        own, time_s = square[piece.rows], table.rows["time_s"][piece.rows]
        there = np.isfinite(own)
        width = max(_FEWEST, round(_WINDOW_S / row_s))
        if there.sum() < width:
            continue
        energy = np.where(there, own, 0.0)
        above += float(energy.sum()) - floor_nm**2 * float(there.sum())
        whole_s += row_s * float(there.sum())
        name = table.runs[piece.run].name
        for inside in _loud(energy, there, width, floor_nm, independent):
            rows_in = float(there[inside].sum())
            excess = float(energy[inside].sum()) - floor_nm**2 * rows_in
            begins_s, ends_s = float(time_s[inside][0]), float(time_s[inside][-1])
            found.append(_Spell(excess, row_s * rows_in, (name, begins_s, ends_s)))
    if not found or not above > 0.0:
        return None
    share = math.fsum(spell.excess for spell in found) / above
    seconds = math.fsum(spell.lasts_s for spell in found)
    if share < _HOLD or seconds > _MOST * whole_s:
        return None
    found.sort(key=lambda spell: -spell.excess)
    return Spells(tuple(spell.at for spell in found), min(share, 1.0), seconds, whole_s)


class _Spell(NamedTuple):
    """Energy above the noise, how long it lasts, and the recording, begin and end in seconds."""

    excess: float
    lasts_s: float
    at: tuple[str, float, float]


def _loud(
    energy: Floats, there: NDArray[np.bool_], width: int, floor_nm: float, independent: float
) -> Iterator[slice]:
    """Yield the rows of a piece over which windows of some rows have far more than the noise."""
    count = np.convolve(there, np.ones(width), "same")
    mean = np.convolve(energy, np.ones(width), "same") / np.maximum(count, 1.0)
    chance = _SIGMAS * np.sqrt(2.0 / np.maximum(count * independent, 1.0))
    high = there & (mean > floor_nm**2 * np.maximum(_LOUDER, 1.0 + chance))
    flags = _closed(high, width).astype(np.int8)
    ends = np.flatnonzero(np.diff(flags, prepend=0, append=0)).tolist()
    for begin, end in zip(ends[::2], ends[1::2], strict=True):
        yield slice(begin, end)


def _closed(high: NDArray[np.bool_], width: int) -> NDArray[np.bool_]:
    """Return flags with holes closed that are shorter than a window: what is so near is one."""
    near = np.ones(width)
    wider = np.convolve(np.pad(high, width), near, "same") > 0.0
    closed = np.convolve(~wider, near, "same") < 0.5
    return np.asarray(closed[width:-width] | high)
