"""Means of half a second: what slow noise is seen by, and how many of them tell something new."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agent.explain.rows.pieces import Piece
from agent.identify.result import Floats

MEAN_S = 0.5
_LONGEST = 20  # means: so far a correlation is followed
_ALIKE = 0.1  # correlation: less is none
_FEWEST_PAIRS = 20
_FEWEST = 10


def half_seconds(values: Floats, piece: Piece) -> Floats:
    """Return a stretch's means of half a second, shape (k,); NaN where half of one is not known.

    Parameters
    ----------
    values : ndarray, shape (n,)
        At the stretch's rows; NaN where they are not known.
    piece : Piece
    """
    length = max(1, round(MEAN_S / (piece.period_s * piece.stride)))
    count = values.shape[0] // length
    parts = values[: count * length].reshape(count, length)
    known = np.isfinite(parts)
    enough = known.sum(axis=1) >= 0.5 * length
    means = np.full(count, np.nan)
    means[enough] = np.nanmean(parts[enough], axis=1)
    return means


def worth_of(means: Sequence[Floats]) -> float:
    """Return how many means that tell nothing of each other these are worth; 0 for hardly any.

    Parameters
    ----------
    means : sequence of ndarray, shape (k,)
        Of stretches, one after the other in time; NaN where one is not known.
    """
    known = np.concatenate(means)
    known = known[np.isfinite(known)]
    if known.shape[0] < _FEWEST:
        return 0.0
    centred = [own - known.mean() for own in means]
    together = 1.0
    for lag in range(1, _LONGEST + 1):
        products = np.concatenate([own[lag:] * own[:-lag] for own in centred])
        products = products[np.isfinite(products)]
        if products.shape[0] < _FEWEST_PAIRS:
            break
        alike = float(products.mean()) / max(float(known.var()), 1e-300)
        if alike < _ALIKE:
            break
        together += 2.0 * alike
    return float(known.shape[0] / together)
