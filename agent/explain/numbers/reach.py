"""Intervals that own up to what the model leaves out.

Three things move a number away from the truth: noise, differences between recordings that no column
describes, and small effects of the joint that nobody models. The first two show when blocks of time
and whole recordings are left out in turn (cluster-robust covariance; Cameron and Miller, J. Human
Resources 50 (2015) 317). For the third, what is left over is given the library's other laws, the
one that helps unseen data most first, and the numbers are fitted again beside each (omitted
variables; Belloni, Chernozhukov and Hansen, Rev. Econ. Stud. 81 (2014) 608): an interval reaches
over the estimates of all these models.

What no law of the library takes up bends the numbers as well, and there the residual is silent: it
has nothing left along the model's own columns. But it has along the other laws' columns, and a
column of the model's is no exception among them. The root mean square of what is left along all of
those, noise included, is therefore the least standard deviation of what is missing along its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.candidate import Candidate, basis_of, gain_of
from agent.explain.rows.evidence import Moments, Weighing, heldout, moments
from agent.identify.result import Floats
from agent.identify.uncertainty import student_975

_MOST_BESIDE = 6
_FEWEST_RUNS = 3
_WORTH = 0.02  # of the best single gain: less is not tried
_COPIED = 1e-3  # of a law's energy beyond the model's columns: less, and it renames them


@dataclass(frozen=True)
class Reach:
    """How far numbers may be from their estimates, 95 %; shapes (p,).

    Parameters
    ----------
    below, above : ndarray, shape (p,)
        To be added to the estimates: below is not positive, above not negative.
    beside : tuple of Candidate
        The small laws that the numbers were fitted beside.
    """

    below: Floats
    above: Floats
    beside: tuple[Candidate, ...]


def reach_of(
    candidates: Sequence[Candidate],
    weighing: Weighing,
    columns: Floats,
    residual: Floats,
    named: frozenset[str],
) -> Reach:
    """Return how far the numbers of a fitted model may be from the truth.

    Parameters
    ----------
    candidates : sequence of Candidate
        Laws that may be in what is left, at all points of their grids.
    weighing : Weighing
    columns : ndarray, shape (m, p)
        Weighted derivatives of the prediction by the model's numbers, at their estimates.
    residual : ndarray, shape (m,)
        Weighted, what the model leaves.
    named : frozenset of str
        Effects of the model and their rivals: these laws are not what is left out.
    """
    size = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    size = np.where(size > 0.0, size, 1.0)
    own = columns / size
    rivals, any_way = _other_laws(candidates, own, residual, named)
    stacked = np.concatenate([own, *(c.columns / _norm(c.columns) for c in rivals)], axis=1)
    part = moments(stacked, residual, weighing.starts)
    run = weighing.run[weighing.starts]
    width = own.shape[1]
    places = _places(width, rivals)
    above = any_way * np.sqrt(np.diag(np.linalg.pinv(own.T @ own, hermitian=True)))
    below = -above
    chosen: list[int] = []
    while True:
        index = np.concatenate([np.arange(width), *(places[i] for i in chosen)]).astype(np.int64)
        moved, reach = _estimate(_taken(part, index), run, width)
        below, above = np.minimum(below, moved - reach), np.maximum(above, moved + reach)
        following = _next(part, weighing.fold, index, places, chosen)
        if following is None or len(chosen) == _MOST_BESIDE:
            break
        chosen.append(following)
    return Reach(below / size, above / size, tuple(rivals[i] for i in chosen))


def _energy(columns: Floats) -> float:
    return float(np.einsum("ij,ij->", columns, columns))


def _norm(columns: Floats) -> Floats:
    return np.asarray(np.maximum(np.sqrt(np.einsum("ij,ij->j", columns, columns)), 1e-300))


def _places(width: int, rivals: Sequence[Candidate]) -> list[NDArray[np.int64]]:
    stops = width + np.cumsum([0, *(c.columns.shape[1] for c in rivals)])
    return [np.arange(a, b) for a, b in pairwise(stops)]


def _taken(part: Moments, index: NDArray[np.int64]) -> Moments:
    return Moments(part.gram[:, index][:, :, index], part.moment[:, index], part.square)


def _other_laws(
    candidates: Sequence[Candidate], own: Floats, residual: Floats, named: frozenset[str]
) -> tuple[list[Candidate], float]:
    """Return the best point of every other law, and how much may be left along any direction.

    The latter is the root mean square over the laws (each over its points and columns) times
    Student's quantile for as many laws.
    """
    basis = basis_of(own)
    best: dict[tuple[str, str], tuple[float, Candidate]] = {}
    along: dict[tuple[str, str], list[float]] = {}
    for candidate in candidates:
        form = candidate.form
        if form.effect in named or form.catch_all:
            continue
        key = (form.effect, form.name)
        beyond = candidate.columns - basis @ (basis.T @ candidate.columns)
        unit = basis_of(beyond, like=candidate.columns)
        if not unit.shape[1] or _energy(beyond) < _COPIED * _energy(candidate.columns):
            continue  # as friction under load is of Coulomb friction and inertia without a weight
        along.setdefault(key, []).append(float(np.mean((unit.T @ residual) ** 2)))
        gain = gain_of(candidate, basis, residual)
        if gain > best.get(key, (0.0, None))[0]:
            best[key] = (gain, candidate)
    most = max((gain for gain, _ in best.values()), default=0.0)
    found = [c for gain, c in best.values() if gain > _WORTH * most]
    if not along:
        return found, 0.0
    square = float(np.mean([np.mean(squares) for squares in along.values()]))
    return found, student_975(float(len(along))) * math.sqrt(square)


def _next(
    part: Moments,
    fold: NDArray[np.int64],
    index: NDArray[np.int64],
    places: Sequence[NDArray[np.int64]],
    chosen: Sequence[int],
) -> int | None:
    """Return the law that helps unseen blocks most, where one helps at all."""
    before = heldout(_taken(part, index), fold)
    best, found = 0.0, None
    for i, place in enumerate(places):
        if i in chosen:
            continue
        gain = before - heldout(_taken(part, np.concatenate((index, place))), fold)
        total = float(gain.sum())
        if total > best and total > float(np.std(gain)) * np.sqrt(gain.shape[0]):
            best, found = total, i
    return found


def _estimate(part: Moments, run: NDArray[np.int64], width: int) -> tuple[Floats, Floats]:
    """Return the first numbers' move, and how far each may be off by leaving parts out."""
    blocks = np.arange(part.square.shape[0])
    move, block_spread = _left_out(part, blocks)
    reach = student_975(max(blocks.size - move.size, 1.0)) * block_spread
    count = np.unique(run).size
    if count >= _FEWEST_RUNS:
        reach = np.maximum(reach, student_975(count - 1.0) * _left_out(part, run)[1])
    return move[:width], reach[:width]


def _left_out(part: Moments, group: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Return the fit, and its standard deviation by leaving groups of blocks out in turn."""
    gram, moment = part.total
    ridge = 1e-9 * np.diag(np.diag(gram))
    whole = np.linalg.solve(gram + ridge, moment)
    out = []
    for value in np.unique(group):
        inside = group == value
        left = gram - part.gram[inside].sum(axis=0) + ridge
        out.append(np.linalg.solve(left, moment - part.moment[inside].sum(axis=0)))
    without = np.stack(out)
    count = without.shape[0]
    spread = np.sqrt((count - 1.0) / count * np.sum((without - without.mean(axis=0)) ** 2, axis=0))
    return np.asarray(whole), np.asarray(spread)
