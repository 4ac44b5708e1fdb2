"""How coarsely the torque was reported: what lies between two of its steps nobody recorded.

Noise of a step's size spreads the rounding over all frequencies, and the noise floor holds it. With
less noise than that, a torque that changes slowly stands on one step for long: the rounding is then
a function of the torque itself, like a law, and no scatter shows it.
"""

from __future__ import annotations

import math

import numpy as np

from agent.explain.rows.table import Table
from agent.identify.result import Floats

_STANDS = 0.5  # of neighbouring samples are alike: noise of 0.4 steps or less
_FEWEST, _MOST = 3, 0.25  # values, and of the samples: more of them are no steps
_OFF = 0.02  # of a step: rounding of the file


def resolution_nm(table: Table) -> float:
    """Return the root mean square of the torque's rounding, N m; 0 where noise holds it.

    Parameters
    ----------
    table : Table
    """
    steps = (coarse_step(run.signals.torque_nm) for run in table.runs)
    return max(steps, default=0.0) / math.sqrt(12.0)


def coarse_step(values: Floats) -> float:
    """Return the step in which a signal was reported, where it stands on its steps; 0 else.

    Parameters
    ----------
    values : ndarray, shape (n,)
        As recorded; NaN is left out.
    """
    known = values[np.isfinite(values)]
    if known.shape[0] < 2 or float(np.mean(np.diff(known) == 0.0)) < _STANDS:
        return 0.0
    levels = np.unique(known)
    if not _FEWEST <= levels.shape[0] <= _MOST * known.shape[0]:
        return 0.0
    apart = np.diff(levels)
    step = float(np.median(apart[apart < 1.5 * float(np.quantile(apart, 0.1))]))
    counted = apart / step
    return step if bool(np.all(np.abs(counted - np.round(counted)) < _OFF * counted)) else 0.0
