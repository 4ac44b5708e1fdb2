"""The rigid-body regression of thesis (4.5): inertia, friction, gravity and offset in one fit.

Columns that this motion cannot tell apart are left out and reported with the reason; they are
never given a number. Intervals come from leaving out blocks of time, because the residuals are
coloured by ripple, control and the filter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from agent.identify.friction.law_fit import fit_percent
from agent.identify.result import Floats, Parameter, RigidBodyFit, Validation
from agent.identify.rigid.beside import fit_beside
from agent.identify.rigid.carried import left_out
from agent.identify.rigid.linear import time_blocks
from agent.identify.rigid.rows import Rows
from agent.physics.friction import COULOMB_VISCOUS
from agent.physics.rigid_body import PARAMETERS

BLOCKS = 40
"""Of time, that intervals are made of."""

_FEWEST_BLOCKS = 12
NOT_NEGATIVE = ("inertia_kg_m2", *COULOMB_VISCOUS.linear)
"""What no joint has less than none of."""

_OFFSET = "torque_offset_nm"


def fit_rigid_body(rows: Rows, *, spring: bool = True) -> RigidBodyFit | None:
    """Regress the torque on the motion, shape (N, 6), as far as the motion carries it.

    Parameters
    ----------
    rows : Rows
        Filtered samples.
    spring : bool
        Whether a spring between motor and arm, and a torque that is late against the motion, may
        take part, where the data show them.

    Returns
    -------
    RigidBodyFit or None
        `condition_number` is (4.11), the ratio of the singular values of the regressor as it is
        (unscaled columns, as in the thesis), over the columns that were kept. None with too few
        samples to say anything.
    """
    if rows.torque_nm.shape[0] < 10 * len(PARAMETERS):
        return None
    reasons = left_out(rows)
    kept = [i for i, name in enumerate(PARAMETERS) if name not in reasons]
    columns = rows.some(kept)
    blocks = time_blocks(rows.time_s, BLOCKS)
    if int(blocks[-1]) + 1 < _FEWEST_BLOCKS or not kept:
        return None
    fit = fit_beside(rows, kept, blocks, spring=spring)
    parameters: dict[str, Parameter] = {}
    for name in PARAMETERS:
        if name in reasons:
            parameters[name] = Parameter.not_identified(reasons[name])
        else:
            k = kept.index(PARAMETERS.index(name))
            low, high = fit.ends[k].tolist()
            parameters[name] = Parameter(float(fit.theta[k]), (low, high))
    predicted = columns @ fit.theta
    singular = np.linalg.svd(columns.T @ columns, compute_uv=False)
    condition = float(np.sqrt(singular[0] / singular[-1])) if singular[-1] > 0.0 else np.inf
    return RigidBodyFit(
        parameters=parameters,
        condition_number=condition,
        rmse_nm=float(np.sqrt(np.mean((rows.torque_nm - predicted) ** 2))),
        fit_percent=fit_percent(rows.torque_nm, predicted),
        as_twin=_as_twin(rows, kept, blocks, parameters, spring=spring),
        spring_took_part=fit.spring,
        torque_late_s=fit.late_s,
    )


def _as_twin(
    rows: Rows,
    kept: Sequence[int],
    blocks: NDArray[np.int64],
    parameters: Mapping[str, Parameter],
    *,
    spring: bool,
) -> dict[str, float]:
    """Return the values of a fit without what a twin cannot hold and the data do not show.

    A twin has no constant torque. Gravity of a fit that has one, on a stroke on which its cosine is
    nearly constant, is off by as much as the offset is, and neither is more than chance. Nor has it
    an inertia below zero, or friction that pushes: where one comes out negative by chance, the
    others are off by as much. Nothing where the data show what a twin cannot hold, or none is so.
    """
    offset = parameters[_OFFSET]
    without = {n for n in NOT_NEGATIVE if _is_below_by_chance(parameters[n])}
    if offset.ci95 is not None and offset.ci95[0] <= 0.0 <= offset.ci95[1]:
        without.add(_OFFSET)
    if not without:
        return {}
    while True:
        others = [i for i in kept if PARAMETERS[i] not in without]
        if not others:
            return {}
        theta = fit_beside(rows, others, blocks, spring=spring).theta
        found = {PARAMETERS[i]: float(value) for i, value in zip(others, theta, strict=True)}
        below = {n for n in NOT_NEGATIVE if found.get(n, 0.0) < 0.0 <= _high(parameters[n])}
        if not below:
            return found
        without |= below


def without_negative_inertia(fit: RigidBodyFit) -> RigidBodyFit:
    """Return a fit whose inertia has no number where it comes out below zero beyond chance."""
    inertia = fit.parameters["inertia_kg_m2"]
    if inertia.ci95 is None or inertia.ci95[1] >= 0.0:
        return fit
    refused = Parameter.not_identified(
        "it comes out negative, which no mass has: torque and motion are not in step; record "
        "faster, and both by one clock"
    )
    held = {name: value for name, value in fit.as_twin.items() if name != "inertia_kg_m2"}
    return replace(fit, parameters=dict(fit.parameters) | {"inertia_kg_m2": refused}, as_twin=held)


def _is_below_by_chance(parameter: Parameter) -> bool:
    return parameter.identified and parameter.value < 0.0 <= _high(parameter)


def _high(parameter: Parameter) -> float:
    return -np.inf if parameter.ci95 is None else parameter.ci95[1]


def weights(fit: RigidBodyFit) -> Floats:
    """Return what predicts, shape (6,), with zero where a parameter was not identified."""
    found = {name: p.value for name, p in fit.parameters.items() if p.identified}
    found |= fit.straight_line
    return np.array([found.get(name, 0.0) for name in PARAMETERS])


def validate(fit: RigidBodyFit, rows: Rows, name: str) -> Validation:
    """Predict a run that the fit has not seen.

    Parameters
    ----------
    fit : RigidBodyFit
        From other recordings.
    rows : Rows
        The unseen run, filtered with the fit's own cutoff.
    name : str
        What the run is called.
    """
    predicted = rows.columns @ weights(fit)
    error = rows.torque_nm - predicted
    size = float(np.linalg.norm(rows.torque_nm))
    return Validation(
        recording=name,
        rmse_nm=float(np.sqrt(np.mean(error**2))) if error.size else float("nan"),
        fit_percent=fit_percent(rows.torque_nm, predicted) if error.size else float("nan"),
        relative_torque_error_percent=(
            100.0 * float(np.linalg.norm(error)) / size if size > 0.0 else float("nan")
        ),
    )
