"""What every score is compared with: the first terms by error-reduction ratio on the same columns.

Orthogonal least squares (Billings, Chen and Korenberg, Int. J. Control 49 (1989) 2157): of all
columns of the library, the one that removes most of the residual is named. It has the tool's own
physics, rows and filter, but no test of significance, no unseen data, no alternatives, no verdict.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from agent.explain.choosing.candidate import Candidate, basis_of
from agent.explain.choosing.search import Library
from agent.explain.forms.library import judgeable
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.identify.result import Floats
from agent.physics.twin import Twin

_OWN: Mapping[str, tuple[str, ...]] = {
    "inertia-error": ("inertia_kg_m2",),
    "wrong-number": ("coulomb_nm", "viscous_nm_s_per_rad"),
    "gravity-imbalance": ("gravity_sin_nm", "gravity_cos_nm"),
}
"""Columns of the twin's own structure, by the effect that freeing them stands for."""


def first_terms(twin: Twin, runs: Sequence[Run], count: int = 3) -> tuple[str, ...]:
    """Return the effects of the first `count` terms by error-reduction ratio.

    The twin's own numbers are columns as well: what one of them is worth is what the residual gains
    when it alone is held at the value given. An effect is named once, however many of its columns
    would follow.

    Parameters
    ----------
    twin : Twin
    runs : sequence of Run
    count : int
        How many terms; there is no rule that stops it. Recordings that cannot be compared with the
        twin have none.
    """
    try:
        library = _library(twin, runs)
    except ValueError:
        return ()
    names: list[str] = []
    terms: list[Candidate] = []
    while len(names) < count:
        gains = {name: gain for name, gain in _own(library, terms).items() if name not in names}
        best = max(gains, key=lambda name: gains[name], default="")
        most = gains.get(best, 0.0)
        term = None
        for candidate, gain in _gains(library, terms):
            if gain > most and candidate.form.effect not in names:
                most, best, term = gain, candidate.form.effect, candidate
        if not best:
            break
        names.append(best)
        terms += [] if term is None else [term]
    return tuple(names)


def _library(twin: Twin, runs: Sequence[Run]) -> Library:
    """Return all columns over the rows that the tool looks at."""
    table = tabulate(twin, runs)
    delta, left = refit(table)
    theta = np.array([getattr(twin, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0))
    return Library.of(scene, weigh(table, left), judgeable(table)[0])


def _gains(library: Library, terms: Sequence[Candidate]) -> list[tuple[Candidate, float]]:
    """Return every candidate with the squared residual that it removes beside a model."""
    basis = basis_of(library.model(terms))
    left = library.target - basis @ (basis.T @ library.target)
    out = []
    for candidate in library.candidates:
        columns = candidate.columns
        own = basis_of(columns - basis @ (basis.T @ columns), like=columns)
        out.append((candidate, float(np.sum((own.T @ left) ** 2))))
    return out


def _own(library: Library, terms: Sequence[Candidate]) -> dict[str, float]:
    """Return the squared residual that freeing each of the twin's own numbers removes."""
    carried = [
        BASE[i]
        for i in np.flatnonzero(np.sqrt(np.mean(library.scene.table.base**2, axis=0)) > 1e-12)
    ]
    added = np.concatenate(
        [np.zeros((library.target.size, 0)), *(t.columns for t in terms)], axis=1
    )
    whole = _left(library.target, np.concatenate((library.base, added), axis=1))
    out = {}
    for effect, names in _OWN.items():
        held = [i for i, name in enumerate(carried) if name not in names]
        if len(held) < len(carried):
            columns = np.concatenate((library.base[:, held], added), axis=1)
            out[effect] = _left(library.target, columns) - whole
    return out


def _left(target: Floats, columns: Floats) -> float:
    basis = basis_of(columns)
    return float(target @ target) - float(np.sum((basis.T @ target) ** 2))
