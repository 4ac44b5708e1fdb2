"""How acceleration and speed decide what a rigid-body regression is worth (thesis 4.1.3).

Algorithm 5 drops the rows whose acceleration exceeds a threshold; the sweep repeats the regression
over a range of thresholds (Figure 4.4). Rows may be dropped one by one because the regression has
no memory. The other study fits every point-to-point move by itself and sets its conditioning
against its speed (Figure 4.5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.rigid.linear import LinearFit, condition_number, solve_blocks, time_blocks
from agent.identify.rigid.rows import Rows
from agent.physics.rigid_body import PARAMETERS

AXIS_WITHOUT_GRAVITY = ("inertia_kg_m2", "viscous_nm_s_per_rad", "coulomb_nm")
"""The columns of thesis axis 1, in the order of `PARAMETERS`."""

_ACCELERATION = PARAMETERS.index("inertia_kg_m2")
_VELOCITY = PARAMETERS.index("viscous_nm_s_per_rad")
_BLOCKS = 40
_STEPS = 24
_LOWEST = 0.01  # of the largest acceleration
_ROWS_PER_PARAMETER = 10


@dataclass(frozen=True)
class AccelerationSweep:
    """The regression against the acceleration threshold; k thresholds, p parameters.

    Parameters
    ----------
    parameters : tuple of str
        Which of `physics.rigid_body.PARAMETERS` were fitted.
    threshold_rad_s2 : ndarray, shape (k,)
        Falling; the first keeps every row.
    theta, standard_deviation : ndarray, shape (k, p)
        NaN where too few rows are left.
    condition_number : ndarray, shape (k,)
        Thesis (4.11), of the rows that are left.
    samples : ndarray of int, shape (k,)
        How many those are.
    """

    parameters: tuple[str, ...]
    threshold_rad_s2: Floats
    theta: Floats
    standard_deviation: Floats
    condition_number: Floats
    samples: NDArray[np.int64]

    @property
    def best(self) -> int:
        """Return the index of the smallest condition number."""
        return int(
            np.nanargmin(np.where(np.isfinite(self.theta[:, 0]), self.condition_number, np.inf))
        )


@dataclass(frozen=True)
class SpeedStudy:
    """One regression for every run, against its fastest speed; k runs, p parameters.

    Parameters
    ----------
    parameters : tuple of str
        Which of `physics.rigid_body.PARAMETERS` were fitted.
    speed_rad_s : ndarray, shape (k,)
        The run's fastest filtered speed, rising.
    theta, standard_deviation : ndarray, shape (k, p)
        NaN where a run is too short.
    condition_number : ndarray, shape (k,)
    """

    parameters: tuple[str, ...]
    speed_rad_s: Floats
    theta: Floats
    standard_deviation: Floats
    condition_number: Floats


def sweep_acceleration(
    rows: Rows,
    thresholds_rad_s2: Floats | None = None,
    *,
    parameters: Sequence[str] = AXIS_WITHOUT_GRAVITY,
) -> AccelerationSweep:
    """Repeat the regression without the rows above each threshold (Algorithm 5, Figure 4.4).

    Parameters
    ----------
    rows : Rows
        Filtered samples.
    thresholds_rad_s2 : ndarray, shape (k,), optional
        In any order; else 24 from the largest acceleration down to a hundredth of it.
    parameters : sequence of str
        The columns to fit.

    Raises
    ------
    ValueError
        There are no rows, an unknown parameter, or a threshold that is not above zero.
    """
    index = _columns_of(parameters)
    if not rows.torque_nm.size:
        raise ValueError("expected rows to regress, got none")
    size = np.abs(rows.columns[:, _ACCELERATION])
    if thresholds_rad_s2 is None:
        largest = max(float(size.max()), 1e-300)
        thresholds = np.geomspace(largest, _LOWEST * largest, _STEPS)
        thresholds[0] = largest  # exactly: the first step drops nothing
    else:
        thresholds = np.sort(np.asarray(thresholds_rad_s2, dtype=np.float64))[::-1]
        if not thresholds.size or not thresholds[-1] > 0.0:
            raise ValueError(f"expected thresholds above 0 rad/s2, got {thresholds_rad_s2}")
    blocks = time_blocks(rows.time_s, _BLOCKS)
    found = [_fit(rows, index, blocks, size <= t) for t in thresholds]
    theta, deviation, condition = _side_by_side(found, len(index))
    samples: NDArray[np.int64] = np.array(
        [np.count_nonzero(size <= t) for t in thresholds], dtype=np.int64
    )
    names = tuple(PARAMETERS[i] for i in index)
    return AccelerationSweep(names, thresholds, theta, deviation, condition, samples)


def study_speeds(
    runs: Sequence[Rows], *, parameters: Sequence[str] = AXIS_WITHOUT_GRAVITY
) -> SpeedStudy:
    """Fit every run by itself and set its conditioning against its speed (Figure 4.5).

    Parameters
    ----------
    runs : sequence of Rows
        One point-to-point recording each.
    parameters : sequence of str
        The columns to fit.

    Raises
    ------
    ValueError
        There is no run with rows, or an unknown parameter.
    """
    index = _columns_of(parameters)
    moving = [r for r in runs if r.torque_nm.size]
    if not moving:
        raise ValueError("expected at least one run that moves, got none")
    moving.sort(key=_fastest)
    found = [
        _fit(r, index, time_blocks(r.time_s, _BLOCKS), np.ones(r.time_s.shape, dtype=np.bool_))
        for r in moving
    ]
    theta, deviation, condition = _side_by_side(found, len(index))
    return SpeedStudy(
        tuple(PARAMETERS[i] for i in index),
        np.array([_fastest(r) for r in moving]),
        theta,
        deviation,
        condition,
    )


def _fastest(rows: Rows) -> float:
    return float(np.abs(rows.columns[:, _VELOCITY]).max())


def _columns_of(parameters: Sequence[str]) -> list[int]:
    """Return the columns' indices in the order of `PARAMETERS`."""
    unknown = [name for name in parameters if name not in PARAMETERS]
    if unknown or not parameters:
        raise ValueError(f"expected names out of {', '.join(PARAMETERS)}; got {list(parameters)}")
    return [i for i, name in enumerate(PARAMETERS) if name in parameters]


def _fit(
    rows: Rows, index: Sequence[int], blocks: NDArray[np.int64], kept: NDArray[np.bool_]
) -> tuple[LinearFit | None, float]:
    """Return one regression, or None with too few rows, and the condition number of its rows."""
    columns = rows.columns[kept][:, index]
    left = blocks[kept]
    condition = condition_number(columns)
    enough = columns.shape[0] >= _ROWS_PER_PARAMETER * len(index)
    if not enough or np.unique(left).size <= len(index) + 1:
        return None, condition
    return solve_blocks(columns, columns, rows.torque_nm[kept], left), condition


def _side_by_side(
    found: Sequence[tuple[LinearFit | None, float]], width: int
) -> tuple[Floats, Floats, Floats]:
    """Return parameters and deviations, shape (k, p), and condition numbers, shape (k,)."""
    theta = np.full((len(found), width), np.nan)
    deviation = np.full((len(found), width), np.nan)
    for k, (fit, _) in enumerate(found):
        if fit is not None:
            theta[k], deviation[k] = fit.theta, fit.standard_deviation
    return theta, deviation, np.array([condition for _, condition in found])
