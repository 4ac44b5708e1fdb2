"""What a friction law that is no straight line does to the rigid body's numbers.

The rigid body's friction is Coulomb's and viscous: a straight line through the curve. Where the
steady speeds show that friction is bent, the line is no part of it, and at every ramp and reversal
the rest is shared out among inertia, gravity and offset. By how much is known: the law is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.identify.result import Floats, FrictionModelFit, Parameter, RigidBodyFit
from agent.identify.rigid.body import weights
from agent.identify.rigid.rows import Rows
from agent.physics.friction import COULOMB_VISCOUS, LAWS
from agent.physics.rigid_body import PARAMETERS

_COULOMB, _VISCOUS = (PARAMETERS.index(n) for n in COULOMB_VISCOUS.linear)
NOTE = (
    "friction is bent, which the rigid body's straight line is not: its intervals reach as far as "
    "that moves its numbers; for Coulomb and viscous friction take the law's"
)


def reaching_over_law(
    body: RigidBodyFit, rows: Rows, models: Sequence[FrictionModelFit]
) -> RigidBodyFit:
    """Return the rigid body with intervals that hold what it would be beside the selected law.

    Parameters
    ----------
    body : RigidBodyFit
        Fitted with friction as a straight line.
    rows : Rows
        What it was fitted to, N of them.
    models : sequence of FrictionModelFit
        Of the friction curve; without one that is bent and selected nothing changes.
    """
    selected = next((m for m in models if m.selected), None)
    if selected is None or not is_bent(models):
        return body
    values = {name: p.value for name, p in selected.parameters.items()}
    if not np.isfinite(list(values.values())).all():
        return body
    direction, velocity = rows.columns[:, _COULOMB], rows.columns[:, _VISCOUS]
    line = values["coulomb_nm"] + values["viscous_nm_s_per_rad"] * np.abs(velocity)
    bend = direction * (LAWS[selected.model].torque(np.abs(velocity), values) - line)
    kept = [i for i, name in enumerate(PARAMETERS) if body.parameters[name].identified]
    moved = _moved(body, rows, kept, bend)
    parameters = dict(body.parameters)
    for i, by in zip(kept, moved.tolist(), strict=True):
        parameters[PARAMETERS[i]] = _reaching(parameters[PARAMETERS[i]], -by)
    return replace(body, parameters=parameters)


def is_bent(models: Sequence[FrictionModelFit]) -> bool:
    """Return whether the selected law is another than Coulomb's and viscous friction."""
    return any(m.selected and m.model != COULOMB_VISCOUS.name for m in models)


def _moved(body: RigidBodyFit, rows: Rows, kept: Sequence[int], bend_nm: Floats) -> Floats:
    """Return by how much a torque, shape (N,), moves the kept parameters, shape (p,)."""
    columns = rows.some(kept)
    if body.spring_took_part:
        columns = np.column_stack((columns, rows.snap_rad_s4))
    if body.torque_late_s != 0.0:
        late = np.gradient(rows.columns @ weights(body), rows.time_s)
        columns = np.column_stack((columns, late))
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    moved = np.linalg.lstsq(columns / scale, bend_nm)[0] / scale
    return np.asarray(moved[: len(kept)], dtype=np.float64)


def _reaching(parameter: Parameter, by: float) -> Parameter:
    """Return a parameter whose interval holds it where it is and moved."""
    if parameter.ci95 is None:
        return parameter
    low, high = parameter.ci95
    return replace(parameter, ci95=(low + min(by, 0.0), high + max(by, 0.0)))
