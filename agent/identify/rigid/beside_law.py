"""What the rigid body is beside a friction law that is no straight line.

The rigid body's friction is Coulomb's and viscous: a straight line through the curve. Where the
steady speeds show that friction is bent, the line is no part of it, and what it leaves at every
ramp and reversal is shared out among inertia, gravity and offset, and taken for noise. So what the
law differs from its own straight line is taken off the torque, and the rigid body is fitted to the
rest: inertia, gravity and offset, with their intervals, are those. Coulomb and viscous friction are
the law's where it contradicts the line. The straight line remains for what has no other friction: a
twin, and a prediction. Beside a spring the intervals stay as wide as the line's: of a spring only
the first term takes part, and what it lacks bends the inertia by more than scatters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from agent.identify.friction.law_fit import fit_percent
from agent.identify.result import Floats, FrictionModelFit, Parameter, RigidBodyFit
from agent.identify.rigid.body import fit_rigid_body, weights
from agent.identify.rigid.regression import Regression, over_both
from agent.identify.rigid.rows import Rows
from agent.identify.signals.lowpass import lowpass
from agent.physics.friction import COULOMB_VISCOUS, FEENY_MOON, LAWS

_LINE = COULOMB_VISCOUS.linear
NOTE = (
    "friction bends with speed: where the friction law differs from a straight line, Coulomb and "
    "viscous friction are the law's; fit and residual of the rigid body are the line's"
)


def beside_law(regression: Regression, models: Sequence[FrictionModelFit]) -> RigidBodyFit | None:
    """Return the rigid body beside the selected law.

    Parameters
    ----------
    regression : Regression
        With friction as a straight line.
    models : sequence of FrictionModelFit
        Of the friction curve; without one that is bent and selected nothing changes.
    """
    line, rows = regression.body, regression.rows
    selected = next((m for m in models if m.selected), None)
    if line is None or selected is None or not is_bent(models):
        return line
    values = {name: p.value for name, p in selected.parameters.items()}
    if not np.isfinite(list(values.values())).all():
        return line
    beside = _fit(rows, selected.model, values, regression.cutoff_hz)
    if beside is not None and regression.reaches_over is not None:
        other = _fit(regression.reaches_over, selected.model, values, regression.cutoff_hz)
        beside = beside if other is None else over_both(beside, other)
    if beside is None:
        return line
    if beside.spring_took_part:
        beside = replace(beside, parameters=_no_narrower(beside.parameters, line.parameters))
    straight = {n: p.value for n, p in line.parameters.items() if n in _LINE and p.identified}
    beside = replace(
        beside,
        parameters=dict(beside.parameters) | _friction(selected, line, straight),
        straight_line=straight,
        as_twin=_as_twin(line, beside, straight),
    )
    predicted = rows.columns @ weights(beside)
    return replace(
        beside,
        rmse_nm=float(np.sqrt(np.mean((rows.torque_nm - predicted) ** 2))),
        fit_percent=fit_percent(rows.torque_nm, predicted),
    )


def is_bent(models: Sequence[FrictionModelFit]) -> bool:
    """Return whether the selected law is another than Coulomb's and viscous friction."""
    return any(m.selected and m.model != COULOMB_VISCOUS.name for m in models)


def _fit(
    rows: Rows, model: str, values: Mapping[str, float], cutoff_hz: float
) -> RigidBodyFit | None:
    """Fit the rigid body to what a law's bend leaves of the torque."""
    bend_nm = _bend(rows, model, values, cutoff_hz)
    return fit_rigid_body(replace(rows, torque_nm=rows.torque_nm - bend_nm))


def _bend(rows: Rows, model: str, values: Mapping[str, float], cutoff_hz: float) -> Floats:
    """Return what a law differs from its own straight line, shape (N,), filtered as all are."""
    level_nm = values["coulomb_nm"]
    if model == FEENY_MOON.name:
        level_nm *= values["mu"]
    out = []
    for stretch in rows.unfiltered:
        speed = np.abs(stretch.velocity_rad_s)
        line = level_nm + values["viscous_nm_s_per_rad"] * speed
        bend = stretch.direction * (LAWS[model].torque(speed, values) - line)
        out.append(lowpass(bend, stretch.period_s, cutoff_hz)[stretch.usable])
    return np.concatenate(out)


def _no_narrower(
    own: Mapping[str, Parameter], other: Mapping[str, Parameter]
) -> dict[str, Parameter]:
    """Return parameters whose intervals are at least as wide as other ones', about their values."""
    out = dict(own)
    for name, parameter in own.items():
        ends = other[name].ci95
        if parameter.ci95 is None or ends is None:
            continue
        half, (low, high) = 0.5 * (ends[1] - ends[0]), parameter.ci95
        wider = (min(low, parameter.value - half), max(high, parameter.value + half))
        out[name] = replace(parameter, ci95=wider)
    return out


def _friction(
    law: FrictionModelFit, line: RigidBodyFit, straight: Mapping[str, float]
) -> dict[str, Parameter]:
    """Return the law's Coulomb and viscous friction, for those that the straight line has.

    Where the law is too uncertain to contradict the line, the line is the better number, and where
    it is Feeny and Moon's, whose own level is that at rest: a fall that is seen and not there, over
    all speeds, leaves the level after it anywhere.
    """
    coulomb = law.parameters["coulomb_nm"]
    if law.model == FEENY_MOON.name:
        coulomb = _product(coulomb, law.parameters["mu"])
    own = {_LINE[0]: coulomb, _LINE[1]: law.parameters[_LINE[1]]}
    stays = law.model == FEENY_MOON.name
    return {name: _either(own[name], line.parameters[name], stays) for name in straight}


def _either(of_law: Parameter, of_line: Parameter, stays: bool) -> Parameter:
    """Return a law's number, or the line's in an interval of both where the law allows it."""
    if of_law.ci95 is None or of_line.ci95 is None:
        return of_law
    (low, high), other = of_law.ci95, of_line.ci95
    if not (stays or low <= of_line.value <= high):
        return of_law
    return replace(of_line, ci95=(min(low, other[0]), max(high, other[1])))


def _product(level: Parameter, share: Parameter) -> Parameter:
    """Return the level after Feeny and Moon's fall, in an interval that no pair of ends leaves."""
    value = level.value * share.value
    if level.ci95 is None or share.ci95 is None:
        why = level.reason if level.ci95 is None else share.reason
        return Parameter.not_identified(why, value)
    return Parameter(value, (level.ci95[0] * share.ci95[0], level.ci95[1] * share.ci95[1]))


def _as_twin(
    line: RigidBodyFit, beside: RigidBodyFit, straight: Mapping[str, float]
) -> dict[str, float]:
    """Return what a twin takes: friction as a straight line, all else as it is beside the law."""
    if not line.as_twin and not beside.as_twin:
        return {}
    found = {n: p.value for n, p in beside.parameters.items() if p.identified}
    friction = {n: v for n, v in line.as_twin.items() if n in _LINE} or dict(straight)
    others = {n: v for n, v in (beside.as_twin or found).items() if n not in _LINE}
    return others | friction
