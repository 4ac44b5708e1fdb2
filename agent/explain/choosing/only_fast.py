"""A delay that only fast motion shows: what shakes the joint there, and no channel that is late.

Chatter of a structure, or a neighbour that shakes the base, moves the joint, and the drive answers
it late. At that one frequency a late torque looks just like it and explains most of it. Where slow
motion is surely on time nothing is late.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agent.explain.choosing.candidate import Candidate, basis_of
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library
from agent.explain.choosing.weighted import DELAY
from agent.explain.rows.slow_motion import by_slow_motion

_SURELY = 2.0  # standard errors
_FAR_SHORT = 0.5  # of the delay


def only_fast(library: Library, choice: Choice) -> set[tuple[str, str]]:
    """Return effect and form of a delay that slow motion surely does not have, nor half of it.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    """
    terms = choice.candidates
    return {
        (late.form.effect, late.form.name)
        for late in terms
        if late.form.effect == DELAY
        and is_only_fast(library, late, [term for term in terms if term is not late])
    }


def is_only_fast(library: Library, late: Candidate, others: Sequence[Candidate]) -> bool:
    """Return whether slow motion surely has not half of a delay that is found beside other terms.

    Parameters
    ----------
    library : Library
    late : Candidate
        Of the delay.
    others : sequence of Candidate
    """
    own = [late.columns, library.base_beside([late])]
    model = np.concatenate([*own, *(term.columns for term in others)], axis=1)
    basis = basis_of(model[:, 1:])
    column = late.columns[:, 0] - basis @ (basis.T @ late.columns[:, 0])
    delay_s = float(column @ library.target) / float(column @ column)
    table, weighing = library.scene.table, library.weighing
    slow = by_slow_motion(table, weighing, model, library.target, delay_s)
    return abs(slow.value) + _SURELY * slow.error < _FAR_SHORT * abs(delay_s)
