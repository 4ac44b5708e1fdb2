"""Intervals that respect coloured residuals.

Torque residuals are not white: ripple, filters and control colour them. A mean's standard error
therefore counts correlation times instead of samples, and a regression's covariance comes from
leaving out whole blocks of time (delete-a-block jackknife, Kunsch 1989).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

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


def correlation_time(series: Sequence[Floats]) -> float:
    """Return the integral correlation time of coloured noise, in samples, 1 for white noise.

    From the variogram ``V(k) = mean (x[t+k] - x[t])^2 / 2``, which needs no mean and so is not
    fooled by short series: ``tau = 1 + 2 sum (1 - V(k)/V(infinity))`` up to where the correlation
    has died away.

    Parameters
    ----------
    series : sequence of ndarray, shape (n_i,)
        Consecutive samples of the same noise, each with a level of its own.
    """
    longest = max((len(x) for x in series), default=0)
    lags = np.unique(np.geomspace(1, max(longest // 3, 1), 32).astype(np.int64))
    variogram = []
    for lag in lags:
        steps = [x[lag:] - x[:-lag] for x in series if len(x) > lag]
        count = sum(d.shape[0] for d in steps)
        variogram.append(sum(float(d @ d) for d in steps) / (2.0 * max(count, 1)))
    sill = max(variogram, default=0.0)
    if sill <= 0.0:
        return 1.0
    correlation = 1.0 - np.array(variogram) / sill
    dead = np.flatnonzero(correlation < 0.05)
    end = int(dead[0]) + 1 if dead.size else correlation.shape[0]
    # Trapezoids between the lags, the first reaching from lag 0, where the correlation is 1.
    at = np.concatenate(([0.0], lags[:end].astype(np.float64)))
    value = np.concatenate(([1.0], np.maximum(correlation[:end], 0.0)))
    area = float(np.sum(np.diff(at) * (value[1:] + value[:-1]) / 2.0))
    # White noise drops at once, which the first trapezoid cannot know: half a sample less.
    return max(1.0, 2.0 * area)


def variance_of_mean(values: Floats, correlation_samples: float) -> tuple[float, float]:
    """Return the variance of the mean of coloured samples, and its degrees of freedom.

    Exponentially correlated noise of integral time tau over T samples has
    ``var(mean) = s^2 a (1 - a/2 (1 - exp(-2/a)))``, ``a = tau/T``, where the scatter s^2 within the
    series is too small by that variance itself.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Consecutive samples.
    correlation_samples : float
        `correlation_time` of their noise.
    """
    n = values.shape[0]
    if n < 2:
        return math.inf, 0.0
    a = max(correlation_samples, 1.0) / n
    share = min(a * (1.0 - 0.5 * a * (1.0 - math.exp(-2.0 / a))), 0.8)
    scatter = float(np.var(values)) / (1.0 - share)
    return scatter * share, max(1.0 / a - 1.0, 1.0)


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
    parts, p = _parts(blocks), columns.shape[1]
    gram = np.stack([columns[part].T @ columns[part] for part in parts])
    moment = np.stack([columns[part].T @ target[part] for part in parts])
    gram, moment = gram / np.outer(scale, scale), moment / scale
    gram_all, moment_all = gram.sum(axis=0), moment.sum(axis=0)
    theta = np.linalg.solve(gram_all, moment_all)
    # Never singular while one block is a small part of the whole; the pseudo-inverse covers the
    # case that a column lives in one block alone, whose jackknife spread is then rightly large.
    count = len(parts)
    inverse = np.linalg.pinv(gram_all - gram, hermitian=True)
    without = (inverse @ (moment_all - moment)[:, :, np.newaxis])[:, :, 0]
    spread = without - without.mean(axis=0)
    covariance = (count - 1.0) / count * spread.T @ spread
    return theta / scale, covariance / np.outer(scale, scale), max(count - float(p), 1.0)


def covariance_of_one_memory(
    columns: Floats, residual: Floats, blocks: NDArray[np.int64]
) -> Floats:
    """Return the covariance of least squares under noise that remembers alike in every block.

    Its variance v_b is each block's own, what its memory m makes of it is one for all:
    ``m G^-1 (sum v_b G_b) G^-1`` with the Gram matrices G_b and their sum G. The blocks' scores
    ``X_b^T e_b`` say it for all parameters together, ``m = sum (score^T G^-1 score / v_b) / sum
    tr(H_b - H_b^2)`` with the leverages ``H_b = G^-1 G_b``. `block_jackknife` has fewer degrees of
    freedom for a parameter that few blocks carry than this has for all.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        The regressor, of full rank.
    residual : ndarray, shape (n,)
        What least squares leaves.
    blocks : ndarray of int, shape (n,)
        As for `block_jackknife`.

    Returns
    -------
    covariance : ndarray, shape (p, p)
    """
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    parts = _parts(blocks)
    gram = np.stack([columns[part].T @ columns[part] for part in parts]) / np.outer(scale, scale)
    score = np.stack([columns[part].T @ residual[part] for part in parts]) / scale
    variance = np.array(
        [residual[part] @ residual[part] / (part.stop - part.start) for part in parts]
    )
    inverse = np.linalg.pinv(gram.sum(axis=0), hermitian=True)
    leverage = inverse @ gram
    free = np.einsum("bii->", leverage) - np.einsum("bij,bji->", leverage, leverage)
    sizes = np.einsum("bi,ij,bj->b", score, inverse, score)
    memory = float(np.sum(sizes / np.maximum(variance, 1e-300))) / max(float(free), 1e-300)
    middle = np.einsum("b,bij->ij", variance, gram)
    covariance = memory * inverse @ middle @ inverse / np.outer(scale, scale)
    return np.asarray(covariance, dtype=np.float64)


def jackknife_of_even_noise(columns: Floats, blocks: NDArray[np.int64]) -> Floats:
    """Return the covariance that `block_jackknife` makes of even noise of variance 1, shape (p, p).

    On the average; the truth is ``(X^T X)^-1``. What is left in a block that was left out is larger
    than its noise, as the block had drawn the fit: by ``(1 - H)^-1`` for its leverage H (Bell &
    McCaffrey, Survey Methodology 28 (2002) 169).

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        Of sizes that are alike.
    blocks : ndarray of int, shape (n,)
        As for `block_jackknife`.
    """
    basis, upper = np.linalg.qr(columns)
    parts, p = _parts(blocks), columns.shape[1]
    leverage = np.stack([basis[part].T @ basis[part] for part in parts])
    grown = leverage @ np.linalg.pinv(np.eye(p) - leverage, hermitian=True)
    inverse = np.linalg.pinv(upper)
    share = 1.0 - 1.0 / len(parts)
    return np.asarray(share * inverse @ grown.sum(axis=0) @ inverse.T, dtype=np.float64)


def _parts(blocks: NDArray[np.int64]) -> list[slice]:
    """Return where every block begins and ends: its sums are formed apart, in little memory."""
    starts = np.flatnonzero(np.diff(blocks, prepend=blocks[0] - 1)).tolist()
    return [slice(a, b) for a, b in itertools.pairwise([*starts, blocks.shape[0]])]
