"""What was found, effect by effect: where, how much, its numbers, and what else it may be."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from agent.explain.answer import number_sentences, sentences
from agent.explain.answer.located import Curve
from agent.explain.answer.names import NAMES, NUMBERS, OWN_NUMBER
from agent.explain.answer.result import Alternative, Finding
from agent.explain.choosing.aliases import told_apart_by
from agent.explain.choosing.heard import heard
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.shares import shares_of, without_term
from agent.explain.driven_range import or_warmth
from agent.explain.forms.carried import RECORDINGS
from agent.explain.forms.drift import changed_between
from agent.explain.forms.form import Form
from agent.explain.forms.hidden_arm import inertia_of
from agent.explain.forms.quantities import as_in_twin
from agent.explain.forms.seen_arm import SEEN, shown_gear
from agent.explain.location.dynamic_curves import excerpt, over_frequency
from agent.explain.location.regions import curve_of, regions_of
from agent.explain.look_alikes import YIELDING, alternatives_of, is_what_friction_lacks
from agent.explain.numbers.cancelling import cancelled_by, without_one_constant
from agent.explain.numbers.late_velocity import as_velocitys, is_velocitys
from agent.explain.numbers.model import beside_others
from agent.explain.numbers.short_stroke import gravity_look_alikes
from agent.explain.numbers.unshaken import UNKNOWN
from agent.explain.numbers.wrong import WrongNumber, factor_of
from agent.explain.reach import reach_of
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.saturation import saturation_evidence
from agent.explain.rows.scene import Scene
from agent.explain.study import Study
from agent.identify.result import Floats, Parameter
from agent.numbers import parameter_unit
from agent.physics.rigid_body import GRAVITY
from agent.physics.twin import Twin, TwinError

_SWINGS = {"joint-flexibility": over_frequency, "backlash": excerpt}  # no mean along an axis
_SAME_LIMIT = 0.02  # of a torque limit, beyond the interval: how tops are read, and rounded
_NUMBERS: Mapping[str, tuple[str, ...]] = {
    "inertia-error": ("inertia_kg_m2",),
    "wrong-number": ("coulomb_nm", "viscous_nm_s_per_rad"),
    "gravity-imbalance": GRAVITY,
}
_PLACE = "position-dependent-friction"
_OF_THE_PLACE = 0.3  # of what friction is told to differ by at a place: so much its level moved


def findings_of(study: Study) -> tuple[Finding, ...]:
    """Return what was found, physics and wrong numbers, what accounts for most first.

    Parameters
    ----------
    study : Study
    """
    shares = shares_of(study.library, study.choice.candidates, study.left.noise_or_unknown_nm)
    main = max(shares, default=0.0)
    found = [
        _finding(study, index, term, share, first=share == main)
        for index, (term, share) in enumerate(zip(study.choice.terms, shares, strict=True))
    ]
    found += [_number_finding(study, wrong) for wrong in study.numbers]
    found.sort(key=lambda f: -energy_nm2(study, f))
    if not any(f.effect == "torque-saturation" for f in found):
        # A drive at its limit comes first: the motion was not the one that was asked for.
        found = [*_saturation_findings(study), *found]
    return tuple(replace(f, rank=rank) for rank, f in enumerate(found, start=1))


def energy_nm2(study: Study, finding: Finding) -> float:
    """Return the mean square torque that a finding accounts for, N m squared.

    A wrong number's share is of what the twin as given leaves, that of physics of what its refitted
    numbers leave: a soft gear may be all of the little that is left beside a wrong torque constant.
    """
    rows = study.library.weighing.rows
    own = finding.form == OWN_NUMBER
    left = study.table.target_nm[rows] if own else study.refitted_nm[rows]
    return finding.energy_share * max(
        float(np.mean(left**2)) - study.left.noise_or_unknown_nm**2, 0.0
    )


def _without(study: Study, index: int) -> Floats:
    """Return the blocks' squared errors on unseen data with one effect taken out again."""
    others = without_term(study.library, study.choice.candidates, index)
    return study.library.errors(others)


def _finding(study: Study, index: int, term: Term, share: float, *, first: bool) -> Finding:
    """Return one effect of the model as a finding."""
    library, model = study.library, study.model
    weighing, scene = library.weighing, library.scene
    form, own = term.scored.form, model.parameters[index]
    added = term.candidate.columns @ model.coefficients[model.slices()[index]] / weighing.weight
    order = order_of(scene, own)
    where = regions_of(scene, weighing.rows, form.effect, form.name, added, own, order)
    parameters = _numbers(study, index)
    parameters.pop(RECORDINGS, None)  # which ones is no quantity
    shown = shown_gear(scene) if form.name == SEEN else None
    if is_velocitys(parameters, study.table):
        parameters = as_velocitys(parameters)
    scale = float(np.sqrt(np.mean(1.0 / weighing.weight**2)))
    blows = scene.blows if heard(scene, form) else None
    reach_nm = reach_of(study, form.effect, added, where)
    told = sentences.finding_sentence(
        form.effect,
        where,
        reach_nm,
        share,
        parameters,
        first=first,
        beside_numbers=bool(study.numbers),
        in_twin=study.in_twin(form),
        beside=_said_already(study.twin, form.effect),
        or_warmth=or_warmth(study, form.effect),
    )
    clipped = saturation_evidence(scene.table) if form.effect == "torque-saturation" else None
    if clipped is not None:
        parameters |= {"limit_nm": Parameter(clipped.limit_nm, clipped.limit_ci95_nm)}
    if clipped is not None and clipped.reading:
        told = number_sentences.reading_sentence(
            clipped.limit_nm, clipped.tops, clipped.missing_nm, share, by_motion=clipped.by_motion
        )
    level_nm = _level_nm(study)
    if form.effect == _PLACE and _counted_from(level_nm, reach_nm):
        told = sentences.counted_from(told, level_nm, first=first)
    changed = changed_between(scene, form, term.candidate.point)
    if changed is not None:
        told = replace(told, caveat=sentences.changed_sentence(*changed))
    if blows:
        told = replace(told, caveat=sentences.ringing_sentence(blows.ringing))
    if shown is not None and shown.effect == form.effect:
        seen = sentences.shown_sentence(shown.effect, shown.size, scene.table.gear_ratio)
        told = replace(told, caveat=" ".join(text for text in (told.caveat, seen) if text))
    if form.effect == "joint-flexibility" and not scene.has("position_arm_rad"):
        part = parameters["arm_inertia_kg_m2"].value / inertia_of(scene)
        if math.isfinite(part):
            told = replace(told, caveat=sentences.spring_sentence(part))
    alternatives = alternatives_of(study, term)
    return Finding(
        effect=form.effect,
        rank=0,
        probability=min(term.probability, 1.0 - sum(a.probability for a in alternatives)),
        energy_share=share,
        where=where,
        said=told,
        parameters=parameters,
        alternatives=alternatives,
        holdout_rmse_without_nm=float(
            np.sqrt(_without(study, index).sum() / len(weighing.rows)) * scale
        ),
        form=form.name,
        curve=_curve(study, form, added, order),
        ringing=blows.ringing if blows else None,
    )


def _said_already(twin: Twin, effect: str) -> Mapping[str, float]:
    """Return the sums of the numbers that a simulation's own laws of an effect have."""
    out: dict[str, float] = {}
    for law in twin.effects:
        for name, value in law.numbers.items() if law.id == effect else ():
            out[name] = out.get(name, 0.0) + value
    return out


def _level_nm(study: Study) -> float:
    """Return by how much Coulomb friction moved beside the laws; 0 where it is told as wrong."""
    if any("coulomb_extra_nm" in number.parameters for number in study.numbers):
        return 0.0
    return study.model.base["coulomb_nm"].value - study.twin.coulomb_nm


def _counted_from(level_nm: float, reach_nm: tuple[float, float]) -> bool:
    """Return whether friction at a place is counted from another level than the simulation's.

    Where all of the stroke but that place rubs more, the law is a place that rubs less.
    """
    largest = reach_nm[0] if -reach_nm[0] > reach_nm[1] else reach_nm[1]
    return level_nm * largest < 0.0 and abs(level_nm) > _OF_THE_PLACE * abs(largest)


def _curve(study: Study, form: Form, added: Floats, order: float) -> Curve | None:
    """Return what an effect adds over its axis, beside what the whole model leaves."""
    effect = form.effect
    scene, weighing, left_nm = study.library.scene, study.library.weighing, study.model.residual_nm
    if effect in _SWINGS:
        return _SWINGS[effect](scene, weighing.rows, added, left_nm)
    size = effective_size(scene.table, weighing, left_nm * weighing.weight)
    share = size / len(weighing.rows)
    law = effect, form.name
    return curve_of(scene, weighing.rows, *law, added, left_nm, independent=share, order=order)


def _numbers(study: Study, index: int) -> dict[str, Parameter]:
    """Return a term's numbers as a twin names them, freed of what the motion's noise has bent."""
    form, own = study.model.terms[index].scored.form, study.model.parameters[index]
    beside = beside_others(study.library, study.model, index)
    predicts = without_one_constant(study.model, as_in_twin(form, beside, own))
    other = cancelled_by(study.library, study.model).get(index)
    if other is not None:
        name = NAMES[study.model.terms[other].scored.form.effect]
        reason = f"{name} nearly cancels it: what the two leave together is known, not either"
        return {name: Parameter.not_identified(reason, p.value) for name, p in predicts.items()}
    freed = study.unshaken.get(index)
    if freed is None:
        return predicts
    try:
        told = dict(as_in_twin(form, beside, {**own, **freed}))
    except TwinError:
        told = {}
    if told.keys() != predicts.keys():  # without the noise the twin's law is another, or none
        return {name: Parameter.not_identified(UNKNOWN, p.value) for name, p in predicts.items()}
    return {name: _not_below_nothing(found) for name, found in told.items()}


def _not_below_nothing(found: Parameter) -> Parameter:
    """Return a number of an arm, none of which is negative."""
    if found.ci95 is None:
        return found
    return replace(found, ci95=(max(found.ci95[0], 0.0), found.ci95[1]))


def order_of(scene: Scene, parameters: Mapping[str, Parameter]) -> float:
    """Return a finding's order per motor turn, 0 for none."""
    if "order_per_motor_rev" in parameters:
        return parameters["order_per_motor_rev"].value
    if "order_per_arm_rev" in parameters:
        return parameters["order_per_arm_rev"].value / scene.table.gear_ratio
    return 0.0


def _number_finding(study: Study, wrong: WrongNumber) -> Finding:
    """Return a wrong number of the twin as a finding."""
    rows = study.library.weighing.rows
    changes = _changes(study.twin, study, wrong)
    alike = dict(wrong.alternatives)
    if wrong.effect == "gravity-imbalance":
        hoses = gravity_look_alikes(study.library, study.twin, study.model)
        alike |= dict.fromkeys(hoses, (1.0 - sum(alike.values())) / (1.0 + len(hoses)))
    if "coulomb_extra_nm" in wrong.parameters and is_what_friction_lacks(study):
        alike = {YIELDING: 0.5, **{other: 0.5 * chance for other, chance in alike.items()}}
    return Finding(
        effect=wrong.effect,
        rank=0,
        probability=1.0 - sum(alike.values()),
        energy_share=wrong.energy_share,
        where=(),
        said=number_sentences.number_sentence(
            wrong.effect,
            changes,
            wrong.energy_share,
            recorded=study.table.simulated,
            doubtful=bool(alike),
        ),
        parameters=wrong.parameters,
        alternatives=tuple(
            Alternative(other, chance, told_apart_by(wrong.effect, other))
            for other, chance in alike.items()
        ),
        holdout_rmse_without_nm=float(np.sqrt(np.mean(study.table.target_nm[rows] ** 2))),
        form=OWN_NUMBER,
    )


def _saturation_findings(study: Study) -> list[Finding]:
    """Return a torque limit that the signals themselves show.

    A twin that is driven by the measured motion misses nothing there: the finding has no share of
    its mismatch.
    """
    evidence = saturation_evidence(study.table)
    if evidence is None or _limited(study.twin, evidence.limit_ci95_nm):
        return []
    rows = study.library.weighing.rows
    return [
        Finding(
            effect="torque-saturation",
            rank=0,
            probability=1.0,
            energy_share=0.0,
            where=(),
            said=(
                number_sentences.reading_sentence(
                    evidence.limit_nm,
                    evidence.tops,
                    evidence.missing_nm,
                    by_motion=evidence.by_motion,
                )
                if evidence.reading
                else number_sentences.saturation_sentence(
                    evidence.limit_nm, evidence.tops, evidence.shortfall_rad_s
                )
            ),
            parameters={"limit_nm": Parameter(evidence.limit_nm, evidence.limit_ci95_nm)},
            holdout_rmse_without_nm=float(
                np.sqrt(np.mean(study.model.residual_nm[: len(rows)] ** 2))
            ),
            form="flat tops of the torque",
        )
    ]


def _limited(twin: Twin, limit_nm: tuple[float, float]) -> bool:
    """Tell whether a twin has a torque limit that the signals agree with."""
    low, high = limit_nm[0] * (1.0 - _SAME_LIMIT), limit_nm[1] * (1.0 + _SAME_LIMIT)
    limits = [e.parameters.get("limit_nm") for e in twin.effects if e.id == "torque-saturation"]
    return any(isinstance(limit, float) and low <= limit <= high for limit in limits)


def _changes(twin: Twin, study: Study, wrong: WrongNumber) -> dict[str, tuple[float, float, str]]:
    """Return what is wrong in words: what the twin says, what the recordings say, the unit."""
    if wrong.effect == "torque-constant-error":
        return {"factor": (1.0, wrong.parameters["factor"].value, "")}
    factor = factor_of(study.numbers)
    told = "" if factor == 1.0 else ", in the torque that is reported,"
    return {
        f"{NUMBERS[name]}{told}": (
            float(getattr(twin, name)) / factor,
            study.model.base[name].value,
            parameter_unit(name),
        )
        for name in _NUMBERS.get(wrong.effect, ())
        if study.model.base[name].identified and math.isfinite(study.model.base[name].value)
    }
