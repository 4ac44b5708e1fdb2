"""Rows that are weighed, blocks that are left out: what a model predicts of data it has not seen.

Everything is least squares on blocks of time. A model's columns give one Gram matrix for each
block; leaving out a fold is then a subtraction, and its error on the fold needs no row again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.strata import RUNS_FOR_FOLDS
from agent.explain.rows.table import Table
from agent.identify.result import Floats
from agent.identify.uncertainty import correlation_time

_FOLDS = 8


@dataclass(frozen=True)
class Weighing:
    """How rows count, and which are left out together.

    Parameters
    ----------
    rows : ndarray of int, shape (m,)
        The table's rows that are used.
    weight : ndarray, shape (m,)
        One over the standard deviation that the refitted twin leaves in the row's stratum.
    starts : ndarray of int, shape (b,)
        Where each block begins among the rows.
    fold : ndarray of int, shape (b,)
        The fold of every block.
    run : ndarray of int, shape (m,)
    by_run : bool
        Whether folds are whole recordings.
    """

    rows: NDArray[np.int64]
    weight: Floats
    starts: NDArray[np.int64]
    fold: NDArray[np.int64]
    run: NDArray[np.int64]
    by_run: bool

    def weighted(self, values: Floats) -> Floats:
        """Return table rows, shape (n,) or (n, k), as weighted rows, shape (m,) or (m, k)."""
        taken = np.take(values, self.rows, axis=0)  # many times as quick as an index, of columns
        taken *= self.weight if taken.ndim == 1 else self.weight[:, np.newaxis]
        return np.asarray(taken)

    def part(self, blocks: NDArray[np.bool_]) -> tuple[Weighing, NDArray[np.bool_]]:
        """Return the weighing over some blocks, and which rows those are, shape (m,)."""
        lengths = np.diff(np.append(self.starts, self.rows.shape[0]))
        kept = np.repeat(blocks, lengths)
        starts = np.concatenate(([0], np.cumsum(lengths[blocks])[:-1])).astype(np.int64)
        part = Weighing(
            self.rows[kept],
            self.weight[kept],
            starts,
            self.fold[blocks],
            self.run[kept],
            self.by_run,
        )
        return part, kept


def weigh(table: Table, residual_nm: Floats) -> Weighing:
    """Weigh rows by what the refitted twin leaves in their stratum, and share them out in folds.

    Parameters
    ----------
    table : Table
    residual_nm : ndarray, shape (n,)
    """
    rows = np.flatnonzero(table.used)
    stratum, block, run = table.stratum[rows], table.block[rows], table.run[rows]
    weight = np.ones(rows.shape[0])
    for kind in np.unique(stratum):
        inside = stratum == kind
        # The median does not let one bad stretch decide how a whole stratum counts; without noise
        # one that is exact would count alone.
        scale = float(np.median(np.abs(residual_nm[rows][inside]))) / 0.6745
        weight[inside] = 1.0 / max(scale, table.exact_nm, 1e-12)
    starts = np.flatnonzero(np.diff(block, prepend=block[0] - 1)) if rows.size else rows
    run_of_block = run[starts]
    by_run = np.unique(run_of_block).size >= RUNS_FOR_FOLDS
    if by_run:
        fold = np.unique(run_of_block, return_inverse=True)[1] % _FOLDS
    else:
        by_step = table.step_folds(rows[starts], _FOLDS)
        fold = np.arange(starts.shape[0]) % _FOLDS if by_step is None else by_step
    return Weighing(rows, weight, starts, fold.astype(np.int64), run, by_run)


@dataclass(frozen=True)
class Moments:
    """Gram matrices of one model by block: b blocks, p columns."""

    gram: Floats
    moment: Floats
    square: Floats

    @property
    def total(self) -> tuple[Floats, Floats]:
        """Return the sums over all blocks."""
        return self.gram.sum(axis=0), self.moment.sum(axis=0)


def moments(columns: Floats, target: Floats, starts: NDArray[np.int64]) -> Moments:
    """Return the Gram matrices of weighted columns (m, p) and target (m,), block by block."""
    stops = np.append(starts[1:], target.shape[0])
    joined = np.concatenate((columns, target[:, np.newaxis]), axis=1)
    grams = np.stack([joined[a:b].T @ joined[a:b] for a, b in zip(starts, stops, strict=True)])
    return Moments(grams[:, :-1, :-1], grams[:, :-1, -1], grams[:, -1, -1])


def solve(gram: Floats, moment: Floats) -> Floats:
    """Return the least-squares solution of normal equations, columns scaled to unit length."""
    size = np.sqrt(np.maximum(np.diag(gram), 0.0))
    size = np.where(size > 0.0, size, 1.0)
    scaled = gram / np.outer(size, size)
    # A thousandth of a millionth of ridge: columns that are the same share one coefficient.
    scaled.flat[:: scaled.shape[0] + 1] += 1e-9
    return np.asarray(np.linalg.solve(scaled, moment / size) / size)


def heldout(part: Moments, fold: NDArray[np.int64]) -> Floats:
    """Return the squared error of every block under the fit to the other folds, shape (b,)."""
    gram, moment = part.total
    out = np.empty(part.square.shape[0])
    for k in np.unique(fold):
        inside = fold == k
        theta = solve(
            gram - part.gram[inside].sum(axis=0), moment - part.moment[inside].sum(axis=0)
        )
        out[inside] = (
            part.square[inside]
            - 2.0 * part.moment[inside] @ theta
            + np.einsum("i,bij,j->b", theta, part.gram[inside], theta)
        )
    return out


def unseen(columns: Floats, target: Floats, weighing: Weighing) -> Floats:
    """Return what every row keeps under the fit to the other folds, weighted, shape (m,).

    Parameters
    ----------
    columns : ndarray, shape (m, p)
        Weighted, of a model.
    target : ndarray, shape (m,)
        Weighted.
    weighing : Weighing
    """
    if not columns.shape[1]:
        return target
    part = moments(columns, target, weighing.starts)
    gram, moment = part.total
    lengths = np.diff(np.append(weighing.starts, target.shape[0]))
    out = np.empty(target.shape[0])
    for k in np.unique(weighing.fold):
        inside = weighing.fold == k
        theta = solve(
            gram - part.gram[inside].sum(axis=0), moment - part.moment[inside].sum(axis=0)
        )
        rows = np.repeat(inside, lengths)
        out[rows] = target[rows] - columns[rows] @ theta
    return out


def effective_size(table: Table, weighing: Weighing, residual: Floats) -> float:
    """Return how many independent samples the rows are worth, from the residual's correlation."""
    series = []
    at = np.full(table.used.shape[0], np.nan)
    at[weighing.rows] = residual
    for piece in table.pieces:
        values = at[piece.rows]
        good = np.flatnonzero(np.isfinite(values))
        if good.size:
            series += [
                values[part]
                for part in np.split(good, np.flatnonzero(np.diff(good) > 1) + 1)
                if part.size > 8
            ]
    return residual.shape[0] / correlation_time(series) if series else float(residual.shape[0])
