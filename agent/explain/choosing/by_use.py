"""Whether friction that changes goes by the clock, or by use, and what would tell."""

from __future__ import annotations

from dataclasses import replace

from agent.explain.choosing.choice import Choice
from agent.explain.choosing.rivals import DECISIVE, behind_of
from agent.explain.choosing.search import Library
from agent.explain.forms.form import Form
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.use import OPERATING, TURNED

_EFFECT = "friction-drift"
_CLOCK, _OPERATION, _TURNS = "the clock", "the time of operation", "the motor's turns"
_REST = (
    "drive the same cycle once more after a rest, and once more after much motion without a rest"
)
_COUNTED = "only what was recorded counts, and nothing of what the joint did in between"
_FAST = "drive for equally long once fast and once slowly, with the same cycle before and after"


def clock_or_use(library: Library, choice: Choice) -> str:
    """Return what is to be borne in mind of friction that changes; nothing where it does not.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    """
    of_age = [i for i, term in enumerate(choice.terms) if term.scored.form.effect == _EFFECT]
    if not of_age:
        return ""
    index, term = of_age[0], choice.terms[of_age[0]]
    best, goes_by = term.scored, _measure(term.scored.form)
    others = [t.candidate for i, t in enumerate(choice.terms) if i != index]
    drifts = tuple(c for c in library.candidates if c.form.effect == _EFFECT)
    ranked = replace(library, candidates=drifts).rank(others, known=[term.candidate])
    size = effective_size(
        library.scene.table, library.weighing, library.residual([*others, best.candidate])
    )
    too = []
    for rival in ranked:
        measure = _measure(rival.form)
        if measure == goes_by or measure in too:
            continue
        if behind_of(best.blocks, rival.blocks, size) < DECISIVE:
            too.append(measure)
    counted = "" if goes_by == _CLOCK else f"; {_COUNTED}"
    if too:
        decide = _REST if _CLOCK in (goes_by, *too) else _FAST
        return (
            f"friction is taken to change with {goes_by}, and these recordings do not rule out "
            f"{' or '.join(too)}, which would go on differently: to decide, {decide}{counted}"
        )
    if not counted:
        return ""
    return f"friction changes with {goes_by} and not with the clock{counted}"


def _measure(form: Form) -> str:
    """Return what a form of drift goes by."""
    if TURNED in form.needs:
        return _TURNS
    return _OPERATION if OPERATING in form.needs else _CLOCK
