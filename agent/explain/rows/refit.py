"""The move of the twin's own numbers that fits best: what is left is the mismatch."""

from __future__ import annotations

import numpy as np

from agent.explain.rows.table import BASE, Table
from agent.identify.result import Floats


def carried_by(columns: Floats, torque_nm: Floats) -> Floats:
    """Return what columns, shape (m, k), carry of a torque, shape (m,), by least squares."""
    size = np.sqrt(np.mean(columns**2, axis=0))
    unit = columns / np.where(size > 0.0, size, 1.0)
    return np.asarray(unit @ np.linalg.lstsq(unit, torque_nm, rcond=1e-9)[0])


def refit(table: Table, known: Floats | None = None) -> tuple[Floats, Floats]:
    """Return the move of the twin's five numbers that fits the rows best, and what is left.

    Parameters
    ----------
    table : Table
    known : ndarray, shape (n,), optional
        A torque that is taken off the target first.

    Returns
    -------
    delta : ndarray, shape (5,)
        To be added to the twin's numbers.
    residual_nm : ndarray, shape (n,)
    """
    target = table.target_nm if known is None else table.target_nm - known
    rows = table.sliding if table.sliding.any() else table.used
    size = np.sqrt(np.mean(table.base[rows] ** 2, axis=0))
    carried = table.carried
    delta = np.zeros(len(BASE))
    if carried.any():
        columns = table.base[np.ix_(rows, carried)] / size[carried]
        solution = np.linalg.lstsq(columns, target[rows], rcond=1e-9)[0]
        delta[carried] = solution / size[carried]
    return delta, target - table.base @ delta
