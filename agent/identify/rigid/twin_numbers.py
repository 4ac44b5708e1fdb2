"""The numbers of a plain twin: each from what the recordings show it best by.

The regression of all moving samples has every number, and friction in it is known no better than
starts, reversals and ramps let it: a coarse velocity makes its low-pass a few hertz wide. The
steady speeds often know a straight friction law several times better, and what they know is not
left to be shared out among inertia and gravity. What the recordings do not show at all, a weight
that is within its chance, is none of a twin's: it would be told as a wrong number by the first who
measures better.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats, FrictionModelFit, Parameter, RigidBodyFit
from agent.identify.rigid.beside import fit_beside
from agent.identify.rigid.beside_law import is_bent
from agent.identify.rigid.body import BLOCKS, NOT_NEGATIVE
from agent.identify.rigid.linear import time_blocks
from agent.identify.rigid.rows import Rows
from agent.identify.uncertainty import block_jackknife
from agent.physics.friction import COULOMB_VISCOUS
from agent.physics.rigid_body import GRAVITY, PARAMETERS

_OFFSET = "torque_offset_nm"
_BY_CHANCE = 3.2  # 95 % of F(2, 40): how far two numbers together are from zero by chance


def with_twin_numbers(
    body: RigidBodyFit | None, rows: Rows, models: Sequence[FrictionModelFit]
) -> RigidBodyFit | None:
    """Return the rigid body with the numbers that a twin of it is to have.

    Parameters
    ----------
    body : RigidBodyFit, optional
        Fitted to all moving samples; beside friction that is bent it has its twin's numbers.
    rows : Rows
        Which these are, N of them.
    models : sequence of FrictionModelFit
        Of the steady speeds; without a straight law that is known better than the body's friction,
        and agrees with it, the numbers are the body's own.
    """
    if body is None or is_bent(models):
        return body
    offset = body.parameters[_OFFSET]
    if offset.ci95 is not None and not offset.ci95[0] <= 0.0 <= offset.ci95[1]:
        return body  # the gravity of a fit without it would hold it
    line = _firmer_line(body.parameters, models)
    known = {name: p.value for name, p in line.items()}
    held = [name for name in PARAMETERS if body.parameters[name].identified]
    free = [name for name in held if name not in known and name != _OFFSET]
    rest = replace(rows, torque_nm=rows.torque_nm - _torque(rows, known))
    blocks = time_blocks(rows.time_s, BLOCKS)
    if set(GRAVITY) <= set(free) and _is_chance(rest, free, blocks):
        free = [name for name in free if name not in GRAVITY]
        known |= dict.fromkeys(GRAVITY, 0.0)
    if not known:
        return body
    kept = [PARAMETERS.index(name) for name in free]
    if kept:
        theta = fit_beside(rest, kept, blocks, spring=True).theta
        known |= {name: float(value) for name, value in zip(free, theta, strict=True)}
    cannot_be = any(known.get(name, 0.0) < 0.0 for name in NOT_NEGATIVE)
    return body if cannot_be else replace(body, as_twin=known)


def _firmer_line(
    own: Mapping[str, Parameter], models: Sequence[FrictionModelFit]
) -> Mapping[str, Parameter]:
    """Return the steady speeds' straight law where it is better known, and agrees."""
    law = next((m for m in models if m.selected and m.model == COULOMB_VISCOUS.name), None)
    if law is None:
        return {}
    for name in COULOMB_VISCOUS.linear:
        steady, body = law.parameters[name], own[name]
        if steady.ci95 is None or body.ci95 is None or not body.identified:
            return {}
        if np.ptp(steady.ci95) >= np.ptp(body.ci95):
            return {}
        if not body.ci95[0] <= steady.value <= body.ci95[1]:
            return {}
    return {name: law.parameters[name] for name in COULOMB_VISCOUS.linear}


def _torque(rows: Rows, numbers: Mapping[str, float]) -> Floats:
    """Return what some numbers make of the motion, shape (N,)."""
    theta = np.array([numbers.get(name, 0.0) for name in PARAMETERS])
    return np.asarray(rows.columns @ theta)


def _is_chance(rows: Rows, names: Sequence[str], blocks: NDArray[np.int64]) -> bool:
    """Return whether gravity's two numbers are together no further from zero than by chance."""
    columns = rows.some([PARAMETERS.index(name) for name in names])
    theta, covariance, _ = block_jackknife(columns, rows.torque_nm, blocks)
    at = [names.index(name) for name in GRAVITY]
    gravity, spread = theta[at], covariance[np.ix_(at, at)]
    return float(gravity @ np.linalg.pinv(spread, hermitian=True) @ gravity) < 2.0 * _BY_CHANCE
