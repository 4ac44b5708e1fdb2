"""One law fitted to all reversals: variable projection, and what every reversal says of it.

The shape is searched on a grid and refined by Gauss-Newton in its logarithms, the linear weights
projected out. Every reversal is then left out by one Newton step, which gives the errors at
reversals that the fit has not seen, and a covariance that holds whatever the reversals differ in
(delete-a-group jackknife; Bell and McCaffrey, Survey Methodology 28 (2002) 169, for its degrees of
freedom).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.reversals.covariance import (
    Linear,
    half_interval,
    noise_covariance,
    turn_covariance,
)
from agent.identify.reversals.data import Data, columns_of
from agent.identify.reversals.laws import Range, ReversalLaw

_ITERATIONS = 25
_CONVERGED = 1e-6  # relative fall of the squared error: some hundredths of a deviation
_REFINED = 2  # points of the grid that are refined
_CHANCE = 1.2  # times the noise: what may be left without calling it misfit
_AT_BOUND = 0.02  # in the logarithm


@dataclass(frozen=True)
class Solution:
    """The minimum of one law.

    Parameters
    ----------
    law : ReversalLaw
        Which.
    x : ndarray, shape (p,)
        Logarithms of the shape.
    weights : ndarray, shape (m,)
        Of `columns_of`.
    residual_nm : ndarray, shape (N,)
        Measured less predicted torque.
    unseen_nm2 : ndarray, shape (G,)
        Mean squared error at every reversal with it left out.
    shifts : ndarray, shape (G, p + m)
        What leaving each reversal out changes in `x` and `weights`.
    expected : ndarray, shape (G, p + m, p + m)
        Covariance of the shifts under white noise of variance 1.
    noise : tuple of ndarray, shape (p + m, p + m), and float
        Covariance of `x` and `weights` under white torque noise, and its degrees of freedom.
    turning : ndarray, shape (p + m, p + m)
        Their covariance from the encoder's error at the turns.
    at_bound : ndarray of bool, shape (p,)
        Whether the shape ran to the end of its range.
    misfit : float
        What the law leaves as a multiple of the torque's noise, at least 1.
    """

    law: ReversalLaw
    x: Floats
    weights: Floats
    residual_nm: Floats
    unseen_nm2: Floats
    shifts: Floats
    expected: Floats
    noise: tuple[Floats, float]
    turning: Floats
    at_bound: NDArray[np.bool_]
    misfit: float

    @property
    def rmse_nm(self) -> float:
        """Return the root mean square of the residual."""
        return math.sqrt(float(np.mean(self.residual_nm**2)))

    @property
    def heldout_rmse_nm(self) -> float:
        """Return the root mean square error at reversals left out."""
        return math.sqrt(float(np.mean(self.unseen_nm2)))

    def value(self, name: str) -> float:
        """Return a parameter of the law by its name."""
        if name in self.law.shape:
            return math.exp(float(self.x[self.law.shape.index(name)]))
        return float(self.weights[self.law.linear.index(name)])

    def place(self, name: str) -> int:
        """Return a parameter's place in `shifts`."""
        if name in self.law.shape:
            return self.law.shape.index(name)
        return self.x.size + self.law.linear.index(name)

    def upper(self, name: str) -> float:
        """Return the upper end of a linear parameter's interval."""
        gradient = np.zeros(self.shifts.shape[1])
        gradient[self.place(name)] = 1.0
        return self.value(name) + self.half_width(gradient)

    def half_width(self, gradient: Floats) -> float:
        """Return half of the 95 % interval of a function with this gradient over `shifts`.

        Shape parameters count by their logarithm. A law that leaves more than the noise errs
        alike at all reversals, which leaving one out does not show: its intervals grow with what
        it leaves.
        """
        count = self.shifts.shape[0]
        variance = (count - 1.0) / count * float(np.sum((self.shifts @ gradient) ** 2))
        each = np.einsum("i,gij,j->g", gradient, self.expected, gradient)
        total = float(np.sum(each))
        if total <= 0.0:
            return math.inf
        own = variance, total**2 / float(np.sum(each**2))
        return self.misfit * half_interval(gradient, self.noise, self.turning, own)


def solve(law: ReversalLaw, data: Data, range_: Range) -> Solution:
    """Fit one law to all reversals."""
    bounds = np.log(law.bounds(range_)).reshape(-1, 2)
    best: tuple[float, Floats] = (math.inf, np.zeros(0))
    for start in _starts(law, data, bounds):
        squares, x = _refine(law, data, start, bounds)
        if squares < best[0]:
            best = squares, x
        if data.noise_nm > 0.0 and _misfit(best[0], data) == 1.0:
            break  # what is left is the torque's noise: no other start ends lower
    return _finish(law, data, best[1], bounds)


def _starts(law: ReversalLaw, data: Data, bounds: Floats) -> list[Floats]:
    """Return the best points of the grid."""
    scored = [
        (_project(columns_of(law, data, x), data.torque_nm)[1], x) for x in _grid(law, bounds)
    ]
    scored.sort(key=lambda pair: pair[0])
    return [x for _, x in scored[:_REFINED]]


def _grid(law: ReversalLaw, bounds: Floats) -> Iterator[Floats]:
    """Yield the grid, ends left out: each axis even in the logarithm."""
    axes = [
        np.linspace(low, high, points + 2)[1:-1]
        for (low, high), points in zip(bounds, law.grid, strict=True)
    ]
    for point in itertools.product(*axes):
        yield np.array(point, dtype=np.float64)


def _project(columns: Floats, target: Floats) -> tuple[Floats, float]:
    """Return the weights of least squares, and the squared error that they leave."""
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    scaled = columns / np.where(scale > 0.0, scale, 1.0)
    # A column of zeros, or one that two laws share, gets the smallest weight that serves.
    weights = np.linalg.pinv(scaled.T @ scaled, rcond=1e-11, hermitian=True) @ (scaled.T @ target)
    rest = target - scaled @ weights
    return weights / np.where(scale > 0.0, scale, 1.0), float(rest @ rest)


def _slopes(law: ReversalLaw, data: Data, x: Floats, weights: Floats) -> Floats:
    """Return the derivative of the prediction by every logarithm of the shape, shape (N, p)."""
    out = np.empty((data.torque_nm.size, x.size))
    for i in range(x.size):
        step = np.zeros(x.size)
        step[i] = law.step
        ahead, behind = columns_of(law, data, x + step), columns_of(law, data, x - step)
        out[:, i] = (ahead - behind) @ weights / (2.0 * law.step)
    return out


def _refine(law: ReversalLaw, data: Data, x: Floats, bounds: Floats) -> tuple[float, Floats]:
    """Return squared error and shape at the minimum that damped Gauss-Newton finds from `x`."""
    columns = columns_of(law, data, x)
    weights, squares = _project(columns, data.torque_nm)
    damping = 1e-8
    for _ in range(_ITERATIONS if x.size else 0):
        ahead = [columns_of(law, data, x + step) for step in law.step * np.eye(x.size)]
        slopes = [(other - columns) @ weights / law.step for other in ahead]
        jacobian = np.column_stack((*slopes, columns))
        rest = data.torque_nm - columns @ weights
        gained = False
        while not gained and damping < 1e6:
            trial = np.clip(x + _step(jacobian, rest, damping, x.size), bounds[:, 0], bounds[:, 1])
            trial_columns = columns_of(law, data, trial)
            trial_weights, trial_squares = _project(trial_columns, data.torque_nm)
            gained = trial_squares < squares
            damping *= 0.1 if gained else 10.0
        if not gained:
            break
        fell = (squares - trial_squares) / squares
        x, columns, weights, squares = trial, trial_columns, trial_weights, trial_squares
        if fell < _CONVERGED:
            break
    return squares, x


def _step(jacobian: Floats, rest: Floats, damping: float, shapes: int) -> Floats:
    """Return the step of the shape's logarithms; no more than one at once, a factor of e."""
    scale = np.maximum(np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian)), 1e-300)
    scaled = jacobian / scale
    gram = scaled.T @ scaled
    gram[np.arange(shapes), np.arange(shapes)] += damping
    step = np.linalg.pinv(gram, rcond=1e-11, hermitian=True) @ (scaled.T @ rest) / scale
    return np.asarray(np.clip(step[:shapes], -1.0, 1.0))


def _finish(law: ReversalLaw, data: Data, x: Floats, bounds: Floats) -> Solution:
    """Leave every reversal out by one Newton step, and put the solution together."""
    columns = columns_of(law, data, x)
    weights, _ = _project(columns, data.torque_nm)
    rest = data.torque_nm - columns @ weights
    at_bound = np.array(
        [
            bool(v - low < _AT_BOUND or high - v < _AT_BOUND)
            for v, (low, high) in zip(x, bounds, strict=True)
        ],
        dtype=np.bool_,
    )
    slopes = np.where(at_bound, 0.0, _slopes(law, data, x, weights))
    jacobian = np.column_stack((slopes, columns))
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0.0] = 1.0
    at, shifts, expected = _left_out(data, jacobian / scale, rest)
    unseen = rest - np.einsum("ni,ni->n", at.jacobian, shifts[data.turn])
    noise, freedom = noise_covariance(data, at)
    turning = turn_covariance(law, data, x, weights, at)
    squared = scale[:, np.newaxis] * scale
    return Solution(
        law,
        x,
        weights,
        rest,
        data.sums(unseen**2) / data.sums(np.ones(rest.size)),
        shifts / scale,
        expected / squared,
        (noise / squared, freedom),
        turning / squared,
        at_bound,
        _misfit(float(rest @ rest), data),
    )


def _left_out(data: Data, jacobian: Floats, rest: Floats) -> tuple[Linear, Floats, Floats]:
    """Return the linear problem, and what leaving out each of r reversals does to its p numbers.

    The shifts, shape (r, p), and the covariance that chance alone would give them, (r, p, p).
    """
    gram = data.sums(jacobian[:, :, np.newaxis] * jacobian[:, np.newaxis, :])
    moment = data.sums(jacobian * rest[:, np.newaxis])
    total = gram.sum(axis=0)
    inverse = np.linalg.pinv(total, rcond=1e-11, hermitian=True)
    without = np.linalg.pinv(total - gram, rcond=1e-11, hermitian=True)
    shifts = -np.einsum("gij,gj->gi", without, moment)
    expected = without @ (gram - gram @ inverse @ gram) @ without
    return Linear(jacobian, inverse, rest), shifts, expected


def _misfit(squares: float, data: Data) -> float:
    """Return what is left as a multiple of the noise; what could be chance counts as 1."""
    if data.noise_nm <= 0.0:
        return 1.0
    ratio = math.sqrt(squares / data.torque_nm.size) / data.noise_nm
    return ratio if ratio > _CHANCE else 1.0
