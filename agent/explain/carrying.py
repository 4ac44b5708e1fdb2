"""A study of recordings: beside the payloads that they state, without what nobody can know."""

from __future__ import annotations

import math
from collections.abc import Container, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Finding
from agent.explain.choosing.materiality import CLOSE
from agent.explain.findings import energy_nm2
from agent.explain.numbers.loads import Loads, load_finding, loads_of
from agent.explain.numbers.model import left_by, predicted
from agent.explain.rows.beginnings import begun, without_beginnings
from agent.explain.rows.creep import without_creep
from agent.explain.rows.forgetting import forgetting
from agent.explain.rows.images import imaged, orders_in, without_images
from agent.explain.rows.left_out import left_out_as_in
from agent.explain.rows.table import Table, tabulate
from agent.explain.study import Study, study
from agent.identify.result import Floats, Parameter
from agent.physics.twin import Twin

_MOST_BEGUN = 3  # times an arm that remembers longer is asked for once more
_MOST_ROUNDS = 2
_WORTH = 0.95  # of the mean square: what is left where all is known
_MUCH = 3.0  # times the noise: so much is left by more than beginnings
_HALF = 0.5  # of by how much a written twin is off
_KEPT = 0.5  # of what slides: with fewer samples nothing is asked once more


@dataclass(frozen=True)
class Given:
    """The twin as given, its table, and what payloads add that it does not know.

    `refitted` is the twin as given with its own numbers refitted, where that is not the study's.
    """

    twin: Twin
    table: Table
    loads: Loads | None
    refitted: Twin | None = None


def studied(twin: Twin, table: Table, among: Container[str] | None = None) -> tuple[Study, Given]:
    """Return the study of what a twin leaves beside the payloads that its recordings state.

    What payloads add is learnt once more beside the effects that were found, and these are looked
    for again where it has moved by more than its own intervals: with all others where more than
    noise was left beside them.

    Parameters
    ----------
    twin : Twin
        As given.
    table : Table
        Of recordings that slide.
    among : container of str, optional
        The effects to choose from; all.
    """
    loads = loads_of(twin, table)
    if loads is None:
        return study(twin, table, among), Given(twin, table, None)
    found = _beside(loads, twin, table, among)
    for _ in range(_MOST_ROUNDS):
        beside = _effects_nm(found.extended, table) - _effects_nm(twin, table) - loads.torque_nm
        again = loads_of(twin, table, beside)
        if again is None or not _moved(loads, again):
            break
        known = among if found.left.over_floor > CLOSE else _named_or_rivals(found)
        loads, found = again, _beside(again, twin, table, known)
    return found, Given(twin, table, loads)


def without_their_images(twin: Twin, found: Study, given: Given) -> tuple[Study, Given]:
    """Return what is found where no samples show the image of a wave that was found.

    The same where no more than the noise floor is left all the same, or no less without them; and
    where so many samples are of that kind that the rest would be another recording.

    Parameters
    ----------
    twin : Twin
        As given.
    found : Study
    given : Given
        As `studied` returned them.
    """
    orders = orders_in(found.extended)
    rows = found.library.weighing.rows
    if found.left.over_floor <= CLOSE or not imaged(found.table, orders)[rows].any():
        return found, given
    return _once_more(twin, found, given, without_images(given.table, orders))


def without_unknown_beginnings(twin: Twin, found: Study, given: Given) -> tuple[Study, Given]:
    """Return what is found where it is known how an arm behind the gear that was found swings.

    The same where no more than the noise floor is left all the same, or hardly more by what nobody
    knows, or far more without that; and as for waves' images. Only what was found is asked for
    again, and what may stand in its place: all else was looked for where the beginnings were in the
    data.

    Parameters
    ----------
    twin, found, given
        As for `without_their_images`.
    """
    for _ in range(_MOST_BEGUN):
        arm = forgetting(found.extended)
        if arm is None:
            break
        known = ~begun(found.table, arm)[found.library.weighing.rows]
        otherwise = _begins_otherwise(found, known)
        if not otherwise and not _hardly_known(found, known):
            break
        apart, least = without_beginnings(given.table, arm), CLOSE if otherwise else 0.0
        again = _once_more(twin, found, given, apart, _named_or_rivals(found), least=least)
        if again[0] is found:
            break
        found, given = again  # its arm may remember longer
    return found, given


def _hardly_known(found: Study, known: NDArray[np.bool_]) -> bool:
    """Return whether more than noise is left, and a part of that where nobody knows how it began.

    But not where far more than noise is left without that.
    """
    if found.left.over_floor <= CLOSE and not found.left.without_measure:
        return False
    squares = found.model.residual_nm**2
    if not known.any() or float(np.mean(squares[known])) > _WORTH * float(np.mean(squares)):
        return False
    return float(np.mean(squares[known])) <= (_MUCH * found.left.noise_nm) ** 2


def _begins_otherwise(found: Study, known: NDArray[np.bool_]) -> bool:
    """Return whether the written twin is off for the most part as its arm began otherwise.

    The search's columns have the arm begin as it follows the motor, the twin's law as it is
    accelerated; which of them, or neither, nobody knows of a recording that begins in motion.

    Parameters
    ----------
    found : Study
    known : ndarray of bool, shape (m,)
        Which of the compared rows no unknown beginning reaches.
    """
    written = left_by(found.extended, found.table)[found.library.weighing.rows] ** 2
    as_found = found.model.residual_nm**2
    if not known.any() or not np.nanmean(written) > CLOSE**2 * np.mean(as_found):
        return False
    more = np.nan_to_num(written) - as_found
    return bool(np.mean(more[known]) < _HALF * np.mean(more))


def _named_or_rivals(found: Study) -> frozenset[str]:
    """Return the effects that were found, and those that may stand in their place."""
    terms = found.choice.terms
    rivals = (rival.scored.form.effect for term in terms for rival in term.rivals)
    return frozenset((*(term.scored.form.effect for term in terms), *rivals))


def _once_more(
    twin: Twin,
    found: Study,
    given: Given,
    apart: Table,
    among: Container[str] | None = None,
    *,
    least: float = 0.0,
) -> tuple[Study, Given]:
    """Return what is found in a part of a table; the same where little is left of it, or gained.

    Or where it is less than `least` times the noise; where no floor is known, than as many times
    what was left before.
    """
    if np.count_nonzero(apart.sliding) < _KEPT * np.count_nonzero(given.table.sliding):
        return found, given
    again, asked = studied(twin, apart, among)
    better = again.left.over_floor < max(found.left.over_floor, least)
    if not found.floor.value_nm > 0.0:
        better = again.left.left_nm < max(least, 1.0) * found.left.left_nm
    return (again, asked) if better else (found, given)


def with_load(findings: Sequence[Finding], found: Study, given: Given) -> tuple[Finding, ...]:
    """Return findings with that of the payloads among them, what accounts for most first."""
    if given.loads is None:
        return tuple(findings)
    rows, floor = found.library.weighing.rows, found.floor.value_nm
    before, left = given.table.target_nm[rows], found.table.target_nm[rows]
    load = load_finding(given.loads, before, left, floor if floor > 0.0 else 0.0)
    energy = float(np.mean(before**2)) - float(np.mean(left**2))
    at = sum(energy_nm2(found, f) > energy for f in findings)
    ordered = (*findings[:at], load, *findings[at:])
    return tuple(replace(f, rank=rank) for rank, f in enumerate(ordered, start=1))


def _beside(loads: Loads, twin: Twin, table: Table, among: Container[str] | None) -> Study:
    """Return the study of a twin that knows the payloads."""
    knowing = loads.carried_by(twin)
    own = tabulate(
        knowing,
        table.runs,
        table.cutoff_hz,
        align_velocity=table.aligned,
        elsewhere=table.elsewhere,
    )
    own = replace(
        left_out_as_in(without_creep(own), table), one_zero=table.one_zero, one_load=table.one_load
    )
    return study(knowing, own, among)


def _effects_nm(twin: Twin, table: Table) -> Floats:
    return predicted(table, twin) - predicted(table, replace(twin, effects=()))


def _moved(before: Loads, after: Loads) -> bool:
    """Return whether a number has moved out of its interval."""
    return any(
        abs(p.value - before.numbers[name].value) > _half(p)
        for name, p in after.numbers.items()
        if name in before.numbers
    )


def _half(parameter: Parameter) -> float:
    ci = parameter.ci95
    return math.inf if ci is None else 0.5 * (ci[1] - ci[0])
