"""With which effect a model begins: what is best alone need not be best with another.

A wide bump may copy an offset and the friction under a load better than either does alone. Beside
it neither enters any more: each makes up for what the bump has from the other. So pairs are looked
at where a model that began with the best leaves far more than noise.
"""

from __future__ import annotations

from agent.explain.choosing.candidate import Scored
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.entry import Asked, accident_of
from agent.explain.choosing.materiality import worth
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library

_BEGINNINGS = 6  # effects
_BETTER = 0.95  # of the best pair's error that the first beginning leads to


def other_beginning(library: Library, choice: Choice) -> Term | None:
    """Return an effect that leaves less with one other than a whole model does; None for none.

    Parameters
    ----------
    library : Library
    choice : Choice
        As it began with the best effect.
    """
    first_of: dict[str, Scored] = {}
    for scored in library.rank([]):
        asked = Asked.of(library, choice.plain, [scored.candidate])
        if worth(choice.plain, scored.blocks, *asked) >= 0.0 and len(first_of) < _BEGINNINGS:
            first_of.setdefault(scored.form.effect, scored)
    pairs = {}
    for effect, scored in first_of.items():
        beside = library.rank([scored.candidate], refined=False)
        pairs[effect] = beside[0].error if beside else scored.error
    began = choice.terms[0].scored.form.effect
    limit = min(_BETTER * pairs.get(began, float("inf")), float(choice.full.sum()))
    for effect in sorted(pairs, key=lambda effect: pairs[effect]):
        if pairs[effect] >= limit:
            break
        scored = first_of[effect]
        chance = accident_of(library, [], choice.plain, scored)
        if chance is not None:
            return Term(scored, chance)
    return None
