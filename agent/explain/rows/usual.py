"""The motion that was asked about, and recordings made after it on a far longer stroke.

A longer stroke, driven to decide a tie, goes where the joint never works. There a small pull of a
cable may be the largest torque that a simulation lacks, and it is still no answer to what was
asked: an effect is weighed by what it does where the first recordings were made.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.evidence import Weighing
from agent.explain.rows.table import Table
from agent.identify.result import Floats

_FURTHER = 2.0  # times the longest stroke before


def usual_rows(table: Table, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which rows are of what was asked about, shape (m,).

    All but those of the last recordings that each went twice as far as any before. All of them
    where the position was not recorded, or shorter strokes follow.

    Parameters
    ----------
    table : Table
    rows : ndarray of int, shape (m,)
        Of the table.
    """
    position, run = table.rows["position_rad"][rows], table.run[rows]
    every = np.ones(rows.shape[0], dtype=np.bool_)
    there = np.unique(run)
    if there.size < 2 or not np.isfinite(position).all():
        return every
    began = [table.runs[k].started_s for k in there]
    if np.isfinite(began).all():
        there = there[np.argsort(began, kind="stable")]
    strokes = np.array([float(np.ptp(position[run == k])) for k in there])
    for count in range(1, there.size):
        if strokes[count:].min() > _FURTHER * strokes[:count].max():
            return np.isin(run, there[:count])
    return every


def usual_blocks(table: Table, weighing: Weighing) -> NDArray[np.bool_]:
    """Return which blocks are of what was asked about, shape (b,)."""
    return usual_rows(table, weighing.rows)[weighing.starts]


def as_usual(table: Table, weighing: Weighing, errors: Floats) -> float:
    """Return what blocks' squared errors add up to, were all as where it was asked about.

    Parameters
    ----------
    table : Table
    weighing : Weighing
    errors : ndarray, shape (b,)
    """
    usual = usual_blocks(table, weighing)
    if usual.all():
        return float(errors.sum())
    lengths = np.diff(np.append(weighing.starts, weighing.rows.shape[0]))
    return float(errors[usual].sum()) * float(lengths.sum()) / float(lengths[usual].sum())
