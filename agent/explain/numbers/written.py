"""Whether a law that was found is the same torque once it is written into a twin.

The search has a law's columns beside the others as they stood; the twin computes it from its own
numbers. Where a law has run away, as friction under a load nearly as large as the load, its torque
rests on itself, and what describes the recordings as a column is another torque as a law.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.explain.choosing.candidate import basis_of
from agent.explain.choosing.search import Library
from agent.explain.numbers.model import Model, entries_of, left_by, predicted
from agent.explain.rows.beginnings import begun
from agent.explain.rows.forgetting import forgetting
from agent.identify.result import Floats
from agent.physics.twin import Twin

_KEPT = 0.5  # of the rows: with fewer, beginnings are compared as well


def not_as_found(
    library: Library, twin: Twin, model: Model, extended: Twin
) -> set[tuple[str, str]]:
    """Return effect and form of the law that spoils a written twin; nothing where it is of use.

    Parameters
    ----------
    library : Library
    twin : Twin
        As given.
    model : Model
        As it was found.
    extended : Twin
        The twin that is written of it: of use as long as it leaves less than the twin without any
        law, its numbers refitted. How its arm swings as a recording begins it cannot know.
    """
    table, weighing = library.scene.table, library.weighing
    left = left_by(extended, table)[weighing.rows]
    plain = library.residual([]) / weighing.weight
    arm = forgetting(extended)
    known = np.ones_like(left, dtype=np.bool_)
    if arm is not None:
        apart = ~begun(table, arm)[weighing.rows]
        known = apart if np.mean(apart) > _KEPT else known
    written = []
    for index, place in enumerate(model.slices()):
        if entries_of(library, model, index):
            written.append((index, place))
        else:  # of some recordings alone: no twin has it
            own = model.terms[index].candidate.columns @ model.coefficients[place]
            left = left - own / weighing.weight
    if not written or _rms(left[known]) <= _rms(plain[known]):
        return set()
    bare = replace(extended, effects=twin.effects)
    without = predicted(table, bare)
    basis = basis_of(library.base)  # a law's mean level may stand in the twin's own numbers
    off = []
    for index, place in written:
        alone = replace(bare, effects=(*twin.effects, *entries_of(library, model, index)))
        another = weighing.weighted(predicted(table, alone) - without)
        another -= model.terms[index].candidate.columns @ model.coefficients[place]
        another[~np.isfinite(another)] = 0.0
        off.append(_rms(another - basis @ (basis.T @ another)))
    form = model.terms[written[int(np.argmax(off))][0]].scored.form
    return {(form.effect, form.name)}


def _rms(torque_nm: Floats) -> float:
    return float(np.sqrt(np.nanmean(torque_nm**2)))
