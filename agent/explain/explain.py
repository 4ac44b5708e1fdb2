"""The whole explanation: from recordings and a twin to a verdict, its reasons and its proof."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain import proof, words
from agent.explain.choice import Choice, Term, choose
from agent.explain.deficiency import deficiency_map
from agent.explain.evidence import effective_size, weigh
from agent.explain.floor import noise_floor
from agent.explain.library import judgeable
from agent.explain.model import Model, extended_twin, fit_model, predicted
from agent.explain.numbers import WrongNumber, wrong_numbers
from agent.explain.regions import curve_of, regions_of
from agent.explain.result import (
    Alternative,
    Cell,
    Explanation,
    Finding,
    Fit,
    Floor,
    Holdout,
    Moved,
    Region,
    Trace,
    Verdict,
    fit_of,
)
from agent.explain.run import Run
from agent.explain.scene import Scene, refit
from agent.explain.search import Library
from agent.explain.table import BASE, Table, tabulate
from agent.identify.result import Floats, Parameter
from agent.numbers import parameter_label
from agent.physics.effects.library import card_of
from agent.physics.twin import Twin

_CLOSE = 1.10  # of the floor: what is left beyond is not noise
_MOST_LEFT = 0.30  # of the mismatch: with more left over, what was named explains too little
_CELL_BETTER = 1.20
_LEAST_ROWS = 300
_SLOWEST_HZ = 10.0
_TRACE_POINTS = 1500
_PAIR = frozenset({"torque-offset", "direction-asymmetry"})


@dataclass(frozen=True)
class _Study:
    """Everything that the verdict is drawn from."""

    twin: Twin
    table: Table
    library: Library
    choice: Choice
    model: Model
    extended: Twin
    numbers: tuple[WrongNumber, ...]
    floor: Floor
    cells: tuple[Cell, ...]
    left_cells: tuple[Cell, ...]
    refitted_nm: Floats


def explain(twin: Twin, runs: Sequence[Run], holdout: Sequence[Run] = ()) -> Explanation:
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

    Returns
    -------
    Explanation
        With reasons and no numbers where the recordings do not carry an answer.
    """
    names = tuple(run.name for run in runs), tuple(run.name for run in holdout)
    refusal = _undecidable(runs)
    table: Table | None = None
    if not refusal:
        try:
            table = tabulate(twin, runs)
        except ValueError as error:
            refusal = f"not decidable: {error}"
        else:
            refusal = _too_little(table)
    if refusal or table is None:
        return _nothing(refusal, *names)
    study = _study(twin, table)
    compared, source = None, ""
    if holdout:
        try:
            refitted = proof.refitted_twin(table, twin)
            compared, unseen = proof.compare_runs(twin, refitted, study.extended, holdout, table)
        except ValueError as error:
            return _nothing(f"the hold-out cannot be compared: {error}", *names)
        source = "recordings that it had not seen"
        traces = (*_traces(study, table, held_out=False), *_traces(study, unseen, held_out=True))
    else:
        compared, source = proof.compare_folds(study.library)
        traces = _traces(study, table, held_out=False)
    rows_per_cutoff = 1.0 / (table.cutoff_hz * table.pieces[0].period_s * table.pieces[0].stride)
    proven = proof.prove(
        compared, source, study.floor.value_nm, proof.placebo(study.library), rows_per_cutoff
    )
    return _explanation(study, proven, traces, *names)


def _undecidable(runs: Sequence[Run]) -> str:
    """Return why runs cannot be compared at all, or nothing."""
    if not runs:
        return "not decidable: no recording was given"
    for run in runs:
        steps = np.diff(run.signals.time_s[run.signals.valid])
        if steps.size and 1.0 / float(np.median(steps)) < _SLOWEST_HZ:
            rate = 1.0 / float(np.median(steps))
            return (
                f"not decidable: {run.name} has {rate:.3g} samples a second; friction around "
                f"speed changes needs at least {_SLOWEST_HZ:g}, better 250"
            )
    return ""


def _too_little(table: Table) -> str:
    """Return why a table does not carry an explanation, or nothing."""
    count = int(np.count_nonzero(table.sliding))
    if count < _LEAST_ROWS:
        return (
            "not decidable: the joint hardly slides in these recordings; record a stair of speeds "
            "in both directions"
        )
    return ""


def _nothing(reason: str, recordings: tuple[str, ...], held_out: tuple[str, ...]) -> Explanation:
    """Return an explanation without numbers."""
    nan = math.nan
    return Explanation(
        verdict="unexplained",
        sentence=f"{reason[0].upper()}{reason[1:]}.",
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


def _study(twin: Twin, table: Table) -> _Study:
    """Locate, name and model."""
    delta, refitted = refit(table)
    theta = np.array([getattr(twin, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, refitted, 0.0))
    weighing = weigh(table, refitted)
    forms, _ = judgeable(table)
    library = Library.of(scene, weighing, forms)
    cells = deficiency_map(library)
    choice = choose(library)
    model = fit_model(library, twin, choice.terms)
    extended = extended_twin(library, twin, model)
    left = np.zeros(table.used.shape[0])
    left[weighing.rows] = model.residual_nm
    floor = noise_floor(table, left)
    numbers = wrong_numbers(library, twin, model, choice.candidates, floor.value_nm)
    left_cells = deficiency_map(library, choice.candidates) if choice.terms else cells
    return _Study(
        twin, table, library, choice, model, extended, numbers, floor, cells, left_cells, refitted
    )


def _explanation(
    study: _Study,
    proven: Holdout,
    traces: tuple[Trace, ...],
    recordings: tuple[str, ...],
    held_out: tuple[str, ...],
) -> Explanation:
    """Draw the verdict and write it down."""
    table, rows = study.table, study.library.weighing.rows
    measured = table.measured_nm[rows]
    left = study.model.residual_nm
    findings = _findings(study)
    share, where = _left_over(study)
    verdict = _verdict(study, findings, share)
    if verdict == "unexplained":
        findings = tuple(f for f in findings if f.effect in _own_numbers())
    _, not_judged = judgeable(table)
    sentence = words.summary(verdict, findings, proven, study.floor.value_nm, where, share)
    return Explanation(
        verdict=verdict,
        sentence=sentence,
        reasons=(),
        floor=study.floor,
        baseline=fit_of(measured, table.target_nm[rows]),
        refitted=fit_of(measured, study.refitted_nm[rows]),
        extended=fit_of(measured, left),
        holdout=proven,
        findings=findings,
        unexplained_share=share,
        unexplained_where=where,
        cells=study.cells,
        moved=_moves(study),
        next_experiment=None,
        recordings=recordings,
        held_out=held_out,
        not_judged=not_judged,
        twin=study.extended,
        traces=traces,
    )


def _own_numbers() -> frozenset[str]:
    return frozenset(
        {"inertia-error", "wrong-number", "gravity-imbalance", "torque-constant-error"}
    )


def _verdict(study: _Study, findings: tuple[Finding, ...], left_share: float) -> Verdict:
    """Return the verdict of contract section 6."""
    ratio = _ratio(study)
    counts = [cell for cell in study.left_cells if cell.counts]
    missing = bool(counts) and ratio > _CLOSE
    if not study.choice.terms:
        if missing:
            return "partly-explained" if findings else "unexplained"
        return "explained" if findings else "no-mismatch"
    plain, full = float(study.choice.plain.sum()), float(study.choice.full.sum())
    best_cell = max((cell.gain for cell in study.cells if cell.counts), default=0.0)
    outdone = best_cell * plain > _CELL_BETTER * (plain - full) and ratio > _CLOSE
    if missing and (left_share > _MOST_LEFT or outdone):
        return "unexplained"
    if missing and left_share > 0.5 * _MOST_LEFT:
        return "partly-explained"
    return "tied" if any(f.alternatives for f in findings) else "explained"


def _ratio(study: _Study) -> float:
    """Return the root mean square of what is left over the noise floor."""
    if not study.floor.value_nm > 0.0:
        return 1.0
    return float(np.sqrt(np.mean(study.model.residual_nm**2))) / study.floor.value_nm


def _left_over(study: _Study) -> tuple[float, tuple[Region, ...]]:
    """Return which share of the mismatch stays beyond the floor, and where it is located."""
    rows = study.library.weighing.rows
    noise = study.floor.value_nm**2 if study.floor.value_nm > 0.0 else 0.0
    before = float(np.mean(study.refitted_nm[rows] ** 2)) - noise
    after = max(float(np.mean(study.model.residual_nm**2)) - noise, 0.0)
    if before <= 0.0:
        return 0.0, ()
    share = min(after / before, 1.0)
    counted = [cell for cell in study.left_cells if cell.counts][:3]
    where = []
    for cell in counted:
        region = _whole_axis(study, cell.axis)
        if region is not None:
            where.append(region)
    return share, tuple(where)


def _whole_axis(study: _Study, axis: str) -> Region | None:
    """Return the span of a cell's axis as a region of contract section 6."""
    rows = study.library.weighing.rows
    scene = study.library.scene
    if axis.startswith("order_per_motor_rev"):
        order = float(axis.split()[1])
        return Region("order_per_motor_rev", 0.98 * order, 1.02 * order)
    if axis == "direction":
        return Region("velocity_rad_s", *_ends(scene.table.rows["velocity_rad_s"][rows]))
    if axis == "after_reversal_rad":
        speed = np.maximum(np.abs(scene.table.rows["velocity_rad_s"][rows]), 1e-9)
        return Region(
            "after_reversal_s", *_ends(2.0 * scene.table.rows["travel_rad"][rows] / speed)
        )
    if axis == "arm_position_rad":
        return Region(axis, *_ends(scene.arm_rows()[rows]))
    if axis == "recording":
        return Region(axis, 0.0, float(len(scene.table.runs) - 1))
    if axis == "load_torque_nm":
        return Region(axis, *_ends(scene.load_rows()[rows]))
    values = scene.table.rows.get("time_s" if axis == "elapsed_s" else axis)
    return None if values is None else Region(axis, *_ends(values[rows]))


def _ends(values: Floats) -> tuple[float, float]:
    low, high = np.quantile(values, [0.01, 0.99])
    return float(low), float(high)


def _findings(study: _Study) -> tuple[Finding, ...]:
    """Return what was found, physics and wrong numbers, the greatest share first."""
    found = [_finding(study, index, term) for index, term in enumerate(study.choice.terms)]
    found += [_number_finding(study, wrong) for wrong in study.numbers]
    found.sort(key=lambda f: -f.energy_share)
    return tuple(
        Finding(**{**{k: getattr(f, k) for k in f.__dataclass_fields__}, "rank": rank})
        for rank, f in enumerate(found, start=1)
    )


def _finding(study: _Study, index: int, term: Term) -> Finding:
    """Return one effect of the model as a finding."""
    library, choice = study.library, study.choice
    weighing, scene = library.weighing, library.scene
    place = study.model.slices()[index]
    coefficients = study.model.coefficients[place]
    added = term.candidate.columns @ coefficients / weighing.weight
    others = [t.candidate for i, t in enumerate(choice.terms) if i != index]
    without = library.errors(others)
    noise = study.floor.value_nm**2 * float(np.sum(weighing.weight**2))
    above = max(float(choice.plain.sum()) - noise, float(choice.plain.sum() - choice.full.sum()))
    share = float(without.sum() - choice.full.sum()) / above if above > 0.0 else 0.0
    order = _order(scene, study.model.parameters[index])
    independent = effective_size(
        scene.table, weighing, study.model.residual_nm * weighing.weight
    ) / len(weighing.rows)
    curve = curve_of(
        scene,
        weighing.rows,
        term.scored.form.effect,
        added,
        study.model.residual_nm,
        independent=independent,
        order=order,
    )
    where: tuple[Region, ...] = ()
    if curve is not None:
        where = regions_of(scene, weighing.rows, curve, study.floor.value_nm, order)
    largest = float(np.quantile(np.abs(added), 0.995))
    effect = term.scored.form.effect
    scale = float(np.sqrt(np.mean(1.0 / weighing.weight**2)))
    return Finding(
        effect=effect,
        rank=0,
        probability=term.probability,
        energy_share=min(max(share, 0.0), 1.0),
        where=where,
        sentence=words.finding_sentence(effect, where, largest, share),
        parameters=study.model.parameters[index],
        alternatives=_alternatives(term),
        holdout_rmse_without_nm=float(np.sqrt(without.sum() / len(weighing.rows))) * scale,
        form=term.scored.form.name,
        curve=curve,
    )


def _order(scene: Scene, parameters: Mapping[str, Parameter]) -> float:
    """Return a finding's order per motor turn, 0 for none."""
    if "order_per_motor_rev" in parameters:
        return parameters["order_per_motor_rev"].value
    if "order_per_arm_rev" in parameters:
        return parameters["order_per_arm_rev"].value / scene.table.gear_ratio
    return 0.0


def _alternatives(term: Term) -> tuple[Alternative, ...]:
    """Return a term's rivals, each with the measurement that decides."""
    effect = term.scored.form.effect
    out = []
    for rival in term.rivals[:3]:
        other = rival.scored.form.effect
        out.append(Alternative(other, rival.probability, told_apart_by(effect, other)))
    if effect in _PAIR and not any(a.effect in _PAIR for a in out):
        partner = next(iter(_PAIR - {effect}))
        if term.scored.form.name in ("constant", "Coulomb"):
            out.insert(0, Alternative(partner, 0.5, told_apart_by(effect, partner)))
    return tuple(out)


def told_apart_by(effect: str, other: str) -> str:
    """Return the measurement that tells two effects apart, in one sentence."""
    for alike in card_of(effect).look_alikes:
        if alike.effect == other:
            return alike.told_apart_by
    first, second = card_of(effect).axes[0], card_of(other).axes[0]
    return (
        f"Record a cycle in which {first} and {second} vary independently of each other."
        if first != second
        else "Repeat the cycle with more speeds, and over a longer stroke."
    )


def _number_finding(study: _Study, wrong: WrongNumber) -> Finding:
    """Return a wrong number of the twin as a finding."""
    changes = {}
    for name, given in _given_of(study.twin, wrong.effect).items():
        found = (
            study.model.base[name].value
            if name in study.model.base
            else wrong.parameters["factor"].value
        )
        changes[parameter_label(name).lower()] = (given, found)
    return Finding(
        effect=wrong.effect,
        rank=0,
        probability=1.0,
        energy_share=wrong.energy_share,
        where=(),
        sentence=words.number_sentence(wrong.effect, changes, wrong.energy_share),
        parameters=wrong.parameters,
        holdout_rmse_without_nm=float(
            np.sqrt(np.mean(study.table.target_nm[study.library.weighing.rows] ** 2))
        ),
        form="the twin's own number",
    )


def _given_of(twin: Twin, effect: str) -> dict[str, float]:
    names = {
        "inertia-error": ("inertia_kg_m2",),
        "wrong-number": ("coulomb_nm", "viscous_nm_s_per_rad"),
        "gravity-imbalance": ("gravity_sin_nm", "gravity_cos_nm"),
    }.get(effect, ())
    if effect == "torque-constant-error":
        return {"factor": 1.0}
    return {name: float(getattr(twin, name)) for name in names}


def _moves(study: _Study) -> tuple[Moved, ...]:
    """Return how the twin's numbers moved when the missing physics was put in."""
    alone = fit_model(study.library, study.twin, ())
    out = []
    for name in BASE:
        before, after = alone.base[name], study.model.base[name]
        sigmas = math.nan
        if after.ci95 is not None and before.ci95 is not None:
            spread = (after.ci95[1] - after.ci95[0]) / 3.92
            sigmas = abs(after.value - before.value) / spread if spread > 0.0 else math.nan
        out.append(Moved(name, float(getattr(study.twin, name)), before, after, sigmas))
    return tuple(out)


def _traces(study: _Study, table: Table, *, held_out: bool) -> tuple[Trace, ...]:
    """Return every run of a table before and after, thinned for a picture."""
    refitted = proof.refitted_twin(study.table, study.twin)
    offset = np.zeros(table.measured_nm.shape[0])
    if table.simulated:
        offset = table.given_nm - predicted(table, study.twin)
    left = [
        np.where(table.sliding, table.measured_nm - offset - predicted(table, t), np.nan)
        for t in (study.twin, refitted, study.extended)
    ]
    out = []
    for index, run in enumerate(table.runs):
        at = np.flatnonzero(table.run == index)
        at = at[:: max(1, at.shape[0] // _TRACE_POINTS)]
        out.append(
            Trace(
                run.name,
                held_out,
                table.rows["time_s"][at],
                table.rows["velocity_rad_s"][at],
                table.measured_nm[at],
                left[0][at],
                left[1][at],
                left[2][at],
            )
        )
    return tuple(out)
