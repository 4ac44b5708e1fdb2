"""What is found in recordings, and what that says of how they were recorded.

Before anything is told: whether a torque is late by half a sample, a velocity late itself, whether
the joint creeps, and whether some recordings are of another axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from agent.explain.another_axis import Aside, of_another_axis
from agent.explain.asked import Asked, tabulated
from agent.explain.carried import carried_by_some, weightless_said
from agent.explain.carrying import Given, studied
from agent.explain.choosing.weighted import DELAY
from agent.explain.numbers.late_velocity import (
    hides_in,
    is_much,
    later_than_usual,
    may_be_velocitys,
)
from agent.explain.numbers.model import left_by
from agent.explain.own_effects.doubted import Doubted
from agent.explain.rows.creep import creep_beside, without_creep
from agent.explain.rows.half_sample import half_a_sample_s
from agent.explain.rows.run import Run
from agent.explain.rows.table import Table
from agent.explain.study import Study
from agent.explain.undecidable import undecidable
from agent.identify.result import Parameter
from agent.physics.twin import Twin

_WAVES = frozenset({"kinematic-error", "resolver-error"})
_CLEARLY, _AS_LITTLE = 0.85, 1.02  # of what is left


@dataclass(frozen=True)
class Known:
    """What was found before, and is not asked again.

    Parameters
    ----------
    late_s : float
        By what half a sample the torque is late.
    creep_rad_s : float or None
        The creep that was seen: a small mismatch beside a late torque may hide it.
    band_hz : float or None
        The band of the recordings as they are: a simulation's torque has no noise to choose one by.
    carried : bool
        Whether what some recordings carry is taken off already.
    one_load : bool
        Whether all recordings carry the same, or what differs does not surely weigh anything.
    one_zero : bool
        Whether all recordings have one zero, or none shows.
    zeros_off : bool
        Whether their own zeros are taken off already; a hold-out's is read when all else is known.
    doubted : Doubted or None
        The twin as given, where what is asked about lacks some of its effects.
    aligned : bool or None
        Whether the velocity is to be brought in step with the position; None where it may show.
    for_a_delay : bool
        Whether it is because a first choice had a delay of the torque, which may not last.
    """

    late_s: float = 0.0
    creep_rad_s: float | None = None
    band_hz: float | None = None
    carried: bool = False
    one_load: bool = False
    one_zero: bool = False
    zeros_off: bool = False
    doubted: Doubted | None = None
    aligned: bool | None = None
    for_a_delay: bool = False


NOTHING = Known()


@dataclass(frozen=True)
class Looked:
    """What is found in recordings beside what is known of them.

    Parameters
    ----------
    known : Known
    asked : Asked
    table : Table
        Of the recordings, without what creeps.
    found : Study
    given : Given
    """

    known: Known
    asked: Asked
    table: Table
    found: Study
    given: Given


class NotAskableError(Exception):
    """Why recordings cannot be asked about."""


def looked_at(twin: Twin, runs: Sequence[Run], holdout: Sequence[Run], known: Known) -> Looked:
    """Return what is found; raise why recordings cannot be asked about."""
    try:
        asked, table = tabulated(
            twin, runs, holdout, known.late_s, known.band_hz, align_velocity=known.aligned
        )
        table = without_creep(table, known.creep_rad_s)
    except ValueError as error:
        raise NotAskableError(f"not decidable: {error}") from error
    refusal = undecidable(table, twin)
    if refusal:
        raise NotAskableError(refusal)
    told = replace(table, one_zero=known.one_zero, one_load=known.one_load)
    told = replace(told, in_step_for_a_delay=known.aligned is None)
    return Looked(known, asked, table, *studied(twin, told))


def in_step_where_much_is_left(
    looked: Looked, twin: Twin, runs: Sequence[Run], holdout: Sequence[Run]
) -> Looked:
    """Return what is found in step with the position, where that leaves less.

    That is asked only where far more than noise is left beside a velocity later than any usually
    is, or where one is told beside a wave. Such a delay keeps its name unless what is left is
    clearly less in step; but a wave that is computed of a late motion has another phase at every
    speed, and beside one nothing more needs to be left.
    """
    known, found = looked.known, looked.found
    if known.aligned is not None or not later_than_usual(looked.table):
        return looked
    delays, waves = _delays(found), not _WAVES.isdisjoint(_effects(found))
    if not all(may_be_velocitys(delay, looked.table) for delay in delays):
        return looked
    if not (delays and waves) and not is_much(found.left):
        return looked
    as_it_is = replace(looked, known=replace(known, aligned=False))
    try:
        in_step = looked_at(twin, runs, holdout, replace(known, aligned=True))
    except NotAskableError:
        return as_it_is
    most = (_AS_LITTLE if waves else _CLEARLY) if delays else 1.0
    return in_step if in_step.found.left.left_nm <= most * found.left.left_nm else as_it_is


def better_known(looked: Looked) -> Known | None:
    """Return what is known of the signals since something was found; None where it is no more."""
    known, found, table, asked = looked.known, looked.found, looked.table, looked.asked
    if known.aligned is None and any(hides_in(delay, table) for delay in _delays(found)):
        return replace(known, aligned=True)
    if known.for_a_delay and not known.late_s and not _delays(found):
        return replace(known, aligned=False, for_a_delay=False)
    if not known.late_s:
        late_s = _late_by_holding_s(found, (*asked.runs, *asked.holdout))
        if late_s:
            return replace(known, late_s=late_s, creep_rad_s=found.table.creep_rad_s or None)
    creep_rad_s = _creep_beside(found, table) if known.creep_rad_s is None else 0.0
    return replace(known, creep_rad_s=creep_rad_s) if creep_rad_s else None


def _creep_beside(found: Study, table: Table) -> float:
    """Return below which speed friction fades, rad/s, where only what was found lets it be seen."""
    if found.table.creep_rad_s or not found.choice.terms:
        return 0.0
    return creep_beside(table, left_by(found.extended, table))


def _late_by_holding_s(found: Study, runs: Sequence[Run]) -> float:
    """Return by what half a sample the torque was found to be late; 0 where it is not."""
    return sum(half_a_sample_s(delay, runs) for delay in _delays(found))


def _effects(found: Study) -> set[str]:
    return {term.scored.form.effect for term in found.model.terms}


def _delays(found: Study) -> list[Parameter]:
    """Return the delays of the torque that were found."""
    terms = zip(found.model.terms, found.model.parameters, strict=True)
    return [own["torque_delay_s"] for term, own in terms if term.scored.form.effect == DELAY]


def apart_from_all_others(looked: Looked, twin: Twin) -> Aside | None:
    """Return the few recordings that are as if of another axis; None where none is."""
    found = looked.found
    aside = of_another_axis(looked.table, found.floor.value_nm)
    carried = None if looked.known.carried or aside is not None else carried_by_some(found)
    if carried is None or not carried.is_sure(twin):
        return aside
    few = carried.are_a_few_without_it(twin, len(looked.table.runs))
    return Aside(carried.places, weightless_said(carried)) if few else None
