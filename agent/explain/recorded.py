"""What is told of a recorded simulation, which is asked both ways where that may matter."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from agent.explain.answer import words
from agent.explain.answer.names import OWN_NUMBER, effect_name
from agent.explain.answer.result import Explanation
from agent.explain.asked import tabulated
from agent.explain.choosing.materiality import MATERIAL
from agent.explain.choosing.rivals import WEIGHT
from agent.explain.location.moments import Moments
from agent.explain.looked import Known
from agent.explain.numbers.model import predicted
from agent.explain.once import asked_once
from agent.explain.own_effects.against import told_against
from agent.explain.own_effects.better import (
    SETTLED,
    is_better,
    is_settled,
    mismatch_nm2,
    settles_more,
)
from agent.explain.own_effects.doubted import Doubted, refitted_of
from agent.explain.own_effects.other_way import (
    BOTH_WAYS,
    BY_ITSELF,
    exchanged,
    freed,
    less,
    the_simulations_own,
    too_much_of,
)
from agent.explain.rows.creep import without_creep
from agent.explain.rows.run import Run
from agent.explain.rows.table import Table
from agent.identify.result import Floats
from agent.physics.twin import Effect, Twin
from trajectories import AxisLimits

_CABLE = "cable-force"
_PLAINER = 0.7  # times the torque that the first answer asks for


def told_both_ways(
    answer: Explanation,
    moments: Moments | None,
    twin: Twin,
    runs: Sequence[Run],
    holdout: Sequence[Run],
    limits: AxisLimits | None,
) -> tuple[Explanation, Moments | None]:
    """Return an answer about a recorded simulation, or the better one of what it has too much.

    The joint lacks that in the simulation's place. Asked is where the answer is not settled, has
    a law with a sign, or several, or one that the simulated torque has by itself.
    """
    one_sided = _is_one_sided(answer) or WEIGHT in _effects(answer)  # a weight may be a cable
    plain = is_settled(answer) and len(answer.findings) < 2 and not one_sided
    if plain and not BY_ITSELF & _effects(answer):
        return answer, moments
    asked, table = tabulated(twin, runs, holdout)
    table = without_creep(table)
    own = the_simulations_own(twin, table, answer)
    if plain and not own:
        return answer, moments
    known = Known(band_hz=table.cutoff_hz)
    joint = refitted_of(twin, answer)  # as far as a twin knows it
    turned = exchanged(asked.runs), exchanged(asked.holdout)
    other_way, _ = asked_once(joint, *turned, limits, known)
    # Without a sign here it is called missing, but for what the simulation has by itself.
    same = _effects(other_way) == _effects(answer) and not own
    as_well = _as_well_said(other_way) if is_settled(answer) and not same else ()
    stays = replace(answer, reasons=(*answer.reasons, *as_well)), moments
    ways: tuple[Explanation, ...] = (other_way,)
    stands = is_settled(answer) and not own
    if stands and (
        same
        or not (is_better(other_way, answer) or _is_plainer(table, twin, answer, joint, other_way))
    ):
        ways = tuple(
            asked_once(joint, less(turned[0], others), less(turned[1], others), limits, known)[0]
            for others in _beside_one_sided(answer, twin)
        )
    trials: list[tuple[int, float, Explanation, Moments | None]] = []
    most_nm = _PLAINER * _asked_for_nm(table, twin, answer)
    for doubted in (each for way in ways for each in too_much_of(twin, table, answer, way, own)):
        lighter, unseen = freed(runs, doubted), freed(holdout, doubted)
        bare, apart = asked_once(twin, lighter, unseen, limits, replace(known, doubted=doubted))
        asks_nm = _too_much_nm(table, twin, doubted) + _asked_for_nm(table, twin, bare)
        plainer = _explains_as_much(bare, answer) and asks_nm < most_nm
        told = _told(doubted, answer, bare, own, plainer=plainer)
        if told is not None:
            trials.append((-SETTLED[told.verdict], asks_nm, told, apart))
    if not trials:
        return stays
    _, _, told, apart = min(trials, key=lambda trial: trial[:2])
    if told.verdict == "tied" and told.next_experiment is None:
        told = replace(
            told,
            next_experiment=other_way.next_experiment,
            further_experiments=other_way.further_experiments,
        )
    return told, apart


def _told(
    doubted: Doubted, answer: Explanation, bare: Explanation, own: frozenset[str], *, plainer: bool
) -> Explanation | None:
    """Return the answer with what is doubted taken off the simulation, where it is to be told.

    Parameters
    ----------
    doubted : Doubted
    answer, bare : Explanation
        Of the simulation as it was recorded, and without what is doubted.
    own : frozenset of str
        What the simulated torque has by itself.
    plainer : bool
        Whether it explains as much with far less torque.
    """
    taken = {doubted.twin.effects[place].id for place in doubted.places}
    # What is in the simulation alone is not missing, whichever of its laws takes that off.
    instead = bool(own) and _leaves_as_little(bare, answer)
    # Weights have no sign, cables have: a line that fits by far better than a sine is none.
    instead |= WEIGHT in _effects(answer) and _CABLE in taken and settles_more(bare, answer)
    told = told_against(doubted, answer, bare, plainer=plainer or instead)
    if told is None or not instead or SETTLED[told.verdict] >= SETTLED[answer.verdict]:
        return told
    told = replace(told, verdict=answer.verdict)  # of the same mismatch, and what is left
    return replace(told, sentence=words.summary_of(told))


def _beside_one_sided(answer: Explanation, twin: Twin) -> Iterator[tuple[Effect, ...]]:
    """Yield the laws of an answer beside each that has a sign, where it has several.

    What the simulation has too much of shows the other way round where the joint's own laws are in
    both: of what the joint has more there may be none with the other sign.
    """
    laws = () if answer.twin is None else answer.twin.effects[len(twin.effects) :]
    for law in laws if len(laws) > 1 else ():
        if law.id not in BOTH_WAYS:
            yield tuple(other for other in laws if other is not law)


def _effects(answer: Explanation) -> set[str]:
    return {finding.effect for finding in answer.findings}


def _is_one_sided(answer: Explanation) -> bool:
    """Return whether an answer has a law with a sign: the other way round there may be another."""
    return any(f.effect not in BOTH_WAYS and f.form != OWN_NUMBER for f in answer.findings)


def _is_plainer(
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
    if not other_way.findings or not _explains_as_much(other_way, answer):
        return False
    return _asked_for_nm(table, joint, other_way) < _PLAINER * _asked_for_nm(table, twin, answer)


def _explains_as_much(other: Explanation, answer: Explanation) -> bool:
    """Return whether another answer is settled, and the first one no better."""
    if not is_settled(other) or SETTLED[other.verdict] < SETTLED[answer.verdict]:
        return False
    return not is_better(answer, other)


def _leaves_as_little(other: Explanation, answer: Explanation) -> bool:
    """Return whether another answer leaves no more than the first, but for what has no name."""
    more = other.extended.rmse_nm**2 - answer.extended.rmse_nm**2
    return more <= MATERIAL * mismatch_nm2(answer)


def _asked_for_nm(table: Table, twin: Twin, answer: Explanation) -> float:
    """Return how much torque an answer adds to a twin and to its own numbers, rms, N m."""
    if answer.twin is None:
        return math.inf
    plain, rows = replace(answer.twin, effects=twin.effects), table.sliding
    moved = predicted(table, plain) - predicted(table, twin)
    laws = predicted(table, answer.twin) - predicted(table, plain)
    return _rms(moved[rows]) + _rms(laws[rows])


def _too_much_nm(table: Table, twin: Twin, doubted: Doubted) -> float:
    """Return the torque that is taken off a recorded simulation, rms, N m."""
    return _rms((predicted(table, doubted.twin) - predicted(table, twin))[table.sliding])


def _rms(torque_nm: Floats) -> float:
    return float(np.sqrt(np.nanmean(torque_nm**2)))


def _as_well_said(other_way: Explanation) -> tuple[str, ...]:
    """Return that what a simulation has too much of explains as much; nothing where it does not."""
    if not is_settled(other_way) or not _is_one_sided(other_way):
        return ()
    names = dict.fromkeys(effect_name(f.effect) for f in other_way.findings)
    return (
        "asked the other way round, too much in the simulation explains these recordings as well: "
        f"{'; '.join(names)}",
    )
