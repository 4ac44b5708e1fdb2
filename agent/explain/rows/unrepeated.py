"""Whether what is left does not come again, and leans to no side: noise, however slow it is.

Noise of seconds is many times what the floor's half second shows. Physics of the joint comes again
where the same recording passes the same place at the same speed; what differs there as much as
anywhere is none. A disturbance does not come again either: a brake that drags now and then. It
pushes to one side, against the motion or along the axis, or stands at few levels, where noise has
a bell's shape.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.half_seconds import half_seconds, worth_of
from agent.explain.rows.table import Table
from agent.identify.result import Floats

_NO_MORE = 1.10  # times what repeated passes differ by
_FEWEST = 30.0  # means that tell of each other nothing: fewer do not show a shape
_SURELY = 2.5  # standard errors of skewness and of kurtosis


def does_not_come_again(
    table: Table, rows: NDArray[np.int64], left_nm: Floats, repeats_nm: float
) -> bool:
    """Return whether what is left differs between repeated passes as much as anywhere, by chance.

    Parameters
    ----------
    table : Table
    rows : ndarray of int, shape (m,)
        Of the table.
    left_nm : ndarray, shape (m,)
        What a model leaves there.
    repeats_nm : float
        By how much repeated passes differ; NaN where there are none.
    """
    if not math.sqrt(float(np.mean(left_nm**2))) <= _NO_MORE * repeats_nm:
        return False
    left = np.full(table.used.shape[0], np.nan)
    left[rows] = left_nm
    return has_the_shape_of_noise(table, left)


def has_the_shape_of_noise(table: Table, left_nm: Floats) -> bool:
    """Return whether what is left leans to no side, along the axis or against the motion.

    Parameters
    ----------
    table : Table
    left_nm : ndarray, shape (n,)
        What is left at the table's rows; not a number where it is not known.
    """
    way = np.sign(table.rows["velocity_rad_s"])
    along = [half_seconds(left_nm[piece.rows], piece) for piece in table.pieces]
    against = [half_seconds((left_nm * way)[piece.rows], piece) for piece in table.pieces]
    alone = worth_of(along)
    return alone >= _FEWEST and all(_is_a_bell(means, alone) for means in (along, against))


def _is_a_bell(means: list[Floats], alone: float) -> bool:
    """Return whether means are skewed and peaked no more than so many of a normal law may be."""
    values = np.concatenate(means)
    values = values[np.isfinite(values)]
    values = (values - values.mean()) / max(float(values.std()), 1e-300)
    skewed = abs(float(np.mean(values**3))) / math.sqrt(6.0 / alone)
    peaked = abs(float(np.mean(values**4)) - 3.0) / math.sqrt(24.0 / alone)
    return max(skewed, peaked) <= _SURELY
