"""Places of the arm that were found, told as one of another shape where that does as well.

A bell is how a place is looked for: what leans or has a flat top is a bell and what mends it, one
or two more bells or a wave. But a place of any shape also stands for two laws, as a bump beside an
offset. So shapes are no part of the search; when it has ended, one of them is asked in the place
of all places that it found, beside whatever else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from agent.explain.choosing.candidate import Scored, basis_of, gain_of
from agent.explain.choosing.choice import Choice, choose
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.forms.place import SHAPES, shaped_there
from agent.explain.numbers.renewed import left_nm

_OF_A_PLACE = frozenset({"position-dependent-friction", "local-fault"})
_MIDDLE = "center_arm_rad"
_CLEARLY = 0.03  # of what is left: for less a bell is one
_FOLLOWED = 4  # starts of a form
_AS_WELL = 0.002  # of it: one place for several


def chosen_with_its_shape(library: Library, choice: Choice) -> tuple[Library, Choice]:
    """Choose anew beside a place of another shape, where it leaves less than the places found.

    Parameters
    ----------
    library : Library
    choice : Choice
        Not settled yet.

    Returns
    -------
    library, choice
        The same where no place was found, or none of another shape does as well. Else a library
        with the shapes among its candidates.
    """
    at_places = [t for t in choice.terms if _MIDDLE in t.scored.form.nonlinear]
    along = [t for t in choice.terms if t.scored.form.effect in _OF_A_PLACE]
    before = float(choice.full.sum())
    both = (along, at_places) if len(along) > len(at_places) else (at_places,)
    for gone in both if at_places else ():
        rest = [term for term in choice.terms if term not in gone]
        shapes, best = _best_shape(library, rest, at_places)
        most = 1.0 + _AS_WELL if len(gone) > 1 else 1.0 - _CLEARLY
        if best is None or best.error > most * before:
            continue
        among = replace(library, candidates=(*library.candidates, *shapes.candidates))
        again = choose(among, rivals=False, begun=[*rest, Term(best, 0.0)])
        if float(again.full.sum()) <= most * before:
            return among, again
    return library, choice


def _best_shape(
    library: Library, rest: Sequence[Term], found: Sequence[Term]
) -> tuple[Library, Scored | None]:
    """Return places of other shapes, and the one that does best beside some terms; or none.

    They are followed from where the places stand that were found, and from where the most is left
    without those: a bell that is in the way of a leaning place stands beside its steep flank.
    """
    terms = [term.candidate for term in rest]
    scene = replace(library.scene, residual_nm=left_nm(library, terms))
    there = shaped_there([(t.candidate.point[0], t.candidate.point[1]) for t in found])
    own = replace(
        library,
        candidates=tuple(
            library.candidate(form, point)
            for form in SHAPES
            for point in dict.fromkeys((*form.grid(scene), *there))
        ),
    )
    basis = basis_of(own.model(terms))
    left = own.target - basis @ (basis.T @ own.target)
    followed = []
    for form in SHAPES:
        starts = [c for c in own.candidates if c.form is form]
        starts.sort(key=lambda c: -gain_of(c, basis, left))
        followed += [own.deeper(c, basis, left) for c in starts[:_FOLLOWED]]
    ranked = own.rank(terms, known=followed)
    return own, ranked[0] if ranked else None
