"""One question about recordings and a simulation, none of whose own effects is doubted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain import proof
from agent.explain.another_axis import without_them
from agent.explain.another_gear import behind_another_gear
from agent.explain.answer.fits import UNSEEN
from agent.explain.answer.result import (
    Explanation,
    Holdout,
    NextExperiment,
    Trace,
    fit_of,
)
from agent.explain.answer.ties import is_tied
from agent.explain.asked import Asked, tabulated
from agent.explain.carried import Carried, beside_carried, carried_by_some, freed
from agent.explain.carrying import (
    Given,
    studied,
    without_their_images,
    without_unknown_beginnings,
)
from agent.explain.caveats import left_out_of_the_proof
from agent.explain.driven_range import further
from agent.explain.location.moments import Moments, in_beginnings, in_moments
from agent.explain.looked import (
    NOTHING,
    Known,
    Looked,
    NotAskableError,
    apart_from_all_others,
    better_known,
    in_step_where_much_is_left,
    looked_at,
)
from agent.explain.numbers.late_velocity import ToldAgainstItError
from agent.explain.numbers.loads import differs_unsaid, said_of
from agent.explain.numbers.model import left_by
from agent.explain.plausible import another_joint, contradiction, loses_the_weight
from agent.explain.rows.creep import creep_beside, without_creep
from agent.explain.rows.run import Run
from agent.explain.rows.table import TooShortError
from agent.explain.study import Study
from agent.explain.told import Told
from agent.explain.traces import traces_of
from agent.explain.unlike import held_out_apart
from agent.explain.unnamed import taken_back
from agent.explain.written_down import experiments, nothing_decided, written_down
from agent.explain.zeros import beside_zeros, on_one_zero, on_zeros_of_their_own, own_zeros
from agent.physics.twin import DrivingFrictionError, Twin, TwinError
from trajectories import AxisLimits

_STAND_IN = "parts of the other recordings stand in"
_DRIVES = (
    "the drift cannot have gone on: carried on to them it leaves friction below zero, and friction "
    "would drive the joint"
)


def asked_once(
    twin: Twin,
    runs: Sequence[Run],
    holdout: Sequence[Run],
    limits: AxisLimits | None = None,
    known: Known = NOTHING,
) -> tuple[Explanation, Moments | None]:
    """Return an explanation, and the moments of the recordings that hold most of what is left.

    None of the twin's own effects is doubted.

    A torque that turns out to be half a sample late is put in step, and everything asked again. So
    it is where a delay is told against a velocity that is late itself, where friction is seen to
    fade near standstill beside what was found only, where each recording has a zero of its own, or
    where some carry what others do not.
    """
    try:
        return _asked(twin, runs, holdout, limits, known)
    except ToldAgainstItError:
        known = replace(known, aligned=True, for_a_delay=True)
        return _asked(twin, runs, holdout, limits, known)


def _asked(
    twin: Twin,
    runs: Sequence[Run],
    holdout: Sequence[Run],
    limits: AxisLimits | None,
    known: Known,
) -> tuple[Explanation, Moments | None]:
    """Return the same, as far as a search need not end early to be asked again."""
    names = tuple(run.name for run in runs), tuple(run.name for run in holdout)
    refusal = "no recording was given"
    if runs:
        everything = (*runs, *holdout)
        refusal = contradiction(everything) or loses_the_weight(twin, everything)
    if refusal:
        return nothing_decided(f"not decidable: {refusal}", *names), None
    try:
        looked = looked_at(twin, runs, holdout, known)
        looked = in_step_where_much_is_left(looked, twin, runs, holdout)
    except NotAskableError as error:
        return nothing_decided(str(error), *names), None
    aside = apart_from_all_others(looked, twin)
    if aside is not None:
        places = [place for place in range(len(runs)) if place not in aside.places]
        rest = [runs[place] for place in places]
        again, moments = asked_once(twin, rest, holdout, limits, known)
        return without_them(again, aside), moments and moments.among(places)
    better = better_known(looked)
    if better is not None:
        return asked_once(twin, runs, holdout, limits, better)
    return _told_of(looked, twin, runs, holdout, limits)


def _told_of(
    looked: Looked,
    twin: Twin,
    runs: Sequence[Run],
    holdout: Sequence[Run],
    limits: AxisLimits | None,
) -> tuple[Explanation, Moments | None]:
    """Return what is told of what was found, once zeros and loads of some recordings are off."""
    known, asked, found, given = looked.known, looked.asked, looked.found, looked.given
    rows = found.library.weighing.rows
    as_given = fit_of(found.table.measured_nm[rows], given.table.target_nm[rows])
    zeros = own_zeros(found)
    if zeros is not None:
        known = replace(known, one_zero=True, zeros_off=zeros.sure)
        if not zeros.sure:
            return asked_once(twin, runs, holdout, limits, known)
        again, moments = asked_once(twin, on_one_zero(zeros, runs), holdout, limits, known)
        return beside_zeros(again, zeros, holdout, as_given), moments
    carried = None if known.carried else carried_by_some(found)
    if carried is not None and carried.is_sure(twin):
        carried = _all_of_it(carried, twin, runs, holdout, known)
        lighter, unseen, held_out = freed(carried, runs, holdout, found)
        again, moments = asked_once(twin, lighter, unseen, limits, replace(known, carried=True))
        if carried.is_most_of_it(again):
            return beside_carried(again, carried, held_out, as_given, twin), moments
    if carried is not None:
        return asked_once(twin, runs, holdout, limits, replace(known, one_load=True))
    found, given = without_their_images(twin, found, given)
    found, given = without_unknown_beginnings(twin, found, given)
    if known.zeros_off:
        asked = replace(asked, holdout=on_zeros_of_their_own(asked.holdout, found))
    if known.doubted is not None:
        given = replace(given, twin=known.doubted.twin, refitted=known.doubted.refitted)
    names = (tuple(run.name for run in each) for each in (runs, holdout))
    return _explained(found, given, asked, limits, *names)


def _all_of_it(
    carried: Carried, twin: Twin, runs: Sequence[Run], holdout: Sequence[Run], known: Known
) -> Carried:
    """Return what some recordings carry, with what of it shows when it is taken off."""
    try:
        lighter = carried.taken_off_all(runs)
        table = tabulated(
            twin, lighter, holdout, known.late_s, known.band_hz, align_velocity=known.aligned
        )[1]
    except ValueError:
        return carried
    table = replace(without_creep(table, known.creep_rad_s), one_zero=known.one_zero)
    more = carried_by_some(studied(twin, table)[0])
    return carried.joined_by(more, len(runs)) or carried


def _explained(
    found: Study,
    given: Given,
    asked: Asked,
    limits: AxisLimits | None,
    recordings: tuple[str, ...],
    held_out: tuple[str, ...],
) -> tuple[Explanation, Moments | None]:
    """Return the explanation of recordings that carry an answer, and moments that may hide one."""
    told = Told.of(found, given)
    if told.verdict == "unexplained":
        told = told.without_names(given)
    is_named, holdout = told.verdict != "unexplained", asked.holdout
    useless: tuple[str, ...] = ()
    try:
        proven, traces, apart = _proof(told.found, given, holdout, named=is_named)
    except (TooShortError, TwinError) as error:
        # Too little of it moves, or it lacks a column that a law needs: what was learnt stands.
        holdout = ()
        proven, traces, apart = _proof(told.found, given, holdout, named=is_named)
        if isinstance(error, DrivingFrictionError):
            proven = replace(proven, denied=_DRIVES)
        else:
            useless = (f"the hold-out says nothing: {error}; {_STAND_IN}",)
    back = taken_back(told.verdict, told.findings, proven)
    if back:
        told = told.taken_back(given)
        proven, traces, apart = _proof(told.found, given, holdout, named=False)
    menu: tuple[NextExperiment, ...] = ()
    study, unit_off, gear_off = told.found, "", ""
    if not study.table.simulated:
        gear_off = behind_another_gear(study)
        unit_off = another_joint(study.numbers, study.twin) or gear_off
    if unit_off:  # which is made sure of before anything is driven
        told = told.beside_a_rival() if gear_off else told
    elif is_tied(told.findings):
        swings = frozenset(swing.effect for swing in told.swings)
        menu = experiments(found, told.findings, limits, swings)
    beyond = further(told.found, asked.runs, asked.holdout)
    answer = written_down(
        told,
        given,
        proven,
        traces,
        menu,
        recordings,
        held_out,
        by_motor=asked.by_motor,
        goes_further=bool(beyond),
        unit_off=unit_off,
    )
    carried = (*said_of(asked.runs, given.twin, given.loads), *beyond)
    moment = None
    if answer.verdict in ("unexplained", "partly-explained"):
        study = told.found
        rows, left = study.library.weighing.rows, study.model.residual_nm
        moment = in_moments(study.table, rows, left, study.floor.value_nm)
        located = "" if moment is None else moment.said(apart=False)
        moment = moment or in_beginnings(study.table)
        carried = tuple(said for said in (located, *carried, differs_unsaid(study.table)) if said)
    reasons = (
        *back,
        *told.swings_said(),
        *useless,
        *apart,
        *carried,
        *asked.apart,
        *answer.reasons,
        *asked.bettered,
    )
    answer = replace(answer, reasons=reasons)
    return (told.all_the_simulations(answer) if not back else answer), moment


def _proof(
    found: Study, given: Given, holdout: Sequence[Run], *, named: bool
) -> tuple[Holdout, tuple[Trace, ...], tuple[str, ...]]:
    """Return what the findings are worth on unseen data, and every recording before and after.

    And that what was held out is of another kind, or creeps, where it does.
    """
    table = found.table
    refitted = given.refitted or proof.refitted_twin(table, found.twin)
    as_given = replace(found, twin=given.twin)
    traces = traces_of(as_given, refitted, table, held_out=False)
    apart = ""
    beside: tuple[str, ...] = ()
    if holdout:
        left = left_by(found.extended, table)
        like = replace(table, torque_late_s=found.torque_late_s)
        compared, unseen = proof.compare_runs(
            given.twin, refitted, found.extended, holdout, like, creep_beside(table, left)
        )
        source = UNSEEN
        traces = (*traces, *traces_of(as_given, refitted, unseen, held_out=True))
        learnt = left[found.library.weighing.rows][found.apart_from_edges]
        learnt_nm = float(np.sqrt(np.nanmean(learnt**2)))
        apart = held_out_apart(compared, learnt_nm, found.floor.value_nm, table.runs, holdout)
        beside = left_out_of_the_proof(unseen, table)
    else:
        library = found.library if named else replace(found.library, candidates=())
        told = found.choice.candidates if named else ()
        compared, source, beside = proof.compare_folds(library, told)
    rows_per_cutoff = 1.0 / (table.cutoff_hz * table.pieces[0].period_s * table.pieces[0].stride)
    placebo = proof.placebo(found.library)
    proven = proof.prove(compared, source, found.floor.value_nm, placebo, rows_per_cutoff)
    return proven, traces, tuple(said for said in (apart, *beside) if said)
