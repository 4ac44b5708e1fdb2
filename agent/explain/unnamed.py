"""What is told of a study whose laws explain too little: the mismatch, without those laws.

A law that is not named is in no number of the answer either. Else a twin would hold what nobody is
told of, an error would have fallen by nothing, and the larger part of a mismatch that has no name
would be missing from where it lies. Nor is a number called wrong that this part may have bent.
"""

from __future__ import annotations

from dataclasses import replace

from agent.explain.numbers.borne_out import borne_out
from agent.explain.numbers.model import extended_twin, fit_model
from agent.explain.study import Study
from agent.explain.verdict import OWN_NUMBERS


def unnamed(found: Study) -> Study:
    """Return a study with the twin's own numbers refitted, and with no law beside them.

    Parameters
    ----------
    found : Study
        Unexplained.
    """
    library = found.library
    terms = tuple(t for t in found.choice.terms if t.scored.form.effect in OWN_NUMBERS)
    model = fit_model(library, found.twin, terms)
    return replace(
        found,
        choice=replace(
            found.choice, terms=terms, full=library.errors([t.candidate for t in terms])
        ),
        model=model,
        numbers=borne_out(found.numbers, library, model, found.floor.value_nm),
        extended=extended_twin(library, found.twin, model),
        left_cells=found.cells,
    )


def own_numbers(told: Study) -> frozenset[str]:
    """Return what of the twin's own numbers is told beside a mismatch without a name.

    Parameters
    ----------
    told : Study
        Without the laws that are not named.
    """
    terms = (term.scored.form.effect for term in told.choice.terms)
    return frozenset((*terms, *(number.effect for number in told.numbers)))
