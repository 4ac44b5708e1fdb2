"""The motion that drives friction's memory: as sharp at its turns as the encoder saw them.

Friction with memory counts travel, and what a turn's place is wrong by is remembered until the
joint has gone the memory's length. Between two readings of a slow joint an encoder says little, but
the instant at which its count changes says exactly where the joint is.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass

_WIDER = 1.4  # times the regression's cutoff: travel bears more noise than acceleration
_HIGHEST = 0.25  # of the sampling rate: its cutoff at most
_SHARPER = 2.0  # times the regression's cutoff: what the edges of an encoder's steps bear
_KNOTS = 8.0  # to a period of the regression's cutoff
_DEGREE = 3
_THIRD = (-1.0, 3.0, -3.0, 1.0)  # differences: what is unknown of a motion is its jerk
_SUREST = 0.05  # of a step: no edge is truer
_ROUNDS = 6  # to bring the motion into its steps
_HELD = 0.1  # of a step: how firmly it is kept there


def driving_velocity(
    measured_rad: Floats,
    velocity_rad_s: Floats,
    extremes: Sequence[int],
    *,
    period_s: float,
    cutoff_hz: float,
    step_rad: float,
) -> Floats:
    """Return the velocity that drives friction's memory, rad/s, shape (n,).

    Parameters
    ----------
    measured_rad, velocity_rad_s : ndarray, shape (n,)
        Positions as recorded, evenly sampled, and their velocity behind the regression's low-pass.
    extremes : sequence of int
        Where `measured_rad` turns round: the first sample at each last count.
    period_s, cutoff_hz : float
        Time between samples; cutoff of the regression's low-pass.
    step_rad : float
        The encoder's step; 0 where noise hides it.
    """
    if step_rad > 0.0 and _SHARPER * cutoff_hz <= _HIGHEST / period_s:
        position = between_edges(
            measured_rad, velocity_rad_s, period_s=period_s, cutoff_hz=cutoff_hz, step_rad=step_rad
        )
        extremes = _middles(measured_rad, extremes, step_rad)
    else:
        wider = max(cutoff_hz, min(_WIDER * cutoff_hz, _HIGHEST / period_s))
        position = lowpass(measured_rad, period_s, wider)
    return np.asarray(np.gradient(_one_way(position, extremes), period_s))


def between_edges(
    measured_rad: Floats,
    velocity_rad_s: Floats,
    *,
    period_s: float,
    cutoff_hz: float,
    step_rad: float,
) -> Floats:
    """Return the smoothest motion through the edges that an encoder passes, shape (n,), rad.

    A spline with a penalty on its third differences (Eilers and Marx, "Flexible smoothing with
    B-splines and penalties", 1996). It is told that the joint is at an edge when the count changes
    by one, to what it goes between two readings; elsewhere that it is within a step, as often as
    the motion is new. Samples that leave their step are brought back to its edge.

    Parameters
    ----------
    measured_rad, velocity_rad_s : ndarray, shape (n,)
        Positions in whole steps, evenly sampled, and a smoothed velocity.
    period_s, cutoff_hz, step_rad : float
        Time between samples; where a signal of white noise as strong as the steps' would be cut
        off, over `_SHARPER`; the encoder's step.
    """
    n = measured_rad.size
    basis = _Basis.over(n, 1.0 / (_KNOTS * cutoff_hz * period_s))
    # All in samples and steps. At an edge the error is what is gone between two readings.
    counts = (measured_rad - measured_rad[0]) / step_rad
    passed = np.flatnonzero(np.rint(np.abs(np.diff(counts))) == 1.0)
    gone = np.clip(np.abs(velocity_rad_s[passed]) * period_s / step_rad, _SUREST, 1.0)
    middle = 0.5 * (counts[passed] + counts[passed + 1])
    edges = basis.at(0.5 + passed.astype(np.float64), middle, 12.0 / gone**2)
    # White noise as strong as the steps would be cut off here: the motion is new twice a period.
    sharpest = _SHARPER * cutoff_hz * period_s
    alike = np.clip(_dwells(counts), 1.0, max(0.5 / sharpest, 1.0))
    time = np.arange(n, dtype=np.float64)
    known = edges + basis.at(time, counts, 12.0 / alike)
    known += basis.smooth(12.0 / (2.0 * np.pi * sharpest) ** 6)
    path = basis.solved(known)
    for _ in range(_ROUNDS):
        over = path - counts
        out = np.abs(over) > 0.5
        if not out.any():
            break
        edge = counts[out] + np.copysign(0.5, over[out])
        path = basis.solved(known + basis.at(time[out], edge, np.full(edge.size, _HELD**-2)))
    return np.asarray(measured_rad[0] + step_rad * path)


def _dwells(counts: Floats) -> Floats:
    """Return for how many samples each one's count stays the same, shape (n,)."""
    starts = np.flatnonzero(np.diff(counts, prepend=np.nan) != 0.0)
    lengths = np.diff(starts, append=counts.size)
    return np.repeat(lengths, lengths).astype(np.float64)


def _middles(measured_rad: Floats, extremes: Sequence[int], step_rad: float) -> list[int]:
    """Return the middle of the time that each turn stays at its last count."""
    out = []
    for at, end in itertools.pairwise([*extremes, measured_rad.size]):
        away = np.abs(measured_rad[at:end] - measured_rad[at])
        left = np.flatnonzero(away > 1.5 * step_rad)
        stay = np.flatnonzero(away[: left[0] if left.size else end - at] < 0.5 * step_rad)
        out.append(at + int(stay[-1]) // 2)
    return out


def _one_way(position: Floats, extremes: Sequence[int]) -> Floats:
    """Return the nearest position that goes one way between turns (isotonic regression).

    Friction with memory counts travel, forth or back. What an encoder's steps add where the joint
    is slow, close to its turns, would all count as travel, and the laws would have friction rise
    sooner than it does: of two springs' viscous part this took 1 %.
    """
    from scipy.optimize import isotonic_regression

    out = position.copy()
    ends = [0, *extremes, position.size - 1]
    for begin, end in itertools.pairwise(ends):
        leg = position[begin : end + 1]
        if leg.size > 1:
            rises = bool(leg[-1] > leg[0])
            out[begin : end + 1] = isotonic_regression(leg, increasing=rises).x
    return out


@dataclass(frozen=True)
class _Equations:
    """What observations say of a spline's weights: ``gram @ weights = right``, gram in bands."""

    gram: Floats
    right: Floats

    def __add__(self, other: _Equations) -> _Equations:
        """Return both together."""
        return _Equations(self.gram + other.gram, self.right + other.right)


@dataclass(frozen=True)
class _Basis:
    """B-splines over `samples` readings, every `spacing` of them one, shape (size,)."""

    knots: Floats
    samples: int
    spacing: float

    @classmethod
    def over(cls, samples: int, spacing: float) -> _Basis:
        """Return the basis whose splines are at most so many samples apart."""
        inner = np.linspace(0.0, samples - 1.0, max(math.ceil(samples / spacing), 1) + 1)
        beyond = inner[1] * np.arange(1, _DEGREE + 1)
        knots = np.concatenate((-beyond[::-1], inner, inner[-1] + beyond))
        return cls(knots, samples, float(inner[1]))

    @property
    def size(self) -> int:
        """Return the number of splines."""
        return self.knots.size - _DEGREE - 1

    def at(self, time: Floats, values: Floats, sureness: Floats) -> _Equations:
        """Return what values at times, in samples, say by their inverse variances; shapes (m,)."""
        from scipy.interpolate import BSpline

        gram = np.zeros((_DEGREE + 1, self.size))
        if not time.size:  # which `design_matrix` does not take
            return _Equations(gram, np.zeros(self.size))
        own = BSpline.design_matrix(time, self.knots, _DEGREE)
        rows, first = own.data.reshape(-1, _DEGREE + 1), own.indices[:: _DEGREE + 1]
        for i, j in itertools.combinations_with_replacement(range(_DEGREE + 1), 2):
            shared = sureness * rows[:, i] * rows[:, j]
            gram[_DEGREE - (j - i)] += np.bincount(first + j, shared, self.size)
        return _Equations(gram, np.asarray(own.T @ (sureness * values)))

    def smooth(self, penalty: float) -> _Equations:
        """Return the penalty on the square of the third derivative, integrated over samples."""
        share = penalty / self.spacing**5
        gram = np.zeros((_DEGREE + 1, self.size))
        for i, j in itertools.combinations_with_replacement(range(_DEGREE + 1), 2):
            last = self.size - _DEGREE + j
            gram[_DEGREE - (j - i), j:last] += share * _THIRD[i] * _THIRD[j]
        return _Equations(gram, np.zeros(self.size))

    def solved(self, known: _Equations) -> Floats:
        """Return the spline of these equations at every sample, shape (samples,)."""
        from scipy.interpolate import BSpline
        from scipy.linalg import solveh_banded

        weights = solveh_banded(known.gram, known.right)
        return np.asarray(BSpline(self.knots, weights, _DEGREE)(np.arange(self.samples)))
