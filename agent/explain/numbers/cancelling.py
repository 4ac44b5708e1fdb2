"""Two laws whose torques nearly cancel: what is left of them is known, and neither of them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

from agent.explain.choosing.candidate import basis_of
from agent.explain.choosing.search import Library
from agent.explain.numbers.model import Model

_LEFT = 0.5  # of the smaller one's energy, or less


def cancelled_by(library: Library, model: Model) -> Mapping[int, int]:
    """Return which terms are nearly cancelled, by index, and by which other one.

    A hose's pull and a weight that is too small both follow the arm. On a short stroke any share of
    the one may be made up for by the other, and a form that is not quite the joint's decides how
    much. What the twin's own numbers take up counts for neither.

    Parameters
    ----------
    library : Library
    model : Model
    """
    basis = basis_of(library.base)
    torques = []
    for term, where in zip(model.terms, model.slices(), strict=True):
        weighted = term.candidate.columns @ model.coefficients[where]
        torques.append(weighted - basis @ (basis.T @ weighted))
    out: dict[int, int] = {}
    for i, j in combinations(range(len(torques)), 2):
        both = torques[i] + torques[j]
        smaller = min(float(torques[i] @ torques[i]), float(torques[j] @ torques[j]))
        if float(both @ both) < _LEFT * smaller:
            out.setdefault(i, j)
            out.setdefault(j, i)
    return out
