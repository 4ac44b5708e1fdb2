"""An explanation written down: what was found, what it is worth, and what to run next."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer import words
from agent.explain.answer.names import OWN_NUMBER
from agent.explain.answer.result import (
    Curve,
    Explanation,
    Finding,
    Fit,
    Floor,
    Holdout,
    Moved,
    NextExperiment,
    Trace,
    fit_of,
)
from agent.explain.at_edges import edges_of
from agent.explain.carrying import Given
from agent.explain.caveats import bear_in_mind
from agent.explain.choosing.aliases import aliases
from agent.explain.choosing.materiality import MATERIAL
from agent.explain.driven_range import noted_in
from agent.explain.experiment.proposal import next_experiments, set_up_only
from agent.explain.location.dynamic_curves import spectrum_around
from agent.explain.look_alikes import OFFSET_OR_ASYMMETRY
from agent.explain.numbers.model import fit_model, left_by
from agent.explain.rows.table import BASE
from agent.explain.study import Study
from agent.explain.told import Told
from agent.explain.unnamed import unproven
from agent.identify.result import Floats
from trajectories import AxisLimits

_MOST_LOST = 0.1  # of a mismatch, by what a twin's own laws make of what was found


def nothing_decided(
    reason: str, recordings: tuple[str, ...], held_out: tuple[str, ...]
) -> Explanation:
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


def written_down(
    told: Told,
    as_given: Given,
    proven: Holdout,
    traces: tuple[Trace, ...],
    menu: tuple[NextExperiment, ...],
    recordings: tuple[str, ...],
    held_out: tuple[str, ...],
    *,
    by_motor: bool,
    goes_further: bool,
    unit_off: str,
) -> Explanation:
    """Return an explanation with all that was found in it."""
    found, verdict, findings = told.found, told.verdict, told.findings
    table, rows = found.table, found.library.weighing.rows
    measured = table.measured_nm[rows]
    share, left = told.left_share(), told.left_where()
    floors = found.left.over_floor if found.left.noise_all_the_same else 1.0
    claimed = math.fsum(f.energy_share for f in findings if f.form != OWN_NUMBER)
    not_proven = bool(proven.denied) or unproven(proven, floors, claimed)
    extended = _left_by_twin(found)
    known = np.isfinite(extended) & found.apart_from_edges
    lost = _lost_in_writing(found, extended, known)
    if verdict in ("explained", "tied") and (not_proven or lost > _MOST_LOST):
        verdict = "partly-explained"
    given, refitted = (
        fit_of(measured, left[rows]) for left in (as_given.table.target_nm, found.refitted_nm)
    )
    share = min(share + lost, 1.0)
    edges = edges_of(found)
    said = Explanation(
        verdict=verdict,
        sentence="",
        reasons=bear_in_mind(found, edges, by_motor=by_motor),
        floor=found.floor,
        baseline=given,
        refitted=refitted,
        extended=fit_of(measured[known], extended[known]),
        holdout=proven,
        findings=findings,
        unexplained_share=share,
        unexplained_where=left.regions,
        unexplained_varies=left.varies,
        unexplained_spells=left.spells,
        unexplained_brief=found.left.is_brief,
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
        unit_off=unit_off,
        goes_further=goes_further,
        edges=edges,
    )
    return replace(said, sentence=words.summary_of(said))


def _left_by_twin(found: Study) -> Floats:
    """Return what the twin that is written leaves of the rows learnt from, shape (m,)."""
    rows = found.library.weighing.rows
    return left_by(found.extended, found.table)[rows]


def _lost_in_writing(found: Study, extended: Floats, known: NDArray[np.bool_]) -> float:
    """Return which share of the mismatch the written twin leaves beyond the model, 0 to 1.

    Laws that stand in each other's friction add up to another torque than their columns do.

    Parameters
    ----------
    found : Study
    extended : ndarray, shape (m,)
        What the twin leaves of the rows learnt from.
    known : ndarray of bool, shape (m,)
        Which of them are compared.
    """
    if not known.any() or not all(found.in_twin(t.scored.form) for t in found.choice.terms):
        return 0.0
    rows = found.library.weighing.rows
    by_twin, by_model, before = (
        float(np.mean(left[known] ** 2))
        for left in (extended, found.model.residual_nm, found.refitted_nm[rows])
    )
    lost, above = by_twin - by_model, before - found.left.noise_nm**2
    return lost / above if lost > MATERIAL * before and above > 0.0 else 0.0


def experiments(
    found: Study,
    findings: Sequence[Finding],
    limits: AxisLimits | None,
    without: frozenset[str],
) -> tuple[NextExperiment, ...]:
    """Return what to run to break the ties, for the term that has the closest rival first.

    Offset and asymmetry come last: no motion of the axis tells those two apart. Effects that are
    not told are not asked about. Of a number of the twin's own that is tied, what to measure
    instead is all there is to say.
    """
    terms = found.choice.terms

    def order(index: int) -> tuple[bool, float]:
        term = terms[index]
        effects = {s.form.effect for s in (term.scored, *(r.scored for r in term.rivals))}
        return effects <= OFFSET_OR_ASYMMETRY, term.probability

    asked = (i for i, t in enumerate(terms) if t.rivals and t.scored.form.effect not in without)
    for index in sorted(asked, key=order):
        menu = next_experiments(
            found.library, found.choice.terms, index, found.left.noise_nm, limits
        )
        if menu:
            return menu
    numbers = (f for f in findings if f.form == OWN_NUMBER and f.alternatives)
    return tuple(set_up_only(f.effect, [a.effect for a in f.alternatives]) for f in numbers)[:1]


def _spectra(found: Study) -> tuple[Curve, ...]:
    """Return the spectra of the lines that are located."""
    curves = (spectrum_around(line) for line in found.lines if line.matters)
    return tuple(curve for curve in curves if curve is not None)


def _moves(found: Study) -> tuple[Moved, ...]:
    """Return how the twin's numbers moved when the missing physics was put in."""
    alone = fit_model(found.library, found.twin, ())
    moves = ((name, alone.base[name], found.model.base[name]) for name in BASE)
    return tuple(
        Moved.between(name, float(getattr(found.twin, name)), before, after)
        for name, before, after in moves
    )
