"""Numbers that recordings do not tell, at what is typical of their law: what follows from them may.

A short warm-up says how fast friction falls with temperature, and not how that rate changes; the
best fit is then as good at any decay, and carried on to a warmer day it is worth nothing.
"""

from __future__ import annotations

from dataclasses import replace

from agent.explain.choosing.choice import Choice
from agent.explain.choosing.rivals import DECISIVE, Term, behind_of
from agent.explain.choosing.search import Library
from agent.explain.numbers.model import Model
from agent.explain.rows.evidence import effective_size


def at_typical(library: Library, choice: Choice, model: Model) -> Choice:
    """Return a choice whose laws stand at their typical numbers where these are not identified.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    model : Model
        Of it, with intervals.

    Returns
    -------
    Choice
        The same where every such number is identified, or where unseen data speak against it.
    """
    terms = tuple(
        _at_typical(library, term)
        if term.scored.form.typical and not _all_known(term, model, index)
        else term
        for index, term in enumerate(choice.terms)
    )
    if terms == choice.terms:
        return choice
    full = library.errors([term.candidate for term in terms])
    size = effective_size(
        library.scene.table, library.weighing, library.residual(choice.candidates)
    )
    if behind_of(choice.full, full, size) >= DECISIVE:
        return choice
    return replace(choice, terms=terms, full=full)


def _all_known(term: Term, model: Model, index: int) -> bool:
    numbers = model.parameters[index]
    return all(numbers[name].identified for name in term.scored.form.nonlinear if name in numbers)


def _at_typical(library: Library, term: Term) -> Term:
    form = term.scored.form
    own = library.candidate(form, form.typical)
    return replace(term, scored=replace(term.scored, candidate=own))
