"""Least squares on blocks of rows: the shared arithmetic of weighted and instrumental fits.

With instruments Z in the place of one of the two regressors, ``theta = (Z' W F)^-1 Z' W y``
(Soderstrom and Stoica, System Identification, 1989, section 8.1); with Z = F it is weighted least
squares. The covariance leaves out blocks of time one by one, as in `uncertainty.block_jackknife`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.uncertainty import student_975


@dataclass(frozen=True)
class LinearFit:
    """Parameters of a linear regression of n rows and p columns.

    Parameters
    ----------
    theta : ndarray, shape (p,)
    covariance : ndarray, shape (p, p)
        From leaving out blocks; no model of the noise is behind it.
    dof : float
        Degrees of freedom of the covariance.
    residual : ndarray, shape (n,)
        Target less prediction.
    condition_number : float
        Ratio of the largest to the smallest singular value of the regressor, thesis (4.11).
    """

    theta: Floats
    covariance: Floats
    dof: float
    residual: Floats
    condition_number: float

    @property
    def standard_deviation(self) -> Floats:
        """Return the parameters' standard deviations, shape (p,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def ci95(self) -> Floats:
        """Return the parameters' 95 % intervals, shape (p, 2)."""
        reach = student_975(self.dof) * self.standard_deviation
        return np.stack((self.theta - reach, self.theta + reach), axis=-1)


def time_blocks(time_s: Floats, count: int) -> NDArray[np.int64]:
    """Return the block of every row, shape (n,): about `count` of equal length, rising from 0.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Rising.
    count : int
        Blocks asked for; those that hold no row leave no number behind.
    """
    span = float(time_s[-1] - time_s[0])
    if span <= 0.0:
        return np.zeros(time_s.shape[0], dtype=np.int64)
    number = np.floor((time_s - time_s[0]) / span * count * (1.0 - 1e-12)).astype(np.int64)
    return np.cumsum(np.diff(number, prepend=number[0]) > 0).astype(np.int64)


def condition_number(columns: Floats) -> float:
    """Return the ratio of the regressor's extreme singular values, thesis (4.11)."""
    if columns.shape[0] < columns.shape[1] or not columns.size:
        return float("inf")
    singular = np.linalg.svd(columns, compute_uv=False)
    return float(singular[0] / singular[-1]) if singular[-1] > 0.0 else float("inf")


def solve_blocks(
    columns: Floats, instruments: Floats, target: Floats, blocks: NDArray[np.int64]
) -> LinearFit:
    """Solve ``Z' F theta = Z' y``, with a covariance from leaving out blocks.

    Parameters
    ----------
    columns, instruments : ndarray, shape (n, p)
        F and Z; weights are already in Z.
    target : ndarray, shape (n,)
        y.
    blocks : ndarray of int, shape (n,)
        Rising block numbers, see `time_blocks`.

    Raises
    ------
    ValueError
        Shapes that do not fit, or fewer blocks than it takes to leave one out.
    """
    rows, width = columns.shape
    if instruments.shape != (rows, width) or target.shape != (rows,) or blocks.shape != (rows,):
        raise ValueError(
            f"expected instruments ({rows}, {width}), target ({rows},) and blocks ({rows},), got "
            f"{instruments.shape}, {target.shape} and {blocks.shape}"
        )
    starts = np.flatnonzero(np.diff(blocks, prepend=blocks[0] - 1)) if rows else np.zeros(0, int)
    if starts.size <= width:
        raise ValueError(
            f"expected more blocks than the {width} parameters, got {starts.size} of {rows} rows"
        )
    size_f = _lengths(columns)
    size_z = _lengths(instruments)
    f, z = columns / size_f, instruments / size_z
    cross = np.add.reduceat(z[:, :, np.newaxis] * f[:, np.newaxis, :], starts, axis=0)
    moment = np.add.reduceat(z * target[:, np.newaxis], starts, axis=0)
    whole, whole_moment = cross.sum(axis=0), moment.sum(axis=0)
    theta = np.linalg.pinv(whole) @ whole_moment
    without = np.stack(
        [np.linalg.pinv(whole - c) @ (whole_moment - m) for c, m in zip(cross, moment, strict=True)]
    )
    spread = without - without.mean(axis=0)
    count = float(starts.size)
    covariance = (count - 1.0) / count * spread.T @ spread
    return LinearFit(
        theta=theta / size_f,
        covariance=covariance / np.outer(size_f, size_f),
        dof=max(count - width, 1.0),
        residual=target - f @ theta,
        condition_number=condition_number(columns),
    )


def _lengths(columns: Floats) -> Floats:
    """Return the columns' lengths, 1 for an empty one, so that they can be divided by."""
    length = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    return np.where(length > 0.0, length, 1.0)
