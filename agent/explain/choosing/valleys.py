"""A law whose squared error has many valleys, followed from where else its numbers may lie.

An arm in a gap that bounces once more or less stands elsewhere when its teeth meet again, and a
wide gap with a soft contact, or with a film that drags the arm, meets at the instants of another. A
search that goes downhill stays where it began. Once such a law is in the model its form names other
points; from the best of these the search begins anew, for as long as that leads deeper.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.choosing.candidate import Candidate, Scored, basis_of, gain_of
from agent.explain.choosing.search import Library
from agent.explain.forms.form import Point
from agent.explain.rows.evidence import solve
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_ROUNDS = 2
_FOLLOWED = 3  # points
_DEEPER = 1e-3  # of what is left: a round that gains less is the last


def deepest(
    library: Library, terms: Sequence[Candidate], found: Scored, *, far: bool = False
) -> Scored:
    """Return a newcomer at the deepest valley that is found from other points of its form.

    Parameters
    ----------
    library : Library
    terms : sequence of Candidate
        The model so far.
    found : Scored
        As the search left it; returned as it is where its form knows of no other points, or where
        none of them does better on unseen data.
    far : bool
        Whether to look far from where the search ended, too.
    """
    form = found.form
    if form.elsewhere is None:
        return found
    model = library.model(terms)
    basis = basis_of(model)
    left = library.target - basis @ (basis.T @ library.target)
    energy = float(left @ left)
    scene = scene_beside(library, terms)

    def best_of(points: Sequence[Point]) -> list[tuple[float, Candidate]]:
        tried = [Candidate.of(form, point, library.columns(form, point)) for point in points]
        return sorted(((gain_of(c, basis, left), c) for c in tried), key=lambda pair: -pair[0])

    gain, best = best_of([found.candidate.point])[0]
    for _ in range(_ROUNDS):
        starts = best_of(form.elsewhere(scene, best.point, far))[:_FOLLOWED]
        ends = [library.deeper(c, basis, left) for _, c in starts]
        before, far = gain, False
        gain, best = max(
            ((gain, best), *((gain_of(c, basis, left), c) for c in ends)), key=lambda pair: pair[0]
        )
        if gain - before < _DEEPER * (energy - before):
            break
    blocks = library.errors([*terms, best])
    if float(blocks.sum()) >= found.error:
        return found
    return replace(
        found,
        candidate=library.candidate(form, best.point),
        coefficients=coefficients_beside(library, model, best),
        screened=gain / max(energy, 1e-300),
        blocks=blocks,
    )


def coefficients_beside(library: Library, model: Floats, law: Candidate) -> Floats:
    """Return a law's coefficients in the fit beside a model's columns, shape (m, p), as (k,)."""
    columns = np.concatenate((model, law.columns), axis=1)
    return solve(columns.T @ columns, columns.T @ library.target)[model.shape[1] :]


def scene_beside(library: Library, terms: Sequence[Candidate]) -> Scene:
    """Return the scene with what some terms leave as its residual."""
    at_rows = np.zeros(library.scene.table.used.shape[0])
    at_rows[library.weighing.rows] = library.residual(terms) / library.weighing.weight
    return replace(library.scene, residual_nm=library.scene.on_time(at_rows))
