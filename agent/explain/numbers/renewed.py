"""What a model leaves, and what that suggests: orders, gaps and places to look for beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats


def left_nm(library: Library, terms: Sequence[Candidate]) -> Floats:
    """Return what terms leave at the table's rows, shape (n,); 0 where a row is not used."""
    left = np.zeros(library.scene.table.used.shape[0])
    left[library.weighing.rows] = library.residual(terms) / library.weighing.weight
    return left


def with_new_grids(library: Library, terms: Sequence[Candidate]) -> Library:
    """Return a library with what terms leave suggests beside what was suggested before.

    What a joint has once, as its gap, is looked for in what is left without it.
    """
    forms = dict.fromkeys(c.form for c in library.candidates if c.form.from_residual)
    there = {(c.form, c.point) for c in library.candidates}
    new = []
    for form in forms:
        others = [t for t in terms if not (form.at_edges and t.form.effect == form.effect)]
        scene = library.scene
        scene = replace(scene, residual_nm=scene.on_time(left_nm(library, others)))
        new += [library.candidate(form, p) for p in form.grid(scene) if (form, p) not in there]
    # Candidates of one form stand side by side.
    ordered = sorted((*library.candidates, *new), key=lambda c: (c.form.effect, c.form.name))
    return replace(library, candidates=tuple(ordered))


def retaken(library: Library, term: Term, before: Scene) -> Term:
    """Return a term of another scene with its columns as the library has them now."""
    form = term.scored.form
    own = library.candidate(form, form.carried_over(before, library.scene, term.candidate.point))
    return replace(term, scored=replace(term.scored, candidate=own))
