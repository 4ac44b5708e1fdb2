"""A recorded simulation and the joint, asked the other way round: what the simulation has too much.

A recorded simulation cannot be taken apart as a twin can. But what it has more of than the joint is
what the joint would lack if it were the simulation, and laws have signs there as well. What is
found so is taken off the recorded simulation, and everything is asked again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.answer.result import Explanation, Finding
from agent.explain.numbers.model import predicted
from agent.explain.own_effects.better import is_settled
from agent.explain.own_effects.doubted import Doubted, refitted_of
from agent.explain.own_effects.pairs import finding_of
from agent.explain.rows.in_step import hats, least
from agent.explain.rows.run import SIMULATED, Run
from agent.explain.rows.table import Table
from agent.physics.twin import Effect, Twin
from agent.samples import usable

BOTH_WAYS = frozenset(
    {
        "torque-constant-error",
        "torque-offset",
        "direction-asymmetry",
        "torque-ripple",
        "kinematic-error",
        "resolver-error",
        "gravity-imbalance",
        "position-dependent-friction",
        "local-fault",
        "torque-saturation",
    }
)
"""Effects that have no sign, or that a prediction may not be clipped by: a joint lacks these.

But those that one of both torques has by itself, and the other has not: see `the_simulations_own`.
"""

BY_ITSELF = frozenset({"torque-ripple", "position-dependent-friction", "local-fault"})
_NONE_OF_IT, _ALL_OF_IT = 0.35, 0.65  # of a law: so much at most, or least, is in a torque


def exchanged(runs: Sequence[Run]) -> tuple[Run, ...]:
    """Return recordings in which measured and simulated torque have changed places."""
    out = []
    for run in runs:
        signals, simulated_nm = run.signals, run.columns[SIMULATED]
        valid = signals.valid & usable(simulated_nm)
        columns = {**run.columns, SIMULATED: signals.torque_nm}
        signals = replace(signals, torque_nm=simulated_nm, valid=valid)
        out.append(replace(run, signals=signals, columns=columns, exchanged=True))
    return tuple(out)


def the_simulations_own(twin: Twin, table: Table, answer: Explanation) -> frozenset[str]:
    """Return which effects of an answer are in the simulated torque alone, and not in the joint's.

    A wave of the motor's angle or a bump along the path is nothing that a plain joint has: where
    the measured torque has none, it is not missing, and the simulation has it too much.

    Parameters
    ----------
    twin : Twin
        As given beside the recorded simulation.
    table : Table
        Of the recordings to learn from, as they are.
    answer : Explanation
    """
    laws = () if answer.twin is None else answer.twin.effects[len(twin.effects) :]
    asked = [law for law in laws if law.id in BY_ITSELF]
    joints = {law.id for law in asked if not _is_its_own(twin, table, law)}
    return frozenset(law.id for law in asked) - joints


def _is_its_own(twin: Twin, table: Table, law: Effect) -> bool:
    """Return whether a law is in the simulated torque by itself, and not in the measured one."""
    plain = replace(twin, effects=())
    torque = predicted(table, replace(plain, effects=(law,))) - predicted(table, plain)
    simulated = table.measured_nm - table.target_nm
    rows = table.sliding & np.isfinite(torque) & np.isfinite(simulated)
    if not rows.any():
        return False
    speed, way = (f(table.rows["velocity_rad_s"][rows]) for f in (np.abs, np.sign))
    columns = np.column_stack((torque[rows], table.base[rows], way[:, np.newaxis] * hats(speed)))
    joints, own = (least(columns, each[rows])[0] for each in (table.measured_nm, simulated))
    return bool(abs(joints) < _NONE_OF_IT and own < -_ALL_OF_IT)


def too_much_of(
    twin: Twin,
    table: Table,
    answer: Explanation,
    other_way: Explanation,
    own: frozenset[str] = frozenset(),
) -> tuple[Doubted, ...]:
    """Return a recorded simulation as twins that have what was found the other way round.

    The greatest law with a sign alone, as the others may stand for what the joint has more than the
    simulation; and all of them where that settles the question.

    Parameters
    ----------
    twin : Twin
        As given beside the recorded simulation.
    table : Table
        Of the recordings to learn from, as they are.
    answer, other_way : Explanation
        Of the recordings as they are, and of the exchanged ones.
    own : frozenset of str
        Effects without a sign that are the simulation's all the same.
    """
    if other_way.twin is None:
        return ()
    found: list[tuple[Finding, Effect]] = []
    for effect in other_way.twin.effects:
        paired = {finding.rank for finding, _ in found}
        finding = finding_of(effect, other_way.findings, paired)
        if finding is not None and (effect.id not in BOTH_WAYS or effect.id in own):
            found.append((finding, effect))
    found.sort(key=lambda pair: -pair[0].energy_share)
    sets = [found[:1]] if found else []
    if len(found) > 1 and is_settled(other_way):
        sets.append(found)
    return tuple(_having(twin, table, answer, each) for each in sets)


def _having(
    twin: Twin, table: Table, answer: Explanation, found: Sequence[tuple[Finding, Effect]]
) -> Doubted:
    """Return a recorded simulation as a twin that has some laws more."""
    having = replace(twin, effects=(*twin.effects, *(effect for _, effect in found)))
    excess = {place: f for place, (f, _) in enumerate(found, start=len(twin.effects))}
    asked = replace(table, twin=having)
    return Doubted(having, refitted_of(having, answer), asked, tuple(excess), excess)


def freed(runs: Sequence[Run], doubted: Doubted) -> tuple[Run, ...]:
    """Return recordings whose simulation has none of what is doubted of it."""
    return less(runs, [doubted.twin.effects[place] for place in doubted.places])


def less(runs: Sequence[Run], laws: Sequence[Effect]) -> tuple[Run, ...]:
    """Return recordings whose simulation has none of some laws."""
    return tuple(replace(run, simulated_less=tuple(laws)) for run in runs)
