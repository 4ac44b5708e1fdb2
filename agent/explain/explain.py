"""The whole explanation: from recordings and a twin to a verdict, its reasons and its proof."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.explain import proof
from agent.explain.answer import words
from agent.explain.answer.result import (
    Curve,
    Explanation,
    Fit,
    Floor,
    Holdout,
    Moved,
    NextExperiment,
    Trace,
    fit_of,
)
from agent.explain.asked import Asked, tabulated
from agent.explain.carried import beside_carried, carried_by_some, freed
from agent.explain.carrying import (
    Given,
    studied,
    without_their_images,
    without_unknown_beginnings,
)
from agent.explain.caveats import bear_in_mind, creeps_held_out
from agent.explain.choosing.aliases import aliases
from agent.explain.driven_range import further, noted_in
from agent.explain.experiment.proposal import next_experiments
from agent.explain.findings import OFFSET_OR_ASYMMETRY
from agent.explain.location.dynamic_curves import spectrum_around
from agent.explain.location.moments import Moments, in_moments, without
from agent.explain.numbers.loads import differs_unsaid, said_of
from agent.explain.numbers.model import fit_model
from agent.explain.plausible import contradiction
from agent.explain.rows.creep import creep_beside, without_creep
from agent.explain.rows.half_sample import half_a_sample_s
from agent.explain.rows.run import Run
from agent.explain.rows.table import BASE, TooShortError
from agent.explain.study import Study
from agent.explain.told import Told
from agent.explain.traces import traces_of
from agent.explain.undecidable import undecidable
from agent.explain.unlike import held_out_apart
from agent.explain.unnamed import taken_back, unproven
from agent.explain.zeros import beside_zeros, on_one_zero, on_zeros_of_their_own, own_zeros
from agent.identify.result import Floats
from agent.physics.twin import Twin, TwinError
from trajectories import AxisLimits

_HELD_OUT = 2.0  # times the noise
_SETTLED = {"unexplained": 0, "partly-explained": 1, "tied": 2, "explained": 2, "no-mismatch": 2}


def explain(
    twin: Twin,
    runs: Sequence[Run],
    holdout: Sequence[Run] = (),
    limits: AxisLimits | None = None,
) -> Explanation:
    """Locate where a twin and recordings differ, name and model what is missing, and prove it.

    Parameters
    ----------
    twin : Twin
        The simulation as given. Recordings that all carry a `torque_simulated_nm` question that
        simulation instead.
    runs : sequence of Run
        Recordings of one axis to learn from.
    holdout : sequence of Run
        Recordings that nothing is learnt from; without them folds of `runs` stand in.
    limits : AxisLimits, optional
        Of the axis: what it may be asked to drive next. Without them nothing beyond what the
        recordings show.

    Returns
    -------
    Explanation
        With reasons and no numbers where the recordings do not carry an answer.
    """
    answer, moments = _asked_once(twin, runs, holdout, limits)
    if moments is None or (not holdout and len({run for run, _, _ in moments.at}) > 1):
        return answer  # what comes back in another recording, and nothing to hold it against
    again, _ = _asked_once(twin, without(runs, moments), holdout, limits)
    if not _is_better(again, answer):
        return answer
    return replace(again, reasons=(moments.said(apart=True), *again.reasons))


def _is_better(answer: Explanation, other: Explanation) -> bool:
    """Return whether an answer without moments settles more than one with them, or leaves half.

    It does not where a hold-out holds far more of it than noise: then they were no accident.
    """
    held = answer.holdout
    if held is not None and answer.held_out and held.floor_ratio > _HELD_OUT:
        return False
    rank = _SETTLED[answer.verdict] - _SETTLED[other.verdict]
    return rank > 0 or (rank == 0 and answer.extended.rmse_nm < 0.5 * other.extended.rmse_nm)


@dataclass(frozen=True)
class _Known:
    """What was found before, and is not asked again.

    Parameters
    ----------
    late_s : float
        By what half a sample the torque is late.
    creep_rad_s : float or None
        The creep that was seen: a small mismatch beside a late torque may hide it.
    carried : bool
        Whether what some recordings carry is taken off already.
    one_zero : bool
        Whether all recordings have one zero, or none shows.
    zeros_off : bool
        Whether their own zeros are taken off already; a hold-out's is read when all else is known.
    """

    late_s: float = 0.0
    creep_rad_s: float | None = None
    carried: bool = False
    one_zero: bool = False
    zeros_off: bool = False


def _asked_once(
    twin: Twin,
    runs: Sequence[Run],
    holdout: Sequence[Run],
    limits: AxisLimits | None,
    known: _Known = _Known(),
) -> tuple[Explanation, Moments | None]:
    """Return an explanation, and the moments of the recordings that hold most of what is left.

    A torque that turns out to be half a sample late is put in step, and everything asked again. So
    it is where each recording has a zero of its own, or some carry what others do not.
    """
    names = tuple(run.name for run in runs), tuple(run.name for run in holdout)
    refusal = contradiction((*runs, *holdout)) if runs else "no recording was given"
    if refusal:
        return _nothing(f"not decidable: {refusal}", *names), None
    try:
        asked, table = tabulated(twin, runs, holdout, known.late_s)
        table = without_creep(table, known.creep_rad_s)
    except ValueError as error:
        return _nothing(f"not decidable: {error}", *names), None
    refusal = undecidable(table, twin)
    if refusal:
        return _nothing(refusal, *names), None
    found, given = studied(twin, replace(table, one_zero=known.one_zero))
    if not known.late_s:
        late_s = _late_by_holding_s(found, (*asked.runs, *asked.holdout))
        if late_s:
            known = replace(known, late_s=late_s, creep_rad_s=found.table.creep_rad_s or None)
            return _asked_once(twin, runs, holdout, limits, known)
    rows = found.library.weighing.rows
    as_given = fit_of(found.table.measured_nm[rows], given.table.target_nm[rows])
    zeros = own_zeros(found)
    if zeros is not None:
        known = replace(known, one_zero=True, zeros_off=zeros.sure)
        if not zeros.sure:
            return _asked_once(twin, runs, holdout, limits, known)
        again, moments = _asked_once(twin, on_one_zero(zeros, runs), holdout, limits, known)
        return beside_zeros(again, zeros, holdout, as_given), moments
    carried = None if known.carried else carried_by_some(found)
    if carried is not None:
        lighter, unseen, held_out = freed(carried, runs, holdout, found)
        known = replace(known, carried=True)
        again, moments = _asked_once(twin, lighter, unseen, limits, known)
        return beside_carried(again, carried, held_out, as_given), moments
    found, given = without_their_images(twin, found, given)
    found, given = without_unknown_beginnings(twin, found, given)
    if known.zeros_off:
        asked = replace(asked, holdout=on_zeros_of_their_own(asked.holdout, found))
    return _explained(found, given, asked, limits, *names)


def _late_by_holding_s(found: Study, runs: Sequence[Run]) -> float:
    """Return by what half a sample the torque was found to be late; 0 where it is not."""
    terms = zip(found.model.terms, found.model.parameters, strict=True)
    numbers = (own for term, own in terms if term.scored.form.effect == "measurement-delay")
    return sum(half_a_sample_s(own["torque_delay_s"], runs) for own in numbers)


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
        useless = (f"the hold-out says nothing: {error}; parts of the other recordings stand in",)
        proven, traces, apart = _proof(told.found, given, holdout, named=is_named)
    back = taken_back(told.verdict, told.findings, proven)
    if back:
        told = told.without_names(given).judged_again()
        proven, traces, apart = _proof(told.found, given, holdout, named=False)
    menu: tuple[NextExperiment, ...] = ()
    if any(f.alternatives for f in told.findings):
        menu = _experiments(found, limits, frozenset(swing.effect for swing in told.swings))
    answer = _explanation(
        told, given, proven, traces, menu, recordings, held_out, by_motor=asked.by_motor
    )
    carried = (
        *said_of(asked.runs, given.twin, given.loads),
        *further(told.found, asked.runs, asked.holdout),
    )
    moment = None
    if answer.verdict in ("unexplained", "partly-explained"):
        study = told.found
        rows, left = study.library.weighing.rows, study.model.residual_nm
        moment = in_moments(study.table, rows, left, study.floor.value_nm)
        located = "" if moment is None else moment.said(apart=False)
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
    return replace(answer, reasons=reasons), moment


def _proof(
    found: Study, given: Given, holdout: Sequence[Run], *, named: bool
) -> tuple[Holdout, tuple[Trace, ...], tuple[str, ...]]:
    """Return what the findings are worth on unseen data, and every recording before and after.

    And that what was held out is of another kind, or creeps, where it does.
    """
    table = found.table
    refitted = proof.refitted_twin(table, found.twin)
    as_given = replace(found, twin=given.twin)
    traces, apart, creeps = traces_of(as_given, refitted, table, held_out=False), "", ""
    if holdout:
        left = proof.left_by(found.extended, table, found.twin)
        like = replace(table, torque_late_s=found.torque_late_s)
        compared, unseen = proof.compare_runs(
            given.twin, refitted, found.extended, holdout, like, creep_beside(table, left)
        )
        source = "recordings that it had not seen"
        traces = (*traces, *traces_of(as_given, refitted, unseen, held_out=True))
        learnt = left[found.library.weighing.rows][found.apart_from_edges]
        learnt_nm = float(np.sqrt(np.nanmean(learnt**2)))
        apart = held_out_apart(compared, learnt_nm, found.floor.value_nm, table.runs, holdout)
        creeps = creeps_held_out(unseen, table)
    else:
        library = found.library if named else replace(found.library, candidates=())
        compared, source = proof.compare_folds(library)
    rows_per_cutoff = 1.0 / (table.cutoff_hz * table.pieces[0].period_s * table.pieces[0].stride)
    placebo = proof.placebo(found.library)
    proven = proof.prove(compared, source, found.floor.value_nm, placebo, rows_per_cutoff)
    return proven, traces, tuple(said for said in (apart, creeps) if said)


def _nothing(reason: str, recordings: tuple[str, ...], held_out: tuple[str, ...]) -> Explanation:
    """Return an explanation without numbers."""
    nan = math.nan
    return Explanation(
        verdict="unexplained",
        sentence=f"{reason[0].upper()}{reason[1:]}{'' if reason.endswith('?') else '.'}",
        reasons=(reason,),
        floor=Floor(nan, nan, nan, nan),
        baseline=Fit(),
        refitted=Fit(),
        extended=Fit(),
        holdout=None,
        findings=(),
        unexplained_share=nan,
        unexplained_where=(),
        cells=(),
        moved=(),
        next_experiment=None,
        recordings=recordings,
        held_out=held_out,
    )


def _explanation(
    told: Told,
    as_given: Given,
    proven: Holdout,
    traces: tuple[Trace, ...],
    menu: tuple[NextExperiment, ...],
    recordings: tuple[str, ...],
    held_out: tuple[str, ...],
    *,
    by_motor: bool,
) -> Explanation:
    """Write it down."""
    found, verdict, findings = told.found, told.verdict, told.findings
    table, rows = found.table, found.library.weighing.rows
    measured = table.measured_nm[rows]
    share, where = told.left_share(), told.left_where()
    floors = found.over_floor if found.noise_all_the_same else 1.0
    if verdict in ("explained", "tied") and unproven(proven, floors):
        verdict = "partly-explained"
    extended = _left_by_twin(found)
    known = np.isfinite(extended) & found.apart_from_edges
    given, refitted = (
        fit_of(measured, left[rows]) for left in (as_given.table.target_nm, found.refitted_nm)
    )
    said = Explanation(
        verdict=verdict,
        sentence="",
        reasons=bear_in_mind(found, by_motor=by_motor),
        floor=found.floor,
        baseline=given,
        refitted=refitted,
        extended=fit_of(measured[known], extended[known]),
        holdout=proven,
        findings=findings,
        unexplained_share=share,
        unexplained_where=where,
        cells=found.cells,
        moved=_moves(found),
        next_experiment=menu[0] if menu else None,
        further_experiments=menu[1:],
        recordings=recordings,
        held_out=held_out,
        not_judged=found.not_judged,
        aliases=aliases(found.library),
        twin=noted_in(found),
        traces=traces,
        unexplained_curves=_spectra(found),
        band_hz=table.cutoff_hz,
    )
    return replace(said, sentence=words.summary_of(said))


def _left_by_twin(found: Study) -> Floats:
    """Return what the twin that is written leaves of the rows learnt from, shape (m,)."""
    rows = found.library.weighing.rows
    return proof.left_by(found.extended, found.table, found.twin)[rows]


def _experiments(
    found: Study, limits: AxisLimits | None, without: frozenset[str]
) -> tuple[NextExperiment, ...]:
    """Return what to run to break the ties, for the term that has the closest rival first.

    Offset and asymmetry come last: no motion of the axis tells those two apart. Effects that are
    not told are not asked about.
    """
    terms = found.choice.terms

    def order(index: int) -> tuple[bool, float]:
        term = terms[index]
        effects = {s.form.effect for s in (term.scored, *(r.scored for r in term.rivals))}
        return effects <= OFFSET_OR_ASYMMETRY, term.probability

    asked = (i for i, t in enumerate(terms) if t.rivals and t.scored.form.effect not in without)
    for index in sorted(asked, key=order):
        menu = next_experiments(found.library, found.choice.terms, index, found.noise_nm, limits)
        if menu:
            return menu
    return ()


def _spectra(found: Study) -> tuple[Curve, ...]:
    """Return the spectra of the lines that are located."""
    curves = (spectrum_around(line) for line in found.lines if line.matters)
    return tuple(curve for curve in curves if curve is not None)


def _moves(found: Study) -> tuple[Moved, ...]:
    """Return how the twin's numbers moved when the missing physics was put in."""
    alone = fit_model(found.library, found.twin, ())
    out = []
    for name in BASE:
        before, after = alone.base[name], found.model.base[name]
        sigmas = math.nan
        if after.ci95 is not None and before.ci95 is not None:
            spread = (after.ci95[1] - after.ci95[0]) / 3.92
            sigmas = abs(after.value - before.value) / spread if spread > 0.0 else math.nan
        out.append(Moved(name, float(getattr(found.twin, name)), before, after, sigmas))
    return tuple(out)
