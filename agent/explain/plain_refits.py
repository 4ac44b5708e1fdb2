"""What the twin's own structure, fitted by itself, makes of its numbers: filtered, and as recorded.

Missing physics bends the numbers of a twin that is fitted without it, and how depends on the fit:
an order that shakes the measured acceleration makes ordinary least squares on raw samples find
too little inertia, and a fit in a narrow band hardly any less. A number that either fit returns is
bent, not wrong.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from agent.explain.pieces import thinned
from agent.explain.search import Library
from agent.explain.table import BASE, Table
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
        In the band, with the search's weights; and on the samples as they were recorded.
    """
    table = library.scene.table
    carried = table.carried
    names = np.array(BASE)[carried].tolist()
    weighted = np.linalg.lstsq(_scaled(library.base), library.target, rcond=1e-9)[0]
    moves = [weighted / _size(library.base)]
    columns, target = _as_recorded(table, twin)
    rows = table.sliding & np.isfinite(target)
    columns = columns[np.ix_(rows, carried)]
    if columns.shape[0] > columns.shape[1]:
        fit = np.linalg.lstsq(_scaled(columns), target[rows], rcond=1e-9)[0]
        moves.append(fit / _size(columns))
    return tuple(dict(zip(names, move.tolist(), strict=True)) for move in moves)


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


def _size(columns: Floats) -> Floats:
    return np.asarray(np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300))


def _scaled(columns: Floats) -> Floats:
    return columns / _size(columns)
