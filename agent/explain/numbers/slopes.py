"""By how much a model's prediction changes with each of its numbers."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.forms.refinement import limits_of, steps_of
from agent.explain.numbers.model import Model
from agent.identify.result import Floats

_NUDGE = 0.1  # of a non-linear number's first step: what bounces has no slope on a finer scale


def derivatives_of(library: Library, model: Model) -> tuple[Floats, Mapping[tuple[int, int], int]]:
    """Return the prediction's weighted derivatives by every number, shape (m, p).

    And, for every non-linear number that may be moved (term, number), where its column stands.
    """
    columns = [library.model([t.candidate for t in model.terms])]
    places: dict[tuple[int, int], int] = {}
    width = columns[0].shape[1]
    for index, (term, place) in enumerate(zip(model.terms, model.slices(), strict=True)):
        if not term.scored.form.refine or term.scored.form.point_of is not None:
            continue
        for number in range(len(term.candidate.point)):
            slope = _slope(library, term, number, model.coefficients[place])
            if not slope.any():
                continue
            columns.append(slope[:, np.newaxis])
            places[index, number] = width + len(places)
    return np.concatenate(columns, axis=1), places


def _slope(library: Library, term: Term, number: int, coefficients: Floats) -> Floats:
    """Return the derivative of a term's weighted torque by a non-linear number, shape (m,)."""
    form, point = term.scored.form, term.candidate.point
    grid = np.array([c.point for c in library.candidates if c.form is form])
    if not grid.size:
        return np.zeros(library.target.shape[0])
    nudge = _NUDGE * steps_of(form, library.scene, grid)[number](point[number])
    low, high = limits_of(form, library.scene, grid)[number]
    ends = max(point[number] - nudge, low), min(point[number] + nudge, high)
    if ends[1] <= ends[0]:
        return np.zeros(library.target.shape[0])
    before, after = (
        library.candidate(form, (*point[:number], end, *point[number + 1 :])) for end in ends
    )
    return np.asarray((after.columns - before.columns) @ coefficients / (ends[1] - ends[0]))
