"""What the driven range does not say: laws beyond it, and where a cable hangs free."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.forms.balancer import COIL, FORCE
from agent.explain.rows.run import Run
from agent.explain.study import Study
from agent.identify.result import Floats
from agent.numbers import significant
from agent.physics.learnt_over import beyond, known_to, noted, ranges_of
from agent.physics.twin import Twin

_WARMTH, _GEARBOX = "temperature-dependent-friction", "gearbox_temperature_degc"
_DEGREES = math.degrees(1.0)
_ELSEWHERE = "spring at rest elsewhere"
_ALSO = (
    "a cable that hangs free at another angle, beside a constant torque (an offset of the reading, "
    "or friction that differs between the directions), is the same on every motion of this axis: "
    "read the drive's torque with the brake closed and the power stage off, which shows an offset "
    "alone"
)
_SINE = (
    "the part of a balancer's force that grows with its length pulls by a sine of the arm's angle, "
    "as a weight does"
)
_TO_TELL = "with the spring taken off, or from its data sheet, the two can be told"
_STIFF = f"{_SINE}: its stiffness is what the simulation's own weight, taken as right, leaves of it"
_WEIGHS = f"{_SINE}: what is told as a payload may in part be that; {_TO_TELL}"


def noted_in(found: Study) -> Twin:
    """Return the extended twin with the ranges that its laws were learnt over."""
    if not found.choice.terms:
        return found.extended
    extra = {**found.extended.extra, **noted(_ranges(found.table.runs))}
    return replace(found.extended, extra=extra)


def further(found: Study, runs: Sequence[Run], holdout: Sequence[Run]) -> tuple[str, ...]:
    """Return where hold-outs go beyond what laws that were found were learnt over.

    Parameters
    ----------
    found : Study
    runs, holdout : sequence of Run
        Learnt from, and not.
    """
    where = beyond(_ranges(runs), _ranges(holdout)) if holdout and found.choice.terms else ()
    if not where:
        return ()
    return (
        f"the recordings held out go beyond those to learn from ({'; '.join(where)}): what was "
        "found is carried on there, and not known",
    )


def otherwise_warm(found: Study) -> str:
    """Return that friction told as wrong may be a gear's that is otherwise warm; or nothing.

    Where the twin notes over which temperatures it was learnt, and no law says what warmth does.
    """
    laws = {e.id for e in found.twin.effects} | {t.scored.form.effect for t in found.choice.terms}
    if _WARMTH in laws or not any(n.effect == "wrong-number" for n in found.numbers):
        return ""
    learnt, driven = (
        {name: ends for name, ends in ranges.items() if name == _GEARBOX}
        for ranges in (known_to(found.twin), _ranges(found.table.runs))
    )
    where = beyond(learnt, driven)
    if not where:
        return ""
    return (
        f"{where[0]}: friction changes with a gear's warmth, and what is told as a wrong number "
        "may be right at the temperature at which it was learnt; recordings at both would tell"
    )


def own_law_unseen(found: Study) -> str:
    """Return that a wrong number may be a law of warmth of the simulation's own; or nothing.

    Recordings at one temperature do not tell a law that is off there from a friction that is.
    """
    own = any(law.id == _WARMTH for law in found.twin.effects)
    if not own or _WARMTH not in found.not_judged:
        return ""
    if not any(n.effect == "wrong-number" for n in found.numbers):
        return ""
    return (
        "these recordings do not show what warmth does, and the simulation has a law of it: what "
        "is told as a wrong number holds at their temperature, and may be that law, which is off "
        "there; recordings at another temperature would tell"
    )


def or_warmth(found: Study, effect: str) -> bool:
    """Return whether an effect may be the gear's warmth as well, as no temperature was recorded."""
    return effect == "friction-drift" and not found.table.has(_GEARBOX)


def may_be_warmth(found: Study) -> str:
    """Return that friction told as changing with time may follow the gear's warmth; or nothing."""
    if not any(or_warmth(found, term.scored.form.effect) for term in found.choice.terms):
        return ""
    return (
        "no gearbox temperature was recorded, and a gear that is warm from being driven, or cold "
        "in the morning, changes its friction from recording to recording as well: with the "
        "temperature the two can be told"
    )


def hangs_free(found: Study) -> str:
    """Return what a cable that pulls to an angle elsewhere may as well be; nothing without one."""
    if not any(term.scored.form.name == _ELSEWHERE for term in found.choice.terms):
        return ""
    free = [
        float(e.parameters["neutral_arm_rad"])
        for e in found.extended.effects
        if e.id == "cable-force" and "neutral_arm_rad" in e.parameters
    ]
    low, high = found.library.scene.stroke_arm_rad()
    if not free:
        return ""
    outside = "" if low <= free[-1] <= high else ", where these recordings have not been"
    where = significant(free[-1] * _DEGREES, 3)
    return f"the cable would hang free at {where} degrees{outside}: {_ALSO}"


def carries(found: Study) -> str:
    """Return what a balancer's spring cannot be told apart from; nothing without one."""
    forms = {term.scored.form for term in found.choice.terms}
    if COIL in forms:
        return _STIFF
    told = {n.effect for n in found.numbers} | {form.effect for form in forms}
    return _WEIGHS if FORCE in forms and "gravity-imbalance" in told else ""


def _ranges(runs: Sequence[Run]) -> dict[str, tuple[float, float]]:
    """Return what some recordings drove through."""
    columns: dict[str, list[Floats]] = {}
    for run in runs:
        signals = run.signals
        if signals.position_rad is not None:
            arm = signals.position_rad / signals.gear_ratio
            columns.setdefault("arm_position_rad", []).append(arm)
        if signals.velocity_rad_s is not None:
            columns.setdefault("velocity_rad_s", []).append(signals.velocity_rad_s)
        if "gearbox_temperature_degc" in run.columns:
            name = "gearbox_temperature_degc"
            columns.setdefault(name, []).append(run.columns[name])
    return ranges_of({name: np.concatenate(parts) for name, parts in columns.items()})
