"""What chance gives: residuals that follow no axis any more, but keep their autocorrelation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from agent.explain.evidence import Weighing
from agent.explain.search import Candidate, Library, Scored, basis_of
from agent.identify.result import Floats

_SHIFTS = 199


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
    out = np.empty((left.shape[0], count), dtype=np.float32)
    run = weighing.run
    bounds = np.flatnonzero(np.diff(run, prepend=run[0] - 1))
    stops = np.append(bounds[1:], run.shape[0])
    lengths = np.diff(np.append(weighing.starts, run.shape[0]))
    for j in range(count):
        moved = left.copy()
        for a, b in zip(bounds, stops, strict=True):
            moved[a:b] = np.roll(left[a:b], int(rng.integers(0, max(b - a, 1))))
        sign = rng.choice([-1.0, 1.0], lengths.shape[0])
        out[:, j] = moved * np.repeat(sign, lengths)
    return out


def chance(library: Library, terms: Sequence[Candidate], scored: Scored, seed: int = 0) -> float:
    """Return how often shifted residuals give any form as much as this one, from 0 to 1.

    What every form gains is put in units of what it gains by chance on average, so that the best
    of all forms is compared with the best.

    Parameters
    ----------
    library : Library
    terms : sequence of Candidate
        The model that the form would join.
    scored : Scored
    seed : int
    """
    basis = basis_of(library.model(terms))
    left = library.target - basis @ (basis.T @ library.target)
    drawn = shifted(library.weighing, left, seed)
    best_of: dict[tuple[str, str], Floats] = {}
    for candidate in (*library.candidates, scored.candidate):
        own = basis_of(candidate.columns - basis @ (basis.T @ candidate.columns))
        share = np.sum((own.T.astype(np.float32) @ drawn) ** 2, axis=0)
        key = (candidate.form.effect, candidate.form.name)
        best_of[key] = np.maximum(best_of.get(key, np.zeros(_SHIFTS)), share)
    energy = float(left @ left)
    key = (scored.form.effect, scored.form.name)
    means = {k: max(float(v.mean()), 1e-12 * energy) for k, v in best_of.items()}
    worst = np.max([v / means[k] for k, v in best_of.items()], axis=0)
    found = scored.screened * energy / means[key]
    return float((1 + np.sum(worst >= found)) / (1 + _SHIFTS))
