"""How far a weight may be off where a hose pulls, by whatever law that does.

A hose's law is a curve over the angle, and so is a weight's: what one law of the hose leaves for
the weight another one takes. Where recordings do not say which law it is, they say of the weight
only what all of them leave.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.explain.choosing.candidate import Scored
from agent.explain.choosing.rivals import DECISIVE, Term, behind_of
from agent.explain.choosing.search import Library
from agent.explain.numbers.model import Model
from agent.explain.numbers.resting import is_possible
from agent.explain.numbers.slopes import derivatives_of
from agent.explain.rows.evidence import effective_size, solve
from agent.explain.rows.table import BASE, GRAVITY_AT
from agent.identify.result import Floats, Parameter
from agent.identify.rigid.linear import solve_blocks

_PULL = "cable-force"
_FOLLOWED = 3  # laws that unseen data speak least against


def reaching_over_other_pulls(library: Library, model: Model) -> Model:
    """Return a model whose weight reaches over what other laws of a hose leave of it.

    Parameters
    ----------
    library : Library
    model : Model
        With intervals.
    """
    pulls = [term for term in model.terms if term.scored.form.effect == _PULL]
    weighs = [BASE[at] for at in GRAVITY_AT if library.scene.table.carried[at]]
    if len(pulls) != 1 or not weighs:
        return model
    base = dict(model.base)
    columns = np.array(BASE)[library.scene.table.carried].tolist()
    for scored in _as_likely(library, model, pulls[0]):
        other = replace(pulls[0], scored=scored)
        terms = tuple(other if term is pulls[0] else term for term in model.terms)
        ends = _ends(library, replace(model, terms=terms))
        if ends is not None:
            base |= {name: _over(base[name], ends[columns.index(name)]) for name in weighs}
    return replace(model, base=base)


def _as_likely(library: Library, model: Model, pull: Term) -> list[Scored]:
    """Return a pull by other laws than its own, where unseen data do not decide against them."""
    form, terms = pull.scored.form, [term.candidate for term in model.terms]
    alike = tuple(c for c in library.candidates if c.form.effect == _PULL and c.form is not form)
    if not alike:
        return []
    full = library.errors(terms)
    size = effective_size(library.scene.table, library.weighing, library.residual(terms))
    others = [candidate for candidate in terms if candidate is not pull.candidate]
    return [
        scored
        for scored in replace(library, candidates=alike).rank(others)[:_FOLLOWED]
        if behind_of(full, scored.blocks, size) < DECISIVE
        and is_possible(library, [*others, scored.candidate])
    ]


def _ends(library: Library, model: Model) -> Floats | None:
    """Return the intervals of the twin's own numbers beside a model's terms, shape (p, 2).

    None where there are not enough blocks to leave one out.
    """
    columns = library.model([term.candidate for term in model.terms])
    theta = solve(columns.T @ columns, columns.T @ library.target)
    slopes, _ = derivatives_of(library, replace(model, coefficients=theta))
    block = np.zeros(columns.shape[0], dtype=np.int64)
    block[library.weighing.starts] = 1
    if not slopes.shape[1] < library.weighing.starts.shape[0]:
        return None
    fit = solve_blocks(slopes, slopes, library.target - columns @ theta, np.cumsum(block))
    own = int(np.count_nonzero(library.scene.table.carried))
    given = library.scene.as_given[library.scene.table.carried] + theta[:own]
    return np.asarray(given[:, np.newaxis] + fit.ci95[:own])


def _over(number: Parameter, ends: Floats) -> Parameter:
    """Return a number whose interval holds another one, shape (2,), too."""
    if number.ci95 is None:
        return number
    low, high = number.ci95
    return replace(number, ci95=(min(low, float(ends[0])), max(high, float(ends[1]))))
