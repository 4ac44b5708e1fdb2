"""Laws whose numbers are moved together: a whole model's, or those of terms beside a newcomer.

A strong law found first has its numbers from a fit without the law that is found next. A spot that
friction under load had moved by a fifth of a degree leaves more there than the load's friction
itself removes; another law, with numbers of its own, makes up for it, and would be taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.choosing.candidate import Candidate, Scored, basis_of, gain_of
from agent.explain.choosing.descent import descended, movable
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.rows.evidence import solve
from agent.identify.result import Floats

_ROUNDS = 6
_NEAR = 3.0  # times the best's error on unseen data: a newcomer that is further off stays behind
_MOST = 3  # newcomers
_BETTER = 0.8  # of the best's error, both beside moved terms: then their numbers had hidden it
_AS_SIMPLE = 0.97  # or this, for a law of no more numbers


def together(library: Library, candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the same laws at the points to which all their numbers lead together."""
    forms = [candidate.form for candidate in candidates]
    numbers = []
    for law, form in enumerate(forms):
        grid = np.array([c.point for c in library.candidates if c.form is form])
        numbers += movable(law, form, library.scene, grid)
    points = descended(
        [candidate.point for candidate in candidates],
        numbers,
        lambda law, point: library.columns(forms[law], point),
        library.base_beside(candidates),
        library.target,
        lambda law, own: forms[law].allows(own),
        _ROUNDS,
    )
    return [library.candidate(form, point) for form, point in zip(forms, points, strict=True)]


def newcomer_beside_moved(
    library: Library, terms: Sequence[Term], ranked: Sequence[Scored], best: Scored
) -> tuple[list[Term], Scored]:
    """Return the terms and the newcomer, another one where the terms' numbers had hidden it.

    Parameters
    ----------
    library : Library
    terms : sequence of Term
        The model so far.
    ranked : sequence of Scored
        Newcomers beside the terms as they stand, the best on unseen data first.
    best : Scored
        The one that would be taken.
    """
    first_of = {best.form.effect: best}
    for scored in ranked:
        if scored.error <= _NEAR * best.error and len(first_of) < _MOST:
            first_of.setdefault(scored.form.effect, scored)
    if not terms or len(first_of) == 1:
        return list(terms), best
    old = [term.candidate for term in terms]
    errors = {}
    for effect, scored in first_of.items():
        moved = together(library, [*old, scored.candidate])
        errors[effect] = moved, library.errors(moved)
    chosen = min(errors, key=lambda effect: float(errors[effect][1].sum()))
    moved, blocks = errors[chosen]
    asked = _AS_SIMPLE if first_of[chosen].form.size <= best.form.size else _BETTER
    if float(blocks.sum()) > asked * float(errors[best.form.effect][1].sum()):
        return list(terms), best
    return _as_moved(library, terms, first_of[chosen], moved, blocks)


def both_moved(
    library: Library, terms: Sequence[Term], newcomer: Scored
) -> tuple[list[Term], Scored]:
    """Return the terms and a newcomer with all their numbers moved together.

    Parameters
    ----------
    library : Library
    terms : sequence of Term
        The model so far.
    newcomer : Scored
        Beside them.
    """
    moved = together(library, [*(term.candidate for term in terms), newcomer.candidate])
    return _as_moved(library, terms, newcomer, moved, library.errors(moved))


def _as_moved(
    library: Library,
    terms: Sequence[Term],
    newcomer: Scored,
    moved: Sequence[Candidate],
    blocks: Floats,
) -> tuple[list[Term], Scored]:
    """Return terms and newcomer at the candidates that stand for them, the newcomer's the last."""
    rest = library.model(moved[:-1])
    basis = basis_of(rest)
    left = library.target - basis @ (basis.T @ library.target)
    columns = np.concatenate((rest, moved[-1].columns), axis=1)
    own = solve(columns.T @ columns, columns.T @ library.target)[rest.shape[1] :]
    beside = replace(
        newcomer,
        candidate=moved[-1],
        coefficients=own,
        screened=gain_of(moved[-1], basis, left) / max(float(left @ left), 1e-300),
        blocks=blocks,
    )
    kept = [
        replace(term, scored=replace(term.scored, candidate=candidate))
        for term, candidate in zip(terms, moved, strict=False)
    ]
    return kept, beside
