"""A recorded simulation and the joint, asked the other way round: what the simulation has too much.

A recorded simulation cannot be taken apart as a twin can. But what it has more of than the joint is
what the joint would lack if it were the simulation, and laws have signs there as well. What is
found so is taken off the recorded simulation, and everything is asked again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.answer.names import OWN_NUMBER, effect_name
from agent.explain.answer.result import Explanation, Finding
from agent.explain.numbers.model import predicted
from agent.explain.own_effects.better import SETTLED, is_better, is_settled
from agent.explain.own_effects.doubted import Doubted, refitted_of
from agent.explain.own_effects.pairs import finding_of
from agent.explain.rows.run import Run
from agent.explain.rows.table import Table
from agent.physics.twin import Effect, Twin
from agent.samples import usable

_COLUMN = "torque_simulated_nm"
_PLAINER = 0.7  # times the torque that the first answer asks for
_BOTH_WAYS = frozenset(
    {
        "torque-constant-error",
        "torque-offset",
        "direction-asymmetry",
        "torque-ripple",
        "kinematic-error",
        "resolver-error",
        "gravity-imbalance",
        "position-dependent-friction",
        "torque-saturation",
    }
)
"""Effects that have no sign, or that a prediction may not be clipped by: a joint lacks these."""


def exchanged(runs: Sequence[Run]) -> tuple[Run, ...]:
    """Return recordings in which measured and simulated torque have changed places."""
    out = []
    for run in runs:
        signals, simulated_nm = run.signals, run.columns[_COLUMN]
        valid = signals.valid & usable(simulated_nm)
        columns = {**run.columns, _COLUMN: signals.torque_nm}
        signals = replace(signals, torque_nm=simulated_nm, valid=valid)
        out.append(replace(run, signals=signals, columns=columns))
    return tuple(out)


def is_one_sided(answer: Explanation) -> bool:
    """Return whether an answer has a law with a sign: the other way round there may be another."""
    return any(f.effect not in _BOTH_WAYS and f.form != OWN_NUMBER for f in answer.findings)


def is_plainer(
    table: Table, twin: Twin, answer: Explanation, joint: Twin, other_way: Explanation
) -> bool:
    """Return whether the other of two answers that explain as much asks for far less torque.

    A fall of friction that the simulation has is friction that rises and bends instead, with next
    to no Coulomb friction beside it: two great torques that take each other back.

    Parameters
    ----------
    table : Table
        Of the recordings to learn from, as they are.
    twin, joint : Twin
        What either was asked of.
    answer, other_way : Explanation
    """
    if not is_settled(other_way) or SETTLED[other_way.verdict] < SETTLED[answer.verdict]:
        return False
    if not other_way.findings or is_better(answer, other_way):
        return False
    return _asked_for_nm(table, joint, other_way) < _PLAINER * _asked_for_nm(table, twin, answer)


def _asked_for_nm(table: Table, twin: Twin, answer: Explanation) -> float:
    """Return how much torque an answer adds to a twin and to its own numbers, rms, N m."""
    if answer.twin is None:
        return math.inf
    plain, rows = replace(answer.twin, effects=twin.effects), table.sliding
    moved = predicted(table, plain) - predicted(table, twin)
    laws = predicted(table, answer.twin) - predicted(table, plain)
    return sum(float(np.sqrt(np.nanmean(x[rows] ** 2))) for x in (moved, laws))


def as_well_said(other_way: Explanation) -> str:
    """Return that what a simulation has too much of explains as much; nothing where it does not."""
    if not is_settled(other_way) or not is_one_sided(other_way):
        return ""
    names = list(dict.fromkeys(effect_name(f.effect) for f in other_way.findings))
    return (
        "asked the other way round, too much in the simulation explains these recordings as well: "
        f"{'; '.join(names)}"
    )


def too_much_of(
    twin: Twin, table: Table, answer: Explanation, other_way: Explanation
) -> Doubted | None:
    """Return a recorded simulation as a twin that has what was found the other way round.

    None where nothing was found that has a sign. Where that is not the whole answer, it is the
    greatest one alone: the others may stand for what the joint has more than the simulation.

    Parameters
    ----------
    twin : Twin
        As given beside the recorded simulation.
    table : Table
        Of the recordings to learn from, as they are.
    answer, other_way : Explanation
        Of the recordings as they are, and of the exchanged ones.
    """
    if other_way.twin is None:
        return None
    before = len(twin.effects)
    excess: dict[int, Finding] = {}
    effects: list[Effect] = []
    paired: set[int] = set()
    for effect in other_way.twin.effects:
        finding = finding_of(effect, other_way.findings, paired)
        if finding is None or effect.id in _BOTH_WAYS:
            continue
        paired.add(finding.rank)
        excess[before + len(effects)] = finding
        effects.append(effect)
    if not effects:
        return None
    if not is_settled(other_way):
        place = max(excess, key=lambda place: excess[place].energy_share)
        effects, excess = [effects[place - before]], {before: excess[place]}
    having = replace(twin, effects=(*twin.effects, *effects))
    refitted = refitted_of(having, answer)
    return Doubted(having, refitted, replace(table, twin=having), tuple(excess), excess)


def freed(runs: Sequence[Run], doubted: Doubted) -> tuple[Run, ...]:
    """Return recordings whose simulation has none of what is doubted of it."""
    less = tuple(doubted.twin.effects[place] for place in doubted.places)
    return tuple(replace(run, simulated_less=less) for run in runs)
