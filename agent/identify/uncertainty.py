"""Intervals that respect coloured residuals.

Torque residuals are not white: ripple, filters and control colour them. A mean's standard error
therefore comes from the scatter of block means (batch means), and a regression's covariance from
leaving out whole blocks of time (delete-a-block jackknife, Kunsch 1989), never from the count of
samples.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats


def student_975(dof: float) -> float:
    """Return the 97.5 % quantile of Student's t for `dof` > 0 degrees of freedom.

    Closed forms for 1 and 2, G. W. Hill's asymptotic expansion (CACM 13 (1970) 619) above; the
    error is below 0.1 % from 3 on. Written out because importing a statistics library takes longer
    than the whole estimate.
    """
    if dof <= 0.0 or math.isnan(dof):
        return math.inf
    if math.isinf(dof):
        return 1.959963984540054
    if dof < 1.0:
        return float(math.tan(0.475 * math.pi) ** (1.0 / dof))
    if dof < 2.0:
        low, high = math.log(math.tan(0.475 * math.pi)), math.log(4.302652729911275)
        # Between the closed forms, the quantile's logarithm is nearly straight in 1/dof.
        weight = (1.0 / dof - 0.5) / 0.5
        return math.exp(high + weight * (low - high))
    if dof < 3.0:
        low, high = math.log(4.302652729911275), math.log(3.182446305284263)
        weight = (1.0 / dof - 1.0 / 3.0) / (1.0 / 2.0 - 1.0 / 3.0)
        return math.exp(high + weight * (low - high))
    a = 1.0 / (dof - 0.5)
    b = 48.0 / a**2
    c = ((20700.0 * a / b - 98.0) * a - 16.0) * a + 96.36
    d = ((94.5 / (b + c) - 3.0) / b + 1.0) * math.sqrt(a * math.pi / 2.0) * dof
    p = 0.05
    y = (d * p) ** (2.0 / dof)
    if y > 0.05 + a:
        x = -1.959963984540054
        y = x * x
        if dof < 5.0:
            c += 0.3 * (dof - 4.5) * (x + 0.6)
        c = (((0.05 * d * x - 5.0) * x - 7.0) * x - 2.0) * x + b + c
        y = (((((0.4 * y + 6.3) * y + 36.0) * y + 94.5) / c - y - 3.0) / b + 1.0) * x
        y = math.expm1(a * y * y)
    else:
        y = (
            (
                1.0 / (((dof + 6.0) / (dof * y) - 0.089 * d - 0.822) * (dof + 2.0) * 3.0)
                + 0.5 / (dof + 4.0)
            )
            * y
            - 1.0
        ) * (dof + 1.0) / (dof + 2.0) + 1.0 / y
    return math.sqrt(dof * y)


def variance_of_mean(values: Floats) -> tuple[float, float]:
    """Return the variance of the mean of coloured samples, and its degrees of freedom.

    Batch means, once with 16 and once with 8 batches: more batches are better determined, longer
    ones less correlated. The larger variance counts.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Consecutive samples.
    """
    n = values.shape[0]
    if n < 8:
        return (float(np.var(values, ddof=1)) / n if n > 1 else math.inf), max(n - 1.0, 0.0)
    best, best_dof = 0.0, 1.0
    for batches in (16, 8):
        size = n // batches
        if size < 2:
            continue
        means = values[: size * batches].reshape(batches, size).mean(axis=1)
        variance = float(np.var(means, ddof=1)) / batches
        if variance > best or best == 0.0:
            best, best_dof = variance, batches - 1.0
    return best, best_dof


def block_jackknife(
    columns: Floats, target: Floats, blocks: NDArray[np.int64]
) -> tuple[Floats, Floats, float]:
    """Return least squares with a covariance that survives coloured, uneven residuals.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        The regressor, of full rank.
    target : ndarray, shape (n,)
        What it explains.
    blocks : ndarray of int, shape (n,)
        Number of the block of time that every row belongs to, rising.

    Returns
    -------
    theta : ndarray, shape (p,)
    covariance : ndarray, shape (p, p)
        ``(B - 1)/B sum (theta_-b - mean)(theta_-b - mean)^T`` over blocks left out one by one.
    dof : float
        B - p, at least 1.
    """
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    scaled = columns / scale
    starts = np.flatnonzero(np.diff(blocks, prepend=blocks[0] - 1))
    p = columns.shape[1]
    gram = np.add.reduceat(_outer(scaled), starts, axis=0).reshape(-1, p, p)
    moment = np.add.reduceat(scaled * target[:, np.newaxis], starts, axis=0)
    gram_all, moment_all = gram.sum(axis=0), moment.sum(axis=0)
    theta = np.linalg.solve(gram_all, moment_all)
    # Never singular while one block is a small part of the whole; the pseudo-inverse covers the
    # case that a column lives in one block alone, whose jackknife spread is then rightly large.
    count = starts.shape[0]
    without = np.stack(
        [
            np.linalg.pinv(gram_all - g, hermitian=True) @ (moment_all - m)
            for g, m in zip(gram, moment, strict=True)
        ]
    )
    spread = without - without.mean(axis=0)
    covariance = (count - 1.0) / count * spread.T @ spread
    return theta / scale, covariance / np.outer(scale, scale), max(count - float(p), 1.0)


def _outer(rows: Floats) -> Floats:
    """Return every row's outer product with itself, flattened: shape (n, p*p)."""
    return (rows[:, :, np.newaxis] * rows[:, np.newaxis, :]).reshape(rows.shape[0], -1)
