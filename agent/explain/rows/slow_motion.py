"""A delay as slow motion shows it.

A channel that is late is as late whatever moves. Fast motion says less of it than it seems to: the
measured acceleration has its noise there, which makes a delay short, the gear gives way, and waves
of the motor's angle pass that hardly anything tells from a late acceleration. And where something
else shakes the joint, the loop's answer lags behind the shaking: that is late in fast motion alone.

All columns are cut to the rows that are compared before they pass the narrower filter, so that what
holds at these rows holds of what is left as well.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from agent.explain.rows.evidence import Weighing, solve
from agent.explain.rows.table import Table, without_edges
from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass

SLOW = 0.2
"""Of the band: up to there motion is slow."""

_KNOWN = 0.1  # of a number: its standard error


class Slow(NamedTuple):
    """A number from slow motion, and its standard error."""

    value: float
    error: float

    @property
    def known(self) -> bool:
        """Return whether slow motion tells it to a tenth."""
        return self.error < _KNOWN * abs(self.value)


def by_slow_motion(
    table: Table, weighing: Weighing, columns: Floats, target: Floats, late_s: float
) -> Slow:
    """Return the first column's coefficient as slow motion has it.

    Parameters
    ----------
    table : Table
    weighing : Weighing
    columns : ndarray, shape (m, k)
        Weighted; all others' coefficients are free.
    target : ndarray, shape (m,)
        Weighted.
    late_s : float
        About the delay of the torque: where that starts and turns is left out as well.

    Returns
    -------
    Slow
        Its error from how much the blocks of the weighing differ.
    """
    apart = without_edges(table, table.creep_rad_s, late_s).used[weighing.rows]
    slow = slowly(table, weighing, np.column_stack((columns, target)) * apart[:, np.newaxis])
    model, asked = slow[:, :-1], slow[:, -1]
    gram = model.T @ model
    theta = solve(gram, model.T @ asked)
    unit = np.zeros(theta.shape[0])
    unit[0] = 1.0
    pulls = (model @ solve(gram, unit)) * (asked - model @ theta)
    error = math.sqrt(float(np.sum(np.add.reduceat(pulls, weighing.starts) ** 2)))
    return Slow(float(theta[0]), error)


def slowly(table: Table, weighing: Weighing, weighted: Floats) -> Floats:
    """Return weighted columns, shape (m, k), with nothing but slow motion in them.

    Parameters
    ----------
    table : Table
    weighing : Weighing
    weighted : ndarray, shape (m, k)
        Zero at rows that are left out.
    """
    plain = np.zeros((weighted.shape[1], table.used.shape[0]))
    plain[:, weighing.rows] = (weighted / weighing.weight[:, np.newaxis]).T
    for piece in table.pieces:
        part = np.ascontiguousarray(plain[:, piece.rows])
        period_s = piece.period_s * piece.stride
        plain[:, piece.rows] = lowpass(part, period_s, SLOW * piece.cutoff_hz)
    return plain[:, weighing.rows].T * weighing.weight[:, np.newaxis]
