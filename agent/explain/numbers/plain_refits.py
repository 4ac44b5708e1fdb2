"""What the twin's own structure, fitted by itself, makes of its numbers: filtered, and as recorded.

Missing physics bends the numbers of a twin that is fitted without it, and how depends on the fit:
an order that shakes the measured acceleration makes ordinary least squares on raw samples find
too little inertia, and a fit in a narrow band hardly any less. A number that either fit returns is
bent, not wrong.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.search import Library
from agent.explain.rows.pieces import thinned
from agent.explain.rows.table import BASE, Table
from agent.identify.result import Floats
from agent.physics import rigid_body
from agent.physics.twin import Twin


def plain_moves(library: Library, twin: Twin) -> tuple[Mapping[str, float], ...]:
    """Return how far each fit of the plain structure moves the numbers that are excited.

    Parameters
    ----------
    library : Library
    twin : Twin
        As given; what its effects add is taken off the torque first.

    Returns
    -------
    tuple of mapping of str to float
        In the band: with the search's weights, and every sliding row alike; on the samples as they
        were recorded. A twin that has no gravity at all was fitted without: so it is fitted, too.
    """
    table = library.scene.table
    raw, left = _as_recorded(table, twin)
    kept = own_structure(table, twin)
    every = np.ones(library.target.shape[0], dtype=np.bool_)
    alike = table.sliding, np.isfinite(left) & table.sliding
    fits = [
        (library.base, library.target, every, np.flatnonzero(table.carried)),
        (table.base[:, kept], table.target_nm, alike[0], kept),
        (raw[:, kept], left, alike[1], kept),
    ]
    if kept.size < np.count_nonzero(table.carried):
        own = np.isin(np.flatnonzero(table.carried), kept)
        fits.insert(1, (library.base[:, own], library.target, every, kept))
    return tuple(
        _moves(columns[rows], target[rows], np.array(BASE)[places].tolist())
        for columns, target, rows, places in fits
        if np.count_nonzero(rows) > columns.shape[1]
    )


def earlier_moves(library: Library, twin: Twin) -> tuple[Mapping[str, float], ...]:
    """Return how far fits to the first recordings alone move the numbers, the shortest list first.

    A simulation's numbers come from what had been recorded by then. Physics that it lacks bends
    them otherwise on other motions: more recordings may refute numbers that the first ones give.
    """
    table = library.scene.table
    places = own_structure(table, twin)
    began = [run.started_s for run in table.runs]
    order = np.argsort(began, kind="stable") if np.isfinite(began).all() else np.arange(len(began))
    out = []
    for count in range(1, len(began)):
        rows = table.sliding & np.isin(table.run, order[:count])
        columns = table.base[rows][:, places]
        if np.linalg.matrix_rank(columns) == places.size:
            out.append(_moves(columns, table.target_nm[rows], np.array(BASE)[places].tolist()))
    return tuple(out)


def moves_through_reversals(library: Library, twin: Twin) -> Mapping[str, float]:
    """Return how far a fit to all samples that move does, starts and reversals among them.

    So anybody's least squares has them. While a gap is crossed the motor turns without its arm:
    with those samples an inertia comes out too small that without them is right.

    Parameters
    ----------
    library : Library
    twin : Twin
        As given.

    Returns
    -------
    mapping of str to float
        On the samples as they were recorded, faster than half of the slowest speed that was held;
        empty where these are too few.
    """
    table = library.scene.table
    raw, left = _as_recorded(table, twin)
    places = own_structure(table, twin)
    fast = np.abs(table.rows["velocity_rad_s"]) > 0.5 * library.scene.slowest
    rows = fast & np.isfinite(raw[:, places]).all(axis=1) & np.isfinite(left)
    if np.count_nonzero(rows) <= places.size:
        return {}
    return _moves(raw[rows][:, places], left[rows], np.array(BASE)[places].tolist())


def own_structure(table: Table, twin: Twin) -> NDArray[np.int64]:
    """Return which of the excited numbers a twin has: gravity of exactly zero is none."""
    loaded = twin.gravity_sin_nm != 0.0 or twin.gravity_cos_nm != 0.0
    has = np.array([loaded or not name.startswith("gravity") for name in BASE])
    return np.flatnonzero(table.carried & has)


def _moves(columns: Floats, target: Floats, names: Sequence[str]) -> dict[str, float]:
    """Return how far a least-squares fit moves each number."""
    size = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300)
    fit = np.linalg.lstsq(columns / size, target, rcond=1e-9)[0] / size
    return dict(zip(names, fit.tolist(), strict=True))


def _as_recorded(table: Table, twin: Twin) -> tuple[Floats, Floats]:
    """Return the plain structure's unfiltered columns (n, 5) and what the twin leaves, (n,)."""
    velocity = table.full["velocity_raw_rad_s"]
    acceleration = np.empty_like(velocity)
    for piece in table.pieces:
        acceleration[piece.full] = np.gradient(velocity[piece.full], piece.period_s)
    position = table.full["position_rad"]
    raw = rigid_body.regressor(
        None if np.isnan(position).any() else position,
        velocity,
        acceleration,
        table.full["direction"],
        table.gear_ratio,
    )[:, : len(BASE)]
    columns = np.stack([thinned(column, table.pieces) for column in raw.T], axis=-1)
    given = np.array([getattr(twin, name) for name in BASE])
    extra = table.given_nm - table.base @ given
    return columns, table.rows["torque_nm"] - extra - columns @ given
