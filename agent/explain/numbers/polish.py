"""A whole model's numbers brought together, once it is known which effects it consists of.

The search finds the numbers of one law after the other, beside the others as they stood then. Here
those of all laws are moved together, and a trial point that stood for a coefficient becomes that
coefficient.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library
from agent.explain.choosing.together import together
from agent.explain.rows.evidence import solve
from agent.identify.result import Floats

_PASSES = 2


def polished(library: Library, choice: Choice) -> Choice:
    """Return a choice at the numbers that fit best together; effects and rivals stay.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    """
    candidates: Sequence[Candidate] = choice.candidates
    for _ in range(_PASSES):
        fitted = [
            candidate
            if candidate.form.point_of is None
            else library.candidate(candidate.form, candidate.form.point_of(own))
            for candidate, own in zip(candidates, _coefficients(library, candidates), strict=True)
        ]
        candidates = together(library, fitted)
    terms = tuple(
        replace(term, scored=replace(term.scored, candidate=candidate, coefficients=own))
        for term, candidate, own in zip(
            choice.terms, candidates, _coefficients(library, candidates), strict=True
        )
    )
    return replace(choice, terms=terms, full=library.errors(candidates))


def _coefficients(library: Library, candidates: Sequence[Candidate]) -> list[Floats]:
    """Return every law's coefficients in the fit of all together."""
    columns = library.model(candidates)
    theta = solve(columns.T @ columns, columns.T @ library.target)
    widths = [candidate.columns.shape[1] for candidate in candidates]
    stops = library.base.shape[1] + np.cumsum([0, *widths])
    return [theta[a:b] for a, b in pairwise(stops)]
