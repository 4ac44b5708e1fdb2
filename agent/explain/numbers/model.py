"""The chosen effects beside the twin's own numbers, fitted together, and the twin with them.

Linear numbers come with a covariance from leaving out blocks of time: how far they may be from the
truth is the story of `intervals`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.rows.pieces import known_part
from agent.explain.rows.saturation import saturation_evidence
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, Table
from agent.identify.result import Floats, Parameter
from agent.identify.rigid.linear import solve_blocks
from agent.physics.twin import Effect, Twin

_AS_WELL = 1.5  # times the squared error: what is below zero and need not be is none
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
    coefficients : ndarray, shape (p,)
        Moves of the base numbers that are excited, then every term's.
    residual_nm : ndarray, shape (m,)
        At the library's rows.
    """

    base: Mapping[str, Parameter]
    terms: tuple[Term, ...]
    parameters: tuple[Mapping[str, Parameter], ...]
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
    carried = library.scene.table.carried
    fit = solve_blocks(columns, columns, library.target, np.cumsum(blocks))
    none = _below_zero(library, twin, fit.theta) if terms else {}
    if none:
        places, moves = list(none), np.array(list(none.values()))
        others = columns.copy()
        others[:, places] = 0.0
        held = library.target - columns[:, places] @ moves
        beside = solve_blocks(others, others, held, np.cumsum(blocks))
        if beside.residual @ beside.residual <= _AS_WELL * (fit.residual @ fit.residual):
            theta = beside.theta.copy()
            theta[places] = moves
            fit = replace(fit, theta=theta, residual=beside.residual)
    base = {name: _held(library.scene.table, name, float(getattr(twin, name))) for name in BASE}
    for at, name in enumerate(np.array(BASE)[carried].tolist()):
        given = float(getattr(twin, name))
        low, high = (float(x) for x in fit.ci95[at])
        base[name] = Parameter(given + float(fit.theta[at]), (given + low, given + high))
    model = Model(base, tuple(terms), (), fit.theta, fit.residual)
    parameters = []
    for term, place in zip(terms, model.slices(), strict=True):
        form = term.scored.form
        own = {
            name: Parameter(float(fit.theta[i]), (float(fit.ci95[i][0]), float(fit.ci95[i][1])))
            for name, i in zip(form.linear, range(place.start, place.stop), strict=True)
        }
        for name, value in zip(form.nonlinear, term.candidate.point, strict=True):
            own[name] = Parameter(float(value), None, identified=True)
        parameters.append(own)
    return replace(
        model,
        parameters=tuple(parameters),
        residual_nm=fit.residual / library.weighing.weight,
    )


def _below_zero(library: Library, twin: Twin, theta: Floats) -> dict[int, float]:
    """Return moves to zero, by place, of numbers that come out below it.

    A law that bends with speed takes up all of the viscous friction, and more: with none of it the
    law has other numbers, and only with these does the twin predict as the model does.
    """
    out = {}
    for at, place in enumerate(np.flatnonzero(library.scene.table.carried)):
        given = float(getattr(twin, BASE[place]))
        if BASE[place] in _NOT_NEGATIVE and given + theta[at] < 0.0:
            out[at] = -given
    return out


def _held(table: Table, name: str, given: float) -> Parameter:
    """Return a number that is not refitted, with why.

    Where a cable or an offset may stand for gravity it is held, and asked among the effects.
    """
    if name.startswith("gravity"):
        column = table.base[table.used, BASE.index(name)]
        if column.any():
            return Parameter.not_identified(
                "held as given: on these strokes what it lacks is told as an effect, beside others "
                "that look like it",
                given,
            )
    return Parameter.not_identified("these recordings do not excite it", given)


def extended_twin(library: Library, twin: Twin, model: Model) -> Twin:
    """Return the twin with the effects in it and its own numbers moved.

    The base numbers are fitted once more beside what the twin itself makes of the effects, so that
    the twin predicts as well as the model that it was written from; and without an effect that it
    has no law for, which had moved them. What comes out below zero is none, and the others are
    fitted beside that.
    """
    scene = library.scene
    entries = list(twin.effects)
    for index in range(len(model.terms)):
        entries += entries_of(library, model, index)
    entries += _limit(scene.table, entries)
    found = {name: p.value for name, p in model.base.items()}
    extended = replace(with_numbers(twin, found), effects=tuple(entries))
    possible = all(found[name] >= 0.0 for name in _NOT_NEGATIVE)
    if not entries and not model.terms and possible:
        return extended
    left_nm2 = _left_nm2(library, extended)
    for _ in range(2):
        # Some effects refer to the base numbers, so that these settle in two rounds.
        delta = _base_beside(scene.table, library, extended)
        moved = with_numbers(
            extended,
            {name: getattr(extended, name) + d for name, d in zip(BASE, delta, strict=True)},
        )
        before, left_nm2 = left_nm2, _left_nm2(library, moved)
        if left_nm2 >= before:
            break  # what moves with them, as a swing of the arm, asks for them as they were
        extended = moved
    return extended


def _left_nm2(library: Library, twin: Twin) -> float:
    """Return the weighted mean square of what a twin leaves where it says anything."""
    left = library.weighing.weighted(left_by(twin, library.scene.table))
    known = left[np.isfinite(left)]
    return float(known @ known) / known.size if known.size else math.inf


def entries_of(library: Library, model: Model, index: int) -> list[Effect]:
    """Return what a twin has of one of a model's terms."""
    form = model.terms[index].scored.form
    values = {name: p.value for name, p in model.parameters[index].items()}
    tables = form.to_twin(beside_others(library, model, index), values)
    return [Effect(form.effect, dict(table)) for table in tables]


def beside_others(library: Library, model: Model, index: int) -> Scene:
    """Return the scene with what all terms of a model but one add."""
    weighing, others = library.weighing, np.zeros(library.scene.table.used.shape[0])
    for i, (term, place) in enumerate(zip(model.terms, model.slices(), strict=True)):
        if i != index:
            added = term.candidate.columns @ model.coefficients[place]
            others[weighing.rows] += added / weighing.weight
    return replace(library.scene, others_nm=others)


def _limit(table: Table, entries: Sequence[Effect]) -> list[Effect]:
    """Return the torque limit that the signals show, where the twin has none yet."""
    if any(entry.id == "torque-saturation" for entry in entries):
        return []
    evidence = saturation_evidence(table)
    return (
        [] if evidence is None else [Effect("torque-saturation", {"limit_nm": evidence.limit_nm})]
    )


def with_numbers(twin: Twin, numbers: Mapping[str, float]) -> Twin:
    """Return a twin with some of its rigid body's and plain friction's numbers, by name.

    Inertia and friction are no less than none.
    """
    held = {name: numbers.get(name, float(getattr(twin, name))) for name in BASE}
    held |= {name: max(held[name], 0.0) for name in _NOT_NEGATIVE}
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
    return np.asarray(plain + known_part(table.effects_nm(twin), table.pieces))


def left_by(twin: Twin, table: Table) -> Floats:
    """Return what a twin leaves of a table's torque, shape (n,).

    Where a recorded simulation stands for the table's own twin, what this one has more than that is
    added to the simulation.
    """
    left = table.measured_nm - predicted(table, twin)
    return left - (table.given_nm - predicted(table, table.twin)) if table.simulated else left


def _base_beside(table: Table, library: Library, twin: Twin) -> Floats:
    """Return the move of a twin's base numbers that fits best beside its effects, shape (5,).

    Of the moves that leave inertia and friction no less than none.
    """
    from scipy.optimize import lsq_linear

    weighing = library.weighing
    left = weighing.weighted(left_by(twin, table))
    delta = np.zeros(len(BASE))
    carried = table.carried
    good = np.isfinite(left)
    columns = library.base[good]
    scale = np.sqrt(np.mean(columns**2, axis=0))
    moved = np.linalg.lstsq(columns / scale, left[good], rcond=1e-9)[0]
    least = np.array([-getattr(twin, n) if n in _NOT_NEGATIVE else -np.inf for n in BASE])
    least = least[carried] * scale
    if np.any(moved < least):
        moved = lsq_linear(columns / scale, left[good], (least, np.inf), method="bvls").x
    delta[carried] = moved / scale
    return delta
