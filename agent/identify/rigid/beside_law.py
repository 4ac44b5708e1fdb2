"""What a friction law that is no straight line does to the rigid body's numbers.

The rigid body's friction is Coulomb's and viscous: a straight line through the curve. Where the
steady speeds show that friction is bent, the line is no part of it, and at every ramp and reversal
the rest is shared out among inertia, gravity and offset. By how much is known: the law is. Those
three are then what they are beside the law; Coulomb and viscous friction stay the line's, which is
what a twin of straight friction needs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from agent.identify.friction.law_fit import fit_percent
from agent.identify.result import Floats, FrictionModelFit, Parameter, RigidBodyFit
from agent.identify.rigid.body import weights
from agent.identify.rigid.rows import Rows
from agent.identify.signals.lowpass import lowpass
from agent.physics.friction import COULOMB_VISCOUS, LAWS
from agent.physics.rigid_body import PARAMETERS

_LINE = tuple(PARAMETERS.index(n) for n in COULOMB_VISCOUS.linear)
NOTE = (
    "friction is bent, which the rigid body's straight line is not: inertia, gravity and offset "
    "are those beside the friction law, and all intervals hold what they are without; for Coulomb "
    "and viscous friction take the law's"
)


def beside_law(
    body: RigidBodyFit, rows: Rows, models: Sequence[FrictionModelFit], cutoff_hz: float
) -> RigidBodyFit:
    """Return the rigid body beside the selected law, with intervals that hold it without, too.

    Parameters
    ----------
    body : RigidBodyFit
        Fitted with friction as a straight line.
    rows : Rows
        What it was fitted to, N of them.
    models : sequence of FrictionModelFit
        Of the friction curve; without one that is bent and selected nothing changes.
    cutoff_hz : float
        Of the low-pass that the rows passed.
    """
    selected = next((m for m in models if m.selected), None)
    if selected is None or not is_bent(models):
        return body
    values = {name: p.value for name, p in selected.parameters.items()}
    if not np.isfinite(list(values.values())).all():
        return body
    kept = [i for i, name in enumerate(PARAMETERS) if body.parameters[name].identified]
    moved = _moved(body, rows, kept, _bend(rows, selected.model, values, cutoff_hz))
    parameters = dict(body.parameters)
    for i, by in zip(kept, moved.tolist(), strict=True):
        parameters[PARAMETERS[i]] = _put(parameters[PARAMETERS[i]], -by, i in _LINE)
    beside = replace(body, parameters=parameters)
    predicted = rows.columns @ weights(beside)
    return replace(
        beside,
        rmse_nm=float(np.sqrt(np.mean((rows.torque_nm - predicted) ** 2))),
        fit_percent=fit_percent(rows.torque_nm, predicted),
    )


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


def _bend(rows: Rows, model: str, values: Mapping[str, float], cutoff_hz: float) -> Floats:
    """Return what a law differs from its own straight line, shape (N,), filtered as all are."""
    out = []
    for stretch in rows.unfiltered:
        speed = np.abs(stretch.velocity_rad_s)
        line = values["coulomb_nm"] + values["viscous_nm_s_per_rad"] * speed
        bend = stretch.direction * (LAWS[model].torque(speed, values) - line)
        out.append(lowpass(bend, stretch.period_s, cutoff_hz)[stretch.usable])
    return np.concatenate(out)


def _put(parameter: Parameter, by: float, stays: bool) -> Parameter:
    """Return a parameter where it is moved to, and an interval that holds it at both places."""
    if parameter.ci95 is None:
        return parameter
    low, high = parameter.ci95
    value = parameter.value if stays else parameter.value + by
    return replace(parameter, value=value, ci95=(low + min(by, 0.0), high + max(by, 0.0)))
