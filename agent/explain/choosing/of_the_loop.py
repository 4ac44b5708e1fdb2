"""Arms that are none of the joint's: what a recorded simulation did in a loop of its own.

A simulation that followed the command moved otherwise than the joint did, most of all around the
resonance of either loop. What its torque has beside the motion as recorded is then in the mismatch,
and an arm that swings stands for it.
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library
from agent.explain.rows.evidence import solve

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
    own = (simulated - base @ solve(base.T @ base, base.T @ simulated))[:, np.newaxis]
    every = library.model(terms)
    rest = library.model([*terms[:index], *terms[index + 1 :]])
    gain = library.errors_with(rest) - library.errors_with(every)
    beside = library.errors_with(rest, own) - library.errors_with(every, own)
    return float(beside.sum()) < _KEPT * float(gain.sum())
