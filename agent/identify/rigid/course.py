"""How a regression becomes sharper while a cycle goes on: how long it need have been.

The rows are folded in as they come, in square-root form (`recursive`). Where a number has long
stood still when the cycle ends, a shorter one would have done.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.identify.rigid.recursive import RecursiveLeastSquares
from agent.identify.rigid.rows import Rows
from agent.identify.rigid.thresholding import AXIS_WITHOUT_GRAVITY
from agent.identify.uncertainty import correlation_time
from agent.physics.rigid_body import PARAMETERS

_STEPS = 60
_SETTLED = 0.01  # of the last value


@dataclass(frozen=True)
class Course:
    """The regression after ever more of the motion; k times, p parameters.

    Parameters
    ----------
    parameters : tuple of str
        Which of `physics.rigid_body.PARAMETERS` were fitted.
    time_s : ndarray, shape (k,)
        How much motion the rows so far hold.
    theta, standard_deviation : ndarray, shape (k, p)
        NaN until the rows carry every parameter. The residual's memory is in the deviations.
    condition_number : ndarray, shape (k,)
        Thesis (4.11), of the rows so far.
    """

    parameters: tuple[str, ...]
    time_s: Floats
    theta: Floats
    standard_deviation: Floats
    condition_number: Floats

    def settled_s(self) -> dict[str, float]:
        """Return from when on each number stays within a hundredth of its last value, s."""
        out = {}
        for name, values in zip(self.parameters, self.theta.T, strict=True):
            near = np.abs(values - values[-1]) <= _SETTLED * abs(values[-1])
            away = np.flatnonzero(~near)
            out[name] = float(self.time_s[int(away[-1]) + 1 if away.size else 0])
        return out


def course_of(rows: Rows) -> Course | None:
    """Return how inertia, viscous and Coulomb friction came about; None for too few rows.

    Parameters
    ----------
    rows : Rows
        Filtered and usable, in the order in which they were recorded.
    """
    count = rows.torque_nm.size
    if count < _STEPS * len(AXIS_WITHOUT_GRAVITY):
        return None
    columns = rows.some([PARAMETERS.index(name) for name in AXIS_WITHOUT_GRAVITY])
    state = RecursiveLeastSquares.start(columns.shape[1])
    steps: list[RecursiveLeastSquares] = []
    ends = [count * k // _STEPS for k in range(_STEPS + 1)]
    for begin, end in itertools.pairwise(ends):
        state = state.update(columns[begin:end], rows.torque_nm[begin:end])
        steps.append(state)
    theta = np.array([step.theta for step in steps])
    if not np.isfinite(theta[-1]).all():
        return None
    memory = math.sqrt(correlation_time([rows.torque_nm - columns @ theta[-1]]))
    spread = np.array([np.sqrt(np.diag(step.covariance)) for step in steps])
    period_s = float(np.median(np.diff(rows.time_s)))
    return Course(
        AXIS_WITHOUT_GRAVITY,
        period_s * np.array(ends[1:], dtype=np.float64),
        theta,
        memory * spread,
        np.array([step.condition_number for step in steps]),
    )
