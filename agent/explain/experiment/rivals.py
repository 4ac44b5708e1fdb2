"""What a rival may still be: its points, where its numbers may move, and its refit within that.

A refit that needs an inertia below zero, a share above one, or a spot outside of the stroke refutes
the rival; it does not save it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.candidate import Candidate, Scored, basis_of
from agent.explain.choosing.search import Library
from agent.explain.forms.form import Form, Point, Proportional
from agent.explain.forms.refinement import limits_of
from agent.explain.rows.evidence import solve
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE
from agent.identify.result import Floats

_OUT_OF_QUESTION = 15.0  # of log density, on the recordings alone
_MOST_POINTS = 10
_NUDGE = 0.01
_TOLERATED = 0.05  # of a number's usual size: so far below zero a fit may end by chance
_NOT_NEGATIVE = ("inertia_kg_m2", "viscous_nm_s_per_rad", "coulomb_nm")

Bounds = tuple[Floats, Floats]
"""Lowest and highest value of every number of a refit, each shape (p,)."""


def possible_points(
    library: Library,
    rows: NDArray[np.int64],
    common: Floats,
    added: Sequence[Floats],
    j: int,
    own: Scored,
    per_square: float,
) -> tuple[tuple[Form, Point], ...]:
    """Return a rival's fitted point, and those of its effect that the recordings do not refute.

    `per_square` turns a squared misfit into log density.
    """
    basis = basis_of(common)
    targets = [a - basis @ (basis.T @ a) for i, a in enumerate(added) if i != j]
    found: list[tuple[float, Form, Point]] = []
    for candidate in library.candidates:
        fitted = candidate.form is own.form and candidate.point == own.candidate.point
        if candidate.form.effect != own.form.effect or fitted:
            continue
        columns = candidate.columns[rows]
        copy = basis_of(columns - basis @ (basis.T @ columns), like=columns)
        behind = min(
            per_square * float(target @ target - np.sum((copy.T @ target) ** 2))
            for target in targets
        )
        if behind < _OUT_OF_QUESTION:
            found.append((behind, candidate.form, candidate.point))
    found.sort(key=lambda entry: entry[0])
    nearest = [(form, point) for _, form, point in found[:_MOST_POINTS]]
    return ((own.form, own.candidate.point), *nearest)


def designs(scene: Scene, own: Scored, points: Sequence[tuple[Form, Point]]) -> Iterator[Floats]:
    """Yield every point's columns at full rate, the fitted point's with its tangents."""
    for form, point in points:
        columns = form.columns(scene, point)
        if form is not own.form or point != own.candidate.point:
            yield columns
            continue
        steps = _steps(scene, form, point)
        near = ((*point[:i], point[i] + step, *point[i + 1 :]) for i, step in enumerate(steps))
        moved = [form.columns(scene, p) - columns for p in near]
        yield np.concatenate((columns, *((m @ own.coefficients)[:, None] for m in moved)), axis=1)


def _steps(scene: Scene, form: Form, point: Point) -> list[float]:
    """Return a little step of every non-linear number; none where they are not refined."""
    steps = None if form.step is None else form.step(scene)
    out = []
    for i, value in enumerate(point if form.refine else ()):
        size = abs(value) if steps is None else steps[i]
        size *= abs(value) if isinstance(size, Proportional) else 1.0
        out.append(_NUDGE * (size if size > 0.0 else 1.0))
    return out


def numbers_beside(library: Library, terms: Sequence[Candidate]) -> Floats:
    """Return the twin's own numbers, as far as they are excited, fitted beside some terms, (p,)."""
    columns = library.model(terms)
    fit = solve(columns.T @ columns, columns.T @ library.target)
    return np.asarray(_given(library) + fit[: library.base.shape[1]])


def bounds_of(
    library: Library,
    numbers: Floats,
    others: Sequence[Candidate],
    own: Scored,
    point: tuple[Form, Point],
) -> Bounds:
    """Return how far a refit may move the twin's numbers, the other terms', and the rival's.

    Parameters
    ----------
    library : Library
    numbers : ndarray, shape (p,)
        The twin's own where the refit begins: those beside the effect that is taken to be true.
    others : sequence of Candidate
        The model's other terms; they are free.
    own : Scored
        The rival as it was fitted.
    point : (Form, Point)
        One of the rival's: its linear numbers and, at the fitted point, the moves of its others.
    """
    scene = library.scene
    names = [BASE[i] for i in np.flatnonzero(_carried(library))]
    usual = np.abs(scene.theta[_carried(library)])
    must = np.isin(names, _NOT_NEGATIVE)
    low = np.where(must, np.minimum(-numbers - _TOLERATED * usual, 0.0), -np.inf)
    free = np.full(sum(c.columns.shape[1] for c in others), np.inf)
    form, at = point
    width = range(len(form.linear))
    top = np.array([_highest(form, i) for i in width])
    lowest = [low, -free, np.where([form.sign(i) > 0 for i in width], 0.0, -top)]
    highest = [np.full(low.shape, np.inf), free, top]
    if form is own.form and at == own.candidate.point:
        steps = np.array(_steps(scene, form, at))
        grid = [c.point for c in library.candidates if c.form is form] or [at]
        ends = np.array(limits_of(form, scene, np.array(grid))[: steps.shape[0]])
        if steps.size:
            moves = (ends - np.array(at)[:, np.newaxis]) / steps[:, np.newaxis]
            lowest.append(np.minimum(moves[:, 0], 0.0))
            highest.append(np.maximum(moves[:, 1], 0.0))
    return np.concatenate(lowest), np.concatenate(highest)


def bounded_left(gram: Floats, bounds: Bounds) -> float:
    """Return the squared torque that a refit within bounds leaves.

    A number that would leave its bounds is held there and the others are fitted once more. None is
    let go again, so that this is what a refit leaves at most.

    Parameters
    ----------
    gram : ndarray, shape (p + 1, p + 1)
        Of the refit's columns and, last, of the torque.
    bounds : Bounds
    """
    low, high = bounds
    square, moment = gram[:-1, :-1], gram[:-1, -1]
    numbers, free = np.zeros(low.shape), np.ones(low.shape, dtype=np.bool_)
    while free.any():
        rest = moment - square[:, ~free] @ numbers[~free]
        numbers[free] = solve(square[np.ix_(free, free)], rest[free])
        out = free & ((numbers < low) | (numbers > high))
        if not out.any():
            break
        numbers[out] = np.clip(numbers[out], low[out], high[out])
        free &= ~out
    return float(gram[-1, -1] - 2.0 * numbers @ moment + numbers @ square @ numbers)


def _highest(form: Form, index: int) -> float:
    return form.highest[index] if index < len(form.highest) else math.inf


def _carried(library: Library) -> NDArray[np.bool_]:
    """Return which of the twin's numbers the recordings excite, shape (5,)."""
    return library.scene.table.carried


def _given(library: Library) -> Floats:
    """Return the twin's numbers as given, as far as they are excited, shape (p,)."""
    scene = library.scene
    given = scene.theta if scene.given is None else scene.given
    return np.asarray(given[_carried(library)])
