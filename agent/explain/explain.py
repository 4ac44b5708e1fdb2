"""The whole explanation: from recordings and a twin to a verdict, its reasons and its proof."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from agent.explain import proof
from agent.explain.answer import words
from agent.explain.answer.result import (
    Curve,
    Explanation,
    Finding,
    Fit,
    Floor,
    Holdout,
    Moved,
    NextExperiment,
    Region,
    Trace,
    Verdict,
    fit_of,
)
from agent.explain.answer.sentences import only_heard
from agent.explain.carrying import Given, studied, with_load
from agent.explain.choosing.aliases import aliases
from agent.explain.choosing.by_use import clock_or_use
from agent.explain.choosing.heard import BACKLASH
from agent.explain.choosing.materiality import CLOSE
from agent.explain.driven_range import further, hangs_free, noted_in
from agent.explain.experiment.proposal import next_experiments
from agent.explain.findings import OFFSET_OR_ASYMMETRY, findings_of
from agent.explain.location.dynamic_curves import spectrum_around
from agent.explain.location.leftover import left_regions, line_regions
from agent.explain.numbers.loads import differs_unsaid, said_of, without_unknown_loads
from agent.explain.numbers.model import fit_model
from agent.explain.plausible import contradiction, far_off, turned_gravity
from agent.explain.rows.creep import without_creep
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.run import Run, stood_in, without_gearbox_temperature
from agent.explain.rows.stamps import put_right
from agent.explain.rows.table import BASE, Table, tabulate
from agent.explain.study import Study
from agent.explain.traces import traces_of
from agent.explain.undecidable import undecidable
from agent.explain.unnamed import own_numbers, taken_back, unnamed, unproven
from agent.explain.verdict import far_from_given, left_share, verdict_of
from agent.identify.signals.preprocess import left_out_of
from agent.physics.twin import Twin
from trajectories import AxisLimits

_CLOSER = 1.1  # of the refitted energy, at least: else refitting has brought nothing
_LATE_S = 5e-4  # of a velocity: less is no more than its last difference


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
    names = tuple(run.name for run in runs), tuple(run.name for run in holdout)
    refusal = "" if runs else "not decidable: no recording was given"
    against = contradiction((*runs, *holdout))
    if against and not refusal:
        refusal = f"not decidable: {against}"
    everything, stamped = put_right((*runs, *holdout))
    runs, holdout = everything[: len(runs)], everything[len(runs) :]
    by_motor = without_gearbox_temperature((*runs, *holdout))
    if by_motor:
        runs, holdout = stood_in(runs), stood_in(holdout)
    table: Table | None = None
    holdout, apart = without_unknown_loads(twin, runs, holdout)
    if not refusal:
        try:
            table = without_creep(tabulate(twin, runs))
        except ValueError as error:
            refusal = f"not decidable: {error}"
        else:
            refusal = undecidable(table, twin)
    if refusal or table is None:
        return _nothing(refusal, *names)
    found, given = studied(twin, table)
    named = findings_of(found)
    findings = with_load(named, found, given)
    verdict = verdict_of(found, findings, left_share(found))
    menu = _experiments(found, limits)
    if verdict == "unexplained":
        found = unnamed(found)
        named = _own(named, found)
        findings = with_load(named, found, given)
    try:
        proven, traces = _proof(found, given, holdout, named=verdict != "unexplained")
    except ValueError as error:
        return _nothing(f"the hold-out cannot be compared: {error}", *names)
    back = taken_back(verdict, findings, proven)
    if back:
        found = unnamed(found)
        named = _own(named, found)
        findings = with_load(named, found, given)
        verdict = verdict_of(found, findings, left_share(found))
        proven, traces = _proof(found, given, holdout, named=False)
    answer = _explanation(
        found, given, verdict, findings, proven, traces, menu, *names, by_motor=by_motor
    )
    carried = (*said_of(runs, twin, given.loads), *further(found, runs, holdout))
    if answer.verdict in ("unexplained", "partly-explained"):
        carried = tuple(said for said in (*carried, differs_unsaid(found.table)) if said)
    return replace(answer, reasons=(*back, *carried, *apart, *answer.reasons, *stamped))


def _own(findings: Sequence[Finding], found: Study) -> tuple[Finding, ...]:
    """Return what of the twin's own numbers is told where nothing beside them is named."""
    return tuple(f for f in findings if f.effect in own_numbers(found))


def _proof(
    found: Study, given: Given, holdout: Sequence[Run], *, named: bool
) -> tuple[Holdout, tuple[Trace, ...]]:
    """Return what the findings are worth on unseen data, and every recording before and after."""
    table = found.table
    refitted = proof.refitted_twin(table, found.twin)
    as_given = replace(found, twin=given.twin)
    traces = traces_of(as_given, refitted, table, held_out=False)
    if holdout:
        compared, unseen = proof.compare_runs(given.twin, refitted, found.extended, holdout, table)
        source = "recordings that it had not seen"
        traces = (*traces, *traces_of(as_given, refitted, unseen, held_out=True))
    else:
        library = found.library if named else replace(found.library, candidates=())
        compared, source = proof.compare_folds(library)
    rows_per_cutoff = 1.0 / (table.cutoff_hz * table.pieces[0].period_s * table.pieces[0].stride)
    placebo = proof.placebo(found.library)
    return proof.prove(compared, source, found.floor.value_nm, placebo, rows_per_cutoff), traces


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
    found: Study,
    as_given: Given,
    verdict: Verdict,
    findings: tuple[Finding, ...],
    proven: Holdout,
    traces: tuple[Trace, ...],
    menu: tuple[NextExperiment, ...],
    recordings: tuple[str, ...],
    held_out: tuple[str, ...],
    *,
    by_motor: bool,
) -> Explanation:
    """Write it down."""
    table, rows = found.table, found.library.weighing.rows
    measured = table.measured_nm[rows]
    share, where = left_share(found), _left_where(found)
    if verdict == "explained" and unproven(proven):
        verdict = "partly-explained"
    given, refitted = (
        fit_of(measured, left[rows]) for left in (as_given.table.target_nm, found.refitted_nm)
    )
    following = menu if any(f.alternatives for f in findings) else ()
    return Explanation(
        verdict=verdict,
        sentence=words.summary(
            verdict, findings, proven, found.floor.value_nm, refitted, where, share, given
        ),
        reasons=_bear_in_mind(found, by_motor=by_motor),
        floor=found.floor,
        baseline=given,
        refitted=refitted,
        extended=fit_of(measured, found.model.residual_nm),
        holdout=proven,
        findings=findings,
        unexplained_share=share,
        unexplained_where=where,
        cells=found.cells,
        moved=_moves(found),
        next_experiment=following[0] if following else None,
        further_experiments=following[1:],
        recordings=recordings,
        held_out=held_out,
        not_judged=found.not_judged,
        aliases=aliases(found.library),
        twin=noted_in(found),
        traces=traces,
        unexplained_curves=_spectra(found),
        band_hz=table.cutoff_hz,
    )


def _experiments(found: Study, limits: AxisLimits | None) -> tuple[NextExperiment, ...]:
    """Return what to run to break the ties, for the term that has the closest rival first.

    Offset and asymmetry come last: no motion of the axis tells those two apart.
    """
    terms = found.choice.terms

    def order(index: int) -> tuple[bool, float]:
        term = terms[index]
        effects = {s.form.effect for s in (term.scored, *(r.scored for r in term.rivals))}
        return effects <= OFFSET_OR_ASYMMETRY, term.probability

    for index in sorted((i for i, term in enumerate(terms) if term.rivals), key=order):
        menu = next_experiments(found.library, found.choice.terms, index, found.noise_nm, limits)
        if menu:
            return menu
    return ()


def _bear_in_mind(found: Study, *, by_motor: bool) -> tuple[str, ...]:
    """Return what limits the answer as a whole."""
    far = "" if found.table.simulated else far_off(found.numbers, found.twin)
    turned = "" if found.table.simulated else turned_gravity(found.numbers, found.twin)
    out = [said for said in (far, turned) if said]
    if by_motor:
        out.append(
            "the gearbox temperature was not recorded: the motor's stands in for it, and friction "
            "and torque constant are judged by the same thermometer"
        )
    if not found.floor.value_nm > 0.0:
        out.append(
            "the noise floor could not be measured, as no speed was held long enough: what is left "
            "may be noise or not"
        )
    if found.table.simulated:
        out.append(
            "the simulation questioned is the recordings' own torque_simulated_nm; twin.toml holds "
            "what was found beside the numbers of the twin that was given; if it moved in a loop "
            "of its own instead of as recorded, delays and swings may be that loop's"
        )
    out += [said for said in (clock_or_use(found.library, found.choice), hangs_free(found)) if said]
    if not found.choice.terms and not found.numbers and _bent(found):
        out.append(
            "the simulation as given is clearly above the noise: its own numbers, refitted, come "
            "closer, and these recordings do not say which of them is wrong"
        )
    blows = found.library.scene.blows
    if blows is not None and BACKLASH not in _effects(found):
        out.append(only_heard(blows.ringing))
    if found.table.creep_rad_s > 0.0:
        out.append(
            f"below {found.table.creep_rad_s:.2g} rad/s friction is not fully there: the joint "
            "creeps before it slips, or what recorded or simulated it smooths friction's sign; "
            "those samples were left out"
        )
    if abs(found.table.late_s) > _LATE_S:
        later = "later" if found.table.late_s > 0.0 else "earlier"
        out.append(
            f"the velocity is reported {1e3 * abs(found.table.late_s):.1f} ms {later} than the "
            "position, with which the torque is in step: it was brought in step with both"
        )
    out += [said for run in found.table.runs for said in left_out_of(run.signals)]
    compared = {piece.run for piece in found.table.pieces}
    for index, run in enumerate(found.table.runs):
        if index not in compared:
            out.append(f"{run.name} was left out: no stretch of it is long enough to be compared")
    return tuple(out)


def _effects(found: Study) -> set[str]:
    """Return what the extended twin has, found or known before."""
    known = {effect.id for effect in found.twin.effects}
    return known | {term.scored.form.effect for term in found.choice.terms}


def _bent(found: Study) -> bool:
    """Return whether the simulation as given is far off, and its numbers refitted are closer."""
    rows = found.library.weighing.rows
    given, refitted = found.table.target_nm[rows], found.refitted_nm[rows]
    return far_from_given(found) and float(given @ given) > _CLOSER * float(refitted @ refitted)


def _left_where(found: Study) -> tuple[Region, ...]:
    """Return where what is left lies; nowhere where it is noise."""
    lines = line_regions(found.lines)
    if found.ratio <= CLOSE:
        return lines
    library = found.library
    rows, weight = library.weighing.rows, library.weighing.weight
    left = found.model.residual_nm
    size = effective_size(found.table, library.weighing, left * weight)
    axes = tuple(cell.axis for cell in found.left_cells if cell.counts)
    own = left_regions(library.scene, rows, left, found.noise_nm, size / rows.shape[0], axes)
    return (*lines, *own)


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
