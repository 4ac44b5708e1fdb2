"""What is too small for a name and hides in the twin's own numbers: intervals reach over it.

On most strokes a cable or an offset is nearly a sum of gravity's two columns: what of it stands
beyond them is a thousandth of its energy. The residual is silent there, and no other law beside the
model shows it; but the joint may have as much of it as has no name. Such a law is given a size
before the data are asked, normal about none, with the least amount that is worth a name at two
standard deviations (a random effect; Box and Tiao, Bayesian Inference in Statistical Analysis,
1973, section 7.2). What the recordings say of it makes that narrower; what is left of it bends the
numbers that it hides in.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.choosing.candidate import Candidate, basis_of
from agent.explain.choosing.materiality import least_gain
from agent.explain.choosing.search import Library
from agent.explain.numbers.intervals import named_effects
from agent.explain.numbers.model import Model
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.table import BASE
from agent.identify.result import Floats, Parameter

_HIDES = 0.005  # of a law's energy beyond the model's columns: more, and the residual speaks of it
_NORMAL = 1.96


def reaching_over_the_unnamed(library: Library, model: Model) -> Model:
    """Return a model whose own numbers' intervals reach over what hides in them without a name.

    Whether numbers are wrong is known by then: that a cable could make the same torque refutes none
    of them, and says how far they may be off.

    Parameters
    ----------
    library : Library
    model : Model
        With the intervals of `intervals.with_intervals`.
    """
    terms = [term.candidate for term in model.terms]
    columns = library.model(terms)
    # However wrong the simulation's numbers are, the joint's small effects are none the larger.
    least = least_gain(library, library.errors([]), terms)
    residual = model.residual_nm * library.weighing.weight
    size = effective_size(library.scene.table, library.weighing, residual)
    noise = float(residual @ residual) / max(size, 1.0)
    width = library.base.shape[1]
    below, above = np.zeros(width), np.zeros(width)
    inverse = np.linalg.pinv(columns)[:width]
    basis = basis_of(columns)
    for law in _hiding(library.candidates, named_effects(model), basis):
        own = law - basis @ (basis.T @ law)
        known = np.linalg.inv(own.T @ own / noise + np.eye(law.shape[1]) * 4.0 / least)
        bent = -inverse @ law
        middle = bent @ (known @ (own.T @ residual) / noise)
        reach = _NORMAL * np.sqrt(np.einsum("ij,jk,ik->i", bent, known, bent))
        below = np.minimum(below, middle - reach)
        above = np.maximum(above, middle + reach)
    names = np.array(BASE)[library.scene.table.carried].tolist()
    wider = {
        name: _wider(model.base[name], float(below[at]), float(above[at]))
        for at, name in enumerate(names)
    }
    return replace(model, base={**model.base, **wider})


def _hiding(candidates: Sequence[Candidate], named: frozenset[str], basis: Floats) -> list[Floats]:
    """Return the directions of other laws, orthonormal, each (m, k), that the model's copy."""
    out = []
    for candidate in candidates:
        form = candidate.form
        if form.effect in named or form.catch_all:
            continue
        unit = basis_of(candidate.columns)
        within = basis.T @ unit
        cosines, turn = np.linalg.eigh(within.T @ within)
        hides = 1.0 - cosines < _HIDES
        if hides.any():
            out.append(unit @ turn[:, hides])
    return out


def _wider(parameter: Parameter, below: float, above: float) -> Parameter:
    if parameter.ci95 is None:
        return parameter
    value, (low, high) = parameter.value, parameter.ci95
    return replace(
        parameter,
        ci95=(value - math.hypot(value - low, below), value + math.hypot(high - value, above)),
    )
