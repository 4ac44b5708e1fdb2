"""Arms that are none of the joint's: what a recorded simulation did in a loop of its own.

A simulation that followed the command moved otherwise than the joint did, most of all around the
resonance of either loop. What its torque has beside the motion as recorded is then in the mismatch,
and an arm that swings stands for it.
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library
from agent.explain.rows.evidence import heldout, moments, solve
from agent.identify.result import Floats

_KEPT = 0.5  # of what an arm removes, beside what the simulation did by itself


def is_the_loops(library: Library, choice: Choice, index: int) -> bool:
    """Return whether what a recorded simulation did by itself stands for most of an arm.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    index : int
        Of the arm's term.
    """
    table = library.scene.table
    if not table.simulated:
        return False
    base, terms = library.base, choice.candidates
    simulated = library.weighing.weighted(table.given_nm)
    own = simulated - base @ solve(base.T @ base, base.T @ simulated)
    every = library.model(terms)
    rest = library.model([*terms[:index], *terms[index + 1 :]])
    gain = _error(library, rest) - _error(library, every)
    return _error(library, rest, own) - _error(library, every, own) < _KEPT * gain


def _error(library: Library, columns: Floats, *more: Floats) -> float:
    """Return the squared error on unseen data of a model, with columns of one number more."""
    own = (column[:, np.newaxis] for column in more)
    part = moments(np.concatenate((columns, *own), axis=1), library.target, library.weighing.starts)
    return float(heldout(part, library.weighing.fold).sum())
