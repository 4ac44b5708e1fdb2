"""The chosen effects beside the twin's own numbers, fitted together, with intervals.

Linear numbers have a covariance from leaving out blocks of time; non-linear ones the interval over
which the squared error, all else refitted, rises by no more than chance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from agent.explain.choice import Term
from agent.explain.evidence import effective_size
from agent.explain.pieces import known_part
from agent.explain.search import Candidate, Library, basis_of
from agent.explain.table import BASE, Table, effects_nm
from agent.identify.linear import solve_blocks
from agent.identify.result import Floats, Parameter
from agent.physics.twin import Effect, Twin

_LIMIT = 3.84  # chi-square, one degree of freedom, 95 %
_HALVINGS = 14
_NOT_NEGATIVE = ("inertia_kg_m2", "viscous_nm_s_per_rad", "coulomb_nm")


@dataclass(frozen=True)
class Model:
    """Base numbers and effects, fitted together to a library's rows.

    Parameters
    ----------
    base : mapping of str to Parameter
        The twin's own numbers, moved.
    terms : tuple of Term
    parameters : tuple of mapping of str to Parameter
        Of every term.
    spread : ndarray, shape (p, p)
        Covariance of the move of the base numbers and of the coefficients, in the order of the
        columns.
    coefficients : ndarray, shape (p,)
    residual_nm : ndarray, shape (m,)
        At the library's rows.
    """

    base: Mapping[str, Parameter]
    terms: tuple[Term, ...]
    parameters: tuple[Mapping[str, Parameter], ...]
    spread: Floats
    coefficients: Floats
    residual_nm: Floats

    def slices(self) -> tuple[slice, ...]:
        """Return where every term's coefficients stand."""
        first = self.coefficients.shape[0] - sum(len(t.scored.form.linear) for t in self.terms)
        stops = np.cumsum([first, *(len(t.scored.form.linear) for t in self.terms)])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(stops))


def fit_model(library: Library, twin: Twin, terms: Sequence[Term]) -> Model:
    """Fit the twin's numbers and some effects together.

    Parameters
    ----------
    library : Library
    twin : Twin
        As given: its numbers are moved.
    terms : sequence of Term
    """
    columns = library.model([t.candidate for t in terms])
    blocks = np.zeros(columns.shape[0], dtype=np.int64)
    blocks[library.weighing.starts] = 1
    fit = solve_blocks(columns, columns, library.target, np.cumsum(blocks))
    carried = np.sqrt(np.mean(library.scene.table.base**2, axis=0)) > 1e-12
    base = {
        name: Parameter.not_identified("these recordings do not excite it", getattr(twin, name))
        for name in BASE
    }
    for at, name in enumerate(np.array(BASE)[carried].tolist()):
        given = float(getattr(twin, name))
        low, high = (float(x) for x in fit.ci95[at])
        base[name] = Parameter(given + float(fit.theta[at]), (given + low, given + high))
    model = Model(base, tuple(terms), (), fit.covariance, fit.theta, fit.residual)
    parameters = []
    for index, (term, place) in enumerate(zip(terms, model.slices(), strict=True)):
        form = term.scored.form
        own = {
            name: Parameter(float(fit.theta[i]), (float(fit.ci95[i][0]), float(fit.ci95[i][1])))
            for name, i in zip(form.linear, range(place.start, place.stop), strict=True)
        }
        for number, name in enumerate(form.nonlinear):
            own[name] = _profiled(library, terms, index, number)
        parameters.append(own)
    return replace(
        model,
        parameters=tuple(parameters),
        residual_nm=fit.residual / library.weighing.weight,
    )


def _profiled(library: Library, terms: Sequence[Term], index: int, number: int) -> Parameter:
    """Return a non-linear number with its profile interval."""
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
        moved = library.candidate(term.scored.form, tuple(point))
        return _error(moved, basis, left)

    best = error(value)
    size = effective_size(
        library.scene.table, library.weighing, library.residual([t.candidate for t in terms])
    )
    limit = best * math.exp(_LIMIT / size)
    ends = [_crossing(error, value, side, limit) for side in (-1.0, 1.0)]
    if not all(math.isfinite(end) for end in ends):
        return Parameter.not_identified("the squared error hardly depends on it", value)
    return Parameter(value, (min(ends), max(ends)))


def _error(candidate: Candidate, basis: Floats, left: Floats) -> float:
    own = basis_of(
        candidate.columns - basis @ (basis.T @ candidate.columns), like=candidate.columns
    )
    return float(left @ left - np.sum((own.T @ left) ** 2))


def _crossing(error: Callable[[float], float], value: float, side: float, limit: float) -> float:
    """Return where the squared error rises above a limit, by doubling and halving the way."""
    scale = abs(value) if value else 1.0
    step = 0.01 * scale
    inner, outer = value, math.nan
    for _ in range(9):
        trial = value + side * step
        if value > 0.0 and trial <= 0.0:
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
        if abs(outer - inner) < 1e-3 * scale:
            break
        if error(middle) > limit:
            outer = middle
        else:
            inner = middle
    return 0.5 * (inner + outer)


def extended_twin(library: Library, twin: Twin, model: Model) -> Twin:
    """Return the twin with the effects in it and its own numbers moved.

    The base numbers are fitted once more beside what the twin itself makes of the effects, so that
    the twin predicts as well as the model that it was written from.
    """
    scene = library.scene
    entries = list(twin.effects)
    for term, numbers in zip(model.terms, model.parameters, strict=True):
        values = {name: p.value for name, p in numbers.items()}
        entries += [
            Effect(term.scored.form.effect, dict(table))
            for table in term.scored.form.to_twin(scene, values)
        ]
    moved = _moved(twin, {name: p.value for name, p in model.base.items()})
    extended = replace(moved, effects=tuple(entries))
    if not entries:
        return extended
    for _ in range(2):
        # Some effects refer to the base numbers, so that these settle in two rounds.
        delta = _base_beside(scene.table, library, extended)
        extended = _moved(
            extended,
            {name: getattr(extended, name) + d for name, d in zip(BASE, delta, strict=True)},
        )
    return extended


def _moved(twin: Twin, numbers: Mapping[str, float]) -> Twin:
    held = {n: max(v, 0.0) if n in _NOT_NEGATIVE else v for n, v in numbers.items()}
    return replace(
        twin,
        inertia_kg_m2=held["inertia_kg_m2"],
        viscous_nm_s_per_rad=held["viscous_nm_s_per_rad"],
        coulomb_nm=held["coulomb_nm"],
        gravity_sin_nm=held["gravity_sin_nm"],
        gravity_cos_nm=held["gravity_cos_nm"],
    )


def predicted(table: Table, twin: Twin) -> Floats:
    """Return what a twin predicts at a table's rows, filtered as the measured torque, (n,)."""
    plain = table.base @ np.array([getattr(twin, name) for name in BASE])
    if not twin.effects:
        return np.asarray(plain)
    extra = effects_nm(twin, table.runs, table.pieces, table.full)
    return np.asarray(plain + known_part(extra, table.pieces, table.cutoff_hz))


def _base_beside(table: Table, library: Library, twin: Twin) -> Floats:
    """Return the move of a twin's base numbers that fits best beside its effects, shape (5,)."""
    weighing = library.weighing
    left = weighing.weighted(table.measured_nm - predicted(table, twin))
    delta = np.zeros(len(BASE))
    carried = np.sqrt(np.mean(table.base**2, axis=0)) > 1e-12
    good = np.isfinite(left)
    columns = library.base[good]
    scale = np.sqrt(np.mean(columns**2, axis=0))
    delta[carried] = np.linalg.lstsq(columns / scale, left[good], rcond=1e-9)[0] / scale
    return delta
