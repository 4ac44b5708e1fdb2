"""Which share of the mismatch an effect carries, on data that its fit had not seen.

In N m squared while the joint slides, every row alike: what an effect removes there, over what the
refitted twin leaves above the noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agent.explain.choosing.materiality import CLOSE
from agent.explain.choosing.search import Candidate, Library
from agent.explain.rows.evidence import unseen
from agent.identify.result import Floats


def unseen_nm2(library: Library, columns: Floats) -> float:
    """Return the mean square that a model leaves of unseen rows while sliding, N m squared.

    Parameters
    ----------
    library : Library
    columns : ndarray, shape (m, p)
        Weighted; none for the twin as given.
    """
    weighing = library.weighing
    left = unseen(columns, library.target, weighing) / weighing.weight
    slides = library.scene.table.sliding[weighing.rows]
    return float(np.mean(left[slides] ** 2)) if slides.any() else float(np.mean(left**2))


def shares_of(library: Library, terms: Sequence[Candidate], floor_nm: float) -> tuple[float, ...]:
    """Return the share of the mismatch that each term removes beside the others, 0 to 1.

    Parameters
    ----------
    library : Library
    terms : sequence of Candidate
    floor_nm : float
        The noise; 0 where it is not known.
    """
    plain = unseen_nm2(library, library.base)
    full = unseen_nm2(library, library.model(terms))
    above = above_noise(plain, full, floor_nm)
    out = []
    for index in range(len(terms)):
        others = [*terms[:index], *terms[index + 1 :]]
        without = unseen_nm2(library, library.model(others))
        out.append(min(max((without - full) / above, 0.0), 1.0) if above > 0.0 else 0.0)
    return tuple(out)


def above_noise(before: float, after: float, floor_nm: float) -> float:
    """Return the part of a mean square that is mismatch, N m squared.

    Noise is at least the floor. What a model leaves close above the floor is noise as well: slow
    noise, which no floor measured within half a second contains.

    Parameters
    ----------
    before, after : float
        Mean squares without and with the model, N m squared.
    floor_nm : float
    """
    noise = min(max(after, floor_nm**2), (CLOSE * floor_nm) ** 2) if floor_nm > 0.0 else 0.0
    return max(before - noise, before - after)
