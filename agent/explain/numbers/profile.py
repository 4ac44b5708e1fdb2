"""Non-linear numbers: the interval over which the squared error rises by no more than chance.

The likelihood ratio against its chi-square quantile, at as many samples as are independent (Bates
and Watts, Nonlinear Regression Analysis, 1988, section 6.1).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from agent.explain.choosing.candidate import Candidate, basis_of
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.rows.evidence import effective_size
from agent.identify.result import Floats, Parameter

_LIMIT = 3.84  # chi-square, one degree of freedom, 95 %
_HALVINGS = 14
_CLOSE = 0.05  # of the way to an interval's end: nobody reads that more exactly


def profiled(
    library: Library,
    terms: Sequence[Term],
    index: int,
    number: int,
    at_least: tuple[float, float] | None = None,
) -> Parameter:
    """Return a non-linear number with its profile interval.

    Parameters
    ----------
    library : Library
    terms : sequence of Term
    index, number : int
        Which term, and which of its non-linear numbers. The term's coefficients, the other terms
        and the twin's numbers are fitted again at every trial.
    at_least : (float, float), optional
        An interval that is known already: the profile is followed only where it reaches further.
    """
    term = terms[index]
    value = float(term.candidate.point[number])
    if not term.scored.form.refine:
        return Parameter(value, None, identified=True)
    others = library.model([t.candidate for i, t in enumerate(terms) if i != index])
    basis = basis_of(others)
    left = library.target - basis @ (basis.T @ library.target)

    def error(at: float) -> float:
        point = list(term.candidate.point)
        point[number] = at
        with np.errstate(over="ignore", invalid="ignore"):  # told by what comes out
            moved = library.candidate(term.scored.form, tuple(point))
            if not np.isfinite(moved.columns).all():
                return math.inf  # so far off that its own law overflows: it fits nothing
            return _error(moved, basis, left)

    best = error(value)
    size = effective_size(
        library.scene.table, library.weighing, library.residual([t.candidate for t in terms])
    )
    limit = best * math.exp(_LIMIT / size)
    known = at_least or (value, value)
    form, scene = term.scored.form, library.scene
    reach = (-math.inf, math.inf) if form.limits is None else form.limits(scene)[number]
    ends = [
        _crossing(error, value, side, limit, end, reach)
        for side, end in zip((-1.0, 1.0), known, strict=True)
    ]
    if not all(math.isfinite(end) for end in ends):
        return Parameter.not_identified("the squared error hardly depends on it", value)
    return Parameter(value, (min(*ends, known[0]), max(*ends, known[1])))


def _error(candidate: Candidate, basis: Floats, left: Floats) -> float:
    own = basis_of(
        candidate.columns - basis @ (basis.T @ candidate.columns), like=candidate.columns
    )
    return float(left @ left - np.sum((own.T @ left) ** 2))


def _crossing(
    error: Callable[[float], float],
    value: float,
    side: float,
    limit: float,
    known: float,
    reach: tuple[float, float],
) -> float:
    """Return where the squared error rises above a limit, by doubling and halving the way.

    Or `known`, an end on that side, where the error is above the limit there. What lies beyond
    `reach` is not tried: a spring that is rigid in the band only takes ever longer to simulate.
    """
    step = 0.01 * (abs(value) if value else 1.0)
    inner, outer = value, math.nan
    if side * (known - value) > 0.0 and not known <= 0.0 < value:
        if error(known) > limit:
            return known
        inner, step = known, max(step, 2.0 * abs(known - value))
    for _ in range(9):
        trial = value + side * step
        if (value > 0.0 and trial <= 0.0) or not reach[0] <= trial <= reach[1]:
            return math.nan
        if error(trial) > limit:
            outer = trial
            break
        inner = trial
        step *= 2.0
    if math.isnan(outer):
        return math.nan
    for _ in range(_HALVINGS):
        middle = 0.5 * (inner + outer)
        if abs(outer - inner) < _CLOSE * abs(outer - value):
            break
        if error(middle) > limit:
            outer = middle
        else:
            inner = middle
    return 0.5 * (inner + outer)
