"""Another form of an effect that is in the model already, in that one's place.

The first term's form was chosen beside all that was still missing: friction that settles as a
straight line, while a spot along the path is not known. Beside the spot what the line lacks hides
the next effect; and no joint has the same effect, or its one arm, twice, so that the better form
could not come in beside the worse one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from agent.explain.choosing.candidate import Scored
from agent.explain.choosing.materiality import worth
from agent.explain.choosing.preferred import preferred
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.choosing.valleys import deepest
from agent.identify.result import Floats
from agent.physics.effects.library import CARRIED


def exchanged(
    library: Library,
    terms: Sequence[Term],
    current: Floats,
    ranked: Sequence[Scored],
    least_left: float,
    needed: tuple[float, float],
) -> list[Term] | None:
    """Return the terms with a better form in the place of one; None where none is worth it.

    Parameters
    ----------
    library : Library
    terms : sequence of Term
        The model so far.
    current : ndarray, shape (b,)
        What it leaves of unseen blocks, squared.
    ranked : sequence of Scored
        All forms beside it, the best on unseen data first, those of its own effects among them.
    least_left : float
        Squared error on unseen data beside the best newcomer that may enter: a form that does not
        leave less is not looked at.
    needed : tuple of float
        What a term must remove to be worth its name, and what noise alone makes: a form must leave
        so much less than the one that it replaces.
    """
    tried: set[int] = set()
    for scored in ranked:
        if not scored.error < least_left:
            break
        index = next((i for i, t in enumerate(terms) if _one_of(t, scored)), None)
        if index is None or index in tried:
            continue
        tried.add(index)
        others = [t.candidate for i, t in enumerate(terms) if i != index]
        alike = tuple(c for c in library.candidates if c.form.effect in _effects(terms[index]))
        # What called for the exchange lies where a search from the grid may not end.
        again = replace(library, candidates=alike).rank(others, known=[scored.candidate])
        best = preferred(library, again, float(library.errors(others).sum()))
        if best is None or best.form is terms[index].scored.form:
            continue
        best = deepest(library, others, best, far=True)
        if worth(current, best.blocks, *needed) >= 0.0:
            new = replace(terms[index], scored=best)
            return [new if i == index else term for i, term in enumerate(terms)]
    return None


def _effects(term: Term) -> frozenset[str]:
    """Return the effects of which a joint has one in all, a term's among them."""
    effect = term.scored.form.effect
    return frozenset(CARRIED) if effect in CARRIED else frozenset({effect})


def _one_of(term: Term, scored: Scored) -> bool:
    """Return whether a form would stand for what a term stands for, in another form."""
    return scored.form is not term.scored.form and scored.form.effect in _effects(term)
