"""A delay that only fast motion shows: what shakes the joint there, and no channel that is late.

Chatter of a structure, or a neighbour that shakes the base, moves the joint, and the drive answers
it late. At that one frequency a late torque looks just like it and explains most of it. Where slow
motion is surely on time nothing is late.
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import DELAY, Library
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
    late = [term for term in choice.terms if term.scored.form.effect == DELAY]
    if not late:
        return set()
    own, form = late[0].candidate, late[0].scored.form
    others = [term.candidate for term in choice.terms if term is not late[0]]
    columns = [own.columns, library.base_beside([own]), *(term.columns for term in others)]
    model = np.concatenate(columns, axis=1)
    delay_s = float(late[0].scored.coefficients[0])
    table, weighing = library.scene.table, library.weighing
    slow = by_slow_motion(table, weighing, model, library.target, delay_s)
    most = abs(slow.value) + _SURELY * slow.error
    return {(form.effect, form.name)} if most < _FAR_SHORT * abs(delay_s) else set()
