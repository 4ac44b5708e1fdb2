"""A balancer whose levers do not show: a weight, or what has a corner, drawn by a law with a bend.

Its shorter lever nothing, a balancer's spring is a weight; both levers alike, it is a step where it
is shortest. Between the two it bends as many curves do. Where either end of that does as well, or a
weight and a constant torque, the recordings do not show that there are levers; nor where it is a
little of the mismatch, or leaves more than noise, and is hardly better than either end: that is
what other laws leave.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.materiality import noise_energy
from agent.explain.choosing.rivals import DECISIVE, log_density_gap
from agent.explain.choosing.search import Library
from agent.explain.forms.balancer import BALANCERS, LEAST_RATIO, MOST_RATIO
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.table import GRAVITY_AT
from agent.identify.result import Floats

_SMALL = 0.01  # of the mismatch
_FAR = 1.1  # times the noise: what leaves more is not the joint's law
_PLAINLY = 0.1  # of what is left
_CENTERS = 32  # around the turn: a valley at a ratio that is far off lies elsewhere
_ROUNDS = 12  # halvings of the way to the next of them


def unlevered(library: Library, choice: Choice) -> set[tuple[str, str]]:
    """Return effect and name of all balancers, where one was chosen whose levers do not show.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    """
    for term in choice.candidates:
        if term.form in BALANCERS:
            others = [other for other in choice.candidates if other is not term]
            own = library.errors([*others, term])
            left = library.residual([*others, term])
            size = effective_size(library.scene.table, library.weighing, left)
            ends = [_best_at(library, others, term, ratio) for ratio in (LEAST_RATIO, MOST_RATIO)]
            removed = float((library.errors(others) - own).sum())
            is_little = removed < _SMALL * float(choice.plain.sum())
            noise = noise_energy(library, [*others, term])
            leaves_more = float(own.sum()) > _FAR**2 * noise
            nearest = min(float((end - own).sum()) for end in ends)
            weight = library.errors_with(library.model(others), _weight_and_constant(library))
            if any(log_density_gap(own, left, size) < DECISIVE for left in (*ends, weight)) or (
                (is_little or leaves_more) and nearest < _PLAINLY * float(own.sum())
            ):
                return {(form.effect, form.name) for form in BALANCERS}
    return set()


def _weight_and_constant(library: Library) -> Floats:
    """Return the weighted columns of a weight, and of a constant torque, shape (m, 3)."""
    rows, weight = library.weighing.rows, library.weighing.weight[:, np.newaxis]
    gravity = library.scene.table.base[np.ix_(rows, GRAVITY_AT)]
    return np.asarray(weight * np.column_stack((gravity, np.ones(rows.shape[0]))))


def _best_at(
    library: Library, others: Sequence[Candidate], term: Candidate, ratio: float
) -> Floats:
    """Return what the same law leaves on unseen blocks with other levers, shape (b,)."""

    def errors(center: float) -> Floats:
        columns = library.columns(term.form, (ratio, center))
        return library.errors_with(library.model(others), columns)

    def left(center: float) -> float:
        return float(errors(center).sum())

    step = 2.0 * math.pi / _CENTERS
    best = min((term.point[1] + k * step for k in range(_CENTERS)), key=left)
    for _ in range(_ROUNDS):
        step *= 0.5
        best = min((best - step, best, best + step), key=left)
    return errors(best)
