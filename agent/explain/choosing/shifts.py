"""What chance gives: residuals that follow no axis any more, but keep their autocorrelation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.candidate import Candidate, Scored, basis_of
from agent.explain.choosing.search import Library
from agent.explain.rows.evidence import Weighing
from agent.identify.result import Floats

_SHIFTS = 199
_SMALLEST = 1e-3  # of the largest block: one that holds nothing is none that counts most
_TOGETHER = 64  # spaces that are compared with all shifted residuals in one product


def shifted(
    weighing: Weighing, left: Floats, seed: int = 0, count: int = _SHIFTS
) -> NDArray[np.float32]:
    """Return a residual, shifted in a circle within its recordings, block signs drawn.

    Parameters
    ----------
    weighing : Weighing
    left : ndarray, shape (m,)
    seed, count : int

    Returns
    -------
    ndarray, shape (m, count)
    """
    rng = np.random.default_rng(seed)
    out = np.empty((count, left.shape[0]), dtype=np.float32)
    run = weighing.run
    bounds = np.flatnonzero(np.diff(run, prepend=run[0] - 1))
    stops = np.append(bounds[1:], run.shape[0])
    lengths = np.diff(np.append(weighing.starts, run.shape[0]))
    for j in range(count):
        moved = left.copy()
        for a, b in zip(bounds, stops, strict=True):
            moved[a:b] = np.roll(left[a:b], int(rng.integers(0, max(b - a, 1))))
        sign = rng.choice([-1.0, 1.0], lengths.shape[0])
        out[j] = moved * np.repeat(sign, lengths)
    return out.T


def chance(
    library: Library,
    terms: Sequence[Candidate],
    scored: Scored,
    seed: int = 0,
    *,
    blocks_alike: bool = False,
) -> float:
    """Return how often shifted residuals give any form as much as this one, from 0 to 1.

    What every form gains is judged by how rare that is for this form, so that the best of all forms
    is compared with the best.

    Parameters
    ----------
    library : Library
    terms : sequence of Candidate
        The model that the form would join.
    scored : Scored
    seed : int
    blocks_alike : bool
        Whether what is left counts alike in every block. Where a slow pass lingers at a bump, one
        block may hold a third of it; that fits a bump wherever it is shifted to.
    """
    basis = basis_of(library.model(terms))
    left = library.target - basis @ (basis.T @ library.target)
    rows = _alike(library.weighing, left) if blocks_alike else None
    if rows is not None:
        basis = basis_of(rows * library.model(terms))
        left = rows[:, 0] * library.target
        left = left - basis @ (basis.T @ left)

    def beside(candidate: Candidate) -> Floats:
        columns = candidate.columns if rows is None else rows * candidate.columns
        return basis_of(columns - basis @ (basis.T @ columns))

    drawn = shifted(library.weighing, left, seed)
    best_of: dict[tuple[str, str], Floats] = {}
    candidates = (*library.candidates, scored.candidate)
    bases = (beside(c) for c in candidates)
    for candidate, share in zip(candidates, energies_in(bases, drawn), strict=True):
        key = (candidate.form.effect, candidate.form.name)
        best_of[key] = np.maximum(best_of.get(key, np.zeros(_SHIFTS)), share)
    found = scored.screened * float(left @ left)
    if rows is not None:
        found = float(np.sum((beside(scored.candidate).T @ left) ** 2))
    mine = chance_tail(found, best_of[(scored.form.effect, scored.form.name)])
    least = np.min([chance_tail(v, v) for v in best_of.values()], axis=0)
    return float((1 + np.sum(least <= mine)) / (1 + _SHIFTS))


def _alike(weighing: Weighing, left: Floats) -> Floats:
    """Return factors of the rows, shape (m, 1), with which every block has the same mean square."""
    lengths = np.diff(np.append(weighing.starts, left.shape[0]))
    size = np.sqrt(np.add.reduceat(left**2, weighing.starts) / lengths)
    factors = 1.0 / np.maximum(size, _SMALLEST * max(float(size.max()), 1e-300))
    return np.asarray(np.repeat(factors, lengths)[:, np.newaxis])


def energies_in(bases: Iterable[Floats], drawn: NDArray[np.float32]) -> list[Floats]:
    """Return the energy of shifted residuals that lies in each space, shape (count,) each.

    Parameters
    ----------
    bases : iterable of ndarray, shape (m, r)
        Orthonormal; taken a few at a time, as all of them would be a second library in memory.
    drawn : ndarray, shape (m, count)
        As `shifted` returns them. They are read once for many spaces: there are a lot of them.
    """
    out: list[Floats] = []
    left = iter(bases)
    while several := list(islice(left, _TOGETHER)):
        stacked = np.concatenate(several, axis=1).astype(np.float32)
        squares = (stacked.T @ drawn) ** 2
        stops = np.cumsum([basis.shape[1] for basis in several])[:-1]
        out += [np.sum(part, axis=0) for part in np.split(squares, stops)]
    return out


def chance_tail(gains: Floats | float, null: Floats) -> Floats:
    """Return how rarely chance gives such gains, under a gamma law of a null's mean and variance.

    A form of one number is lucky by a greater factor than one of four: their gains compare so.
    """
    from scipy.special import gammaincc

    mean, variance = float(null.mean()), float(null.var())
    if mean <= 0.0 or variance <= 0.0:
        return np.ones(np.shape(gains))
    return np.asarray(gammaincc(mean**2 / variance, gains * mean / variance))
