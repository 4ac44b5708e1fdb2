"""A gap whose arm floats while speeds are held: what it removes there is noise, and no clearance.

An arm without friction behind a gap is not felt while nothing accelerates. The measured velocity's
noise, differentiated and multiplied by that arm's inertia, then goes out of the prediction, and a
joint without play is predicted better for it, on unseen data, too. Play shows where the load on
the gear changes sides.
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.choice import Choice
from agent.explain.choosing.heard import BACKLASH, heard
from agent.explain.choosing.search import Library
from agent.explain.rows.strata import STEADY

_MOSTLY = 0.5  # of what it removes; of play that is there it is a tenth at most


def afloat(library: Library, choice: Choice) -> set[tuple[str, str]]:
    """Return effect and form of the gaps that remove next to nothing where the speed changes.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    """
    held = library.scene.table.stratum[library.weighing.rows] == STEADY
    terms = choice.candidates
    out = set()
    for term in terms:
        if term.form.effect != BACKLASH or heard(library.scene, term.form):
            continue
        without = library.residual([other for other in terms if other is not term])
        removed = without**2 - library.residual(terms) ** 2
        if float(np.sum(removed[held])) > _MOSTLY * float(np.sum(removed)) > 0.0:
            out.add((term.form.effect, term.form.name))
    return out
