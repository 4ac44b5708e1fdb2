"""Non-linear numbers moved together, to the floor of their valley.

One number moved after the other ends on a slope wherever numbers hang together: a spring and the
friction of the arm behind it, a soft gear and a delay. What is left there is several times what the
law can do, and no interval around such a point is worth anything. Variable projection (Golub and
Pereyra, SIAM J. Numer. Anal. 10 (1973) 413) with the damped steps of Levenberg and Marquardt.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from agent.explain.forms.form import Form, Point
from agent.explain.forms.refinement import Step, limits_of, steps_of
from agent.explain.rows.evidence import solve
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_NUDGE = 0.02  # of a number's first step, for a slope: a gear that swings is narrower than the grid
_ENOUGH = 1e-3  # of the squared error: a round that gains less is the last
_DAMPING, _FREER, _TIGHTER, _TIGHTEST = 1e-2, 0.2, 5.0, 1e3

Columns = Callable[[int, Point], Floats]
"""(law, point) to that law's weighted columns, shape (m, k)."""


@dataclass(frozen=True)
class Movable:
    """A non-linear number: the `place`-th of the `law`-th law, and how it may be moved."""

    law: int
    place: int
    low: float
    high: float
    step: Step


def movable(law: int, form: Form, scene: Scene, grid: Floats) -> list[Movable]:
    """Return the numbers of a law that may be moved; `grid`, shape (g, k), is its form's."""
    if not form.refine or not form.nonlinear or not grid.size or form.point_of is not None:
        return []
    limits, steps = limits_of(form, scene, grid), steps_of(form, scene, grid)
    return [
        Movable(law, place, low, high, step)
        for place, ((low, high), step) in enumerate(zip(limits, steps, strict=True))
        if step.size > 0.0
    ]


@dataclass(frozen=True)
class _Fit:
    """A model at some points: every law's columns and coefficients, and what is left, (m,)."""

    points: tuple[Point, ...]
    columns: tuple[Floats, ...]
    coefficients: tuple[Floats, ...]
    left: Floats
    error: float


def descended(
    points: Sequence[Point],
    numbers: Sequence[Movable],
    columns: Columns,
    beside: Floats,
    target: Floats,
    possible: Callable[[int, Floats], bool],
    rounds: int,
) -> tuple[Point, ...]:
    """Return the points to which damped Gauss-Newton steps lead; never worse than the given ones.

    Parameters
    ----------
    points : sequence of tuple of float
        Of every law.
    numbers : sequence of Movable
    columns : callable
    beside : ndarray, shape (m, p)
        Columns that every model has.
    target : ndarray, shape (m,)
    possible : callable
        (law, its coefficients) to whether physics allows them.
    rounds : int
        The most slopes that are taken.
    """
    at = _fit(tuple(points), columns, beside, target)
    if at is None or not numbers:
        return tuple(points)
    damping = _DAMPING
    for _ in range(rounds):
        before = at.error
        gram, moment = _normal(at, numbers, columns, beside)
        while damping < _TIGHTEST:
            trial = _fit(_moved(at, numbers, gram, moment, damping), columns, beside, target)
            if (
                trial is not None
                and trial.error < at.error
                and all(possible(law, own) for law, own in enumerate(trial.coefficients))
            ):
                at, damping = trial, damping * _FREER
                break
            damping *= _TIGHTER
        if before - at.error < _ENOUGH * before:
            break
    return at.points


def _fit(
    points: tuple[Point, ...], columns: Columns, beside: Floats, target: Floats
) -> _Fit | None:
    """Return the linear fit at some points; nothing where a law overflows there."""
    with np.errstate(over="ignore", invalid="ignore"):  # told by what comes out
        own = tuple(columns(law, point) for law, point in enumerate(points))
    model = np.concatenate([beside, *own], axis=1)
    if not np.isfinite(model).all():
        return None
    theta = solve(model.T @ model, model.T @ target)
    left = target - model @ theta
    stops = beside.shape[1] + np.cumsum([0, *(part.shape[1] for part in own)])
    parts = tuple(theta[a:b] for a, b in pairwise(stops))
    return _Fit(points, own, parts, left, float(left @ left))


def _normal(
    at: _Fit, numbers: Sequence[Movable], columns: Columns, beside: Floats
) -> tuple[Floats, Floats]:
    """Return the normal equations of the numbers' moves, the coefficients refitted beside them."""
    model = np.concatenate([beside, *at.columns], axis=1)
    # Where a law overflows beside its point there is no slope: NaN, whose number is not moved.
    with np.errstate(over="ignore", invalid="ignore"):
        slopes = np.stack([_slope(at, number, columns) for number in numbers], axis=1)
        across = model.T @ slopes
        copied = np.stack([solve(model.T @ model, column) for column in across.T], axis=1)
        slopes = slopes - model @ copied
        return slopes.T @ slopes, slopes.T @ at.left


def _slope(at: _Fit, number: Movable, columns: Columns) -> Floats:
    """Return the derivative of the prediction by a number, shape (m,)."""
    point, place = at.points[number.law], number.place
    nudge = _NUDGE * number.step(point[place])
    if point[place] + nudge > number.high:
        nudge = -nudge
    if nudge == 0.0:
        return np.zeros(at.left.shape[0])
    moved = columns(number.law, (*point[:place], point[place] + nudge, *point[place + 1 :]))
    change = moved - at.columns[number.law]
    return np.asarray(change @ at.coefficients[number.law] / nudge)


def _moved(
    at: _Fit, numbers: Sequence[Movable], gram: Floats, moment: Floats, damping: float
) -> tuple[Point, ...]:
    """Return the points one damped step on, no number moved by more than its first step."""
    points = [list(point) for point in at.points]
    values = np.array([points[n.law][n.place] for n in numbers])
    stuck = np.array(
        [
            (value <= n.low and slope < 0.0) or (value >= n.high and slope > 0.0)
            for value, n, slope in zip(values, numbers, moment, strict=True)
        ]
    )
    free = np.flatnonzero(~stuck & (np.diag(gram) > 0.0))
    if free.size:
        part = gram[np.ix_(free, free)]
        moves = np.linalg.solve(part + damping * np.diag(np.diag(part)), moment[free])
        for index, move in zip(free.tolist(), moves, strict=True):
            number, value = numbers[index], float(values[index])
            most = number.step(value)
            trial = value + min(max(float(move), -most), most)
            points[number.law][number.place] = min(max(trial, number.low), number.high)
    return tuple(tuple(point) for point in points)
