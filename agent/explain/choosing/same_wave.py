"""A gear's wobble and a misread motor angle, told apart beside what either might stand for.

Both are a wave that grows with the square of the speed, and differ by little: by what the gear
carries, and by whose inertia swings on the spring. A torque ripple of that order, too small for a
name, is more than that, and so is a torque that is late by a part of a sample: the load and the
spring's damping take of them what they can. Nearly every recording has some of both. Which of the
two laws predicts better is asked where neither has to stand for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from agent.explain.choosing.candidate import Candidate, Scored
from agent.explain.choosing.same_spring import on_one_spring
from agent.explain.choosing.search import Library
from agent.explain.forms.order import BESIDE_A_WAVE
from agent.explain.forms.orders import half_a_line

_OF_ONE_WAVE = frozenset({"kinematic-error", "resolver-error"})


def told_apart(
    library: Library,
    others: Sequence[Candidate],
    ranked: Sequence[Scored],
    arm: Mapping[str, float],
) -> dict[str, Scored]:
    """Return the best form of a wobble and of a misread angle beside `BESIDE_A_WAVE`, by effect.

    Parameters
    ----------
    library : Library
    others : sequence of Candidate
        The model that either would join.
    ranked : sequence of Scored
        Beside the others alone, the best first.
    arm : mapping of str to float
        On which either swings, where the model has one: see `same_spring.arm_of`.

    Returns
    -------
    dict of str to Scored
        The one that predicts unseen data better first; empty where it is not these two that are to
        be told apart.
    """
    best = {s.form.effect: s for s in reversed(ranked) if s.form.effect in _OF_ONE_WAVE}
    if len(best) < len(_OF_ONE_WAVE):
        return {}
    order = min(best.values(), key=lambda s: s.error).candidate.point[0]
    (near,) = half_a_line(library.scene)
    of_order = tuple(
        c
        for c in library.candidates
        if c.form.effect in _OF_ONE_WAVE and abs(c.point[0] - order) <= near
    )
    # A search that has led one of them far from all points that its form began with begins there.
    own = [s.candidate for s in best.values()]
    started = {c.form for c in of_order}
    of_order += tuple(c for c in own if c.form not in started)
    model = [*others, library.candidate(BESIDE_A_WAVE, (order,))]
    again = replace(library, candidates=of_order).rank(model, known=own)
    again = on_one_spring(library, model, again, arm)
    found: dict[str, Scored] = {}
    for scored in again:
        found.setdefault(scored.form.effect, scored)
    return found if len(found) == len(_OF_ONE_WAVE) else {}
