"""What is told of a study whose laws explain too little: the mismatch, without those laws.

A law that is not named is in no number of the answer either. Else a twin would hold what nobody is
told of, an error would have fallen by nothing, and the larger part of a mismatch that has no name
would be missing from where it lies. Nor is a number called wrong that this part may have bent.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from agent.explain.answer.amounts import torque
from agent.explain.answer.fits import UNSEEN
from agent.explain.answer.names import NAMES, OWN_NUMBER
from agent.explain.answer.result import Finding, Holdout, Verdict
from agent.explain.choosing.search import Library
from agent.explain.findings import order_of
from agent.explain.forms.form import Form
from agent.explain.left import LOUDER
from agent.explain.numbers.borne_out import borne_out, leaves_out_right
from agent.explain.numbers.intervals import named_effects
from agent.explain.numbers.model import Model, extended_twin, fit_model
from agent.explain.numbers.reach import reach_of
from agent.explain.numbers.refuted import lasting
from agent.explain.rows.orders import MANY_WAVES
from agent.explain.study import Study
from agent.explain.verdict import OWN_NUMBERS, SHOWN
from agent.identify.result import Parameter

_WAVES = frozenset({"torque-ripple", "kinematic-error", "resolver-error"})
_GOOD_PART = 0.15  # of what the refitted twin leaves
_USUALLY = 0.9  # of what the refitted twin leaves
_UNPROVEN = 1.5  # times the noise on unseen data, and no noise in kind: not all is explained
_MOST, _HALF = 0.6, 0.5  # of a mismatch: what laws claim to explain, and take away elsewhere
_WORSE = 1.1  # times the error of the simulation as given: more, and a law has harmed
_FAR_WORSE = 1.25  # or this, where a law explains a part anyway


def unnamed(found: Study, waves: frozenset[str] = frozenset()) -> Study:
    """Return a study with the twin's own numbers refitted, and no law beside what signals show.

    Parameters
    ----------
    found : Study
        Unexplained.
    waves : frozenset of str
        Those that stay named, see `sure_waves`.
    """
    library = found.library
    every = zip(found.choice.terms, found.model.parameters, strict=True)
    terms = tuple(
        term
        for term, numbers in every
        if _is_told(term.scored.form, numbers) or term.scored.form.effect in waves
    )
    model = fit_model(library, found.twin, terms)
    numbers = borne_out(found.numbers, library, model, found.floor.value_nm, found.cells)
    extended = extended_twin(library, found.twin, model)
    if not terms and not numbers and _spreads(found):
        given_nm = found.table.target_nm[library.weighing.rows]
        model, extended = replace(model, residual_nm=given_nm), found.twin
    return replace(
        found,
        choice=replace(
            found.choice, terms=terms, full=library.errors([t.candidate for t in terms])
        ),
        model=model,
        numbers=numbers,
        extended=extended,
        left_cells=found.cells,
    )


def sure_waves(found: Study) -> frozenset[str]:
    """Return the waves that are there, whatever else has no name.

    Nothing but a wave has so narrow a line: one of many periods along the stroke that carries a
    good part of the mismatch on unseen data, block after block, is none of what has no name.

    Parameters
    ----------
    found : Study
        With its laws.
    """
    scene, choice = found.library.scene, found.choice
    if not scene.has("position_rad"):
        return frozenset()
    turns = float(np.ptp(scene.table.rows["position_rad"])) / (2.0 * math.pi)
    whole, out = float(choice.plain.sum()), set()
    for term, numbers in zip(choice.terms, found.model.parameters, strict=True):
        if term.scored.form.effect not in _WAVES:
            continue
        loss = found.library.errors([t.candidate for t in choice.terms if t is not term])
        loss = loss - choice.full
        many = order_of(scene, numbers) * turns >= MANY_WAVES
        if many and float(loss.sum()) >= _GOOD_PART * whole and lasting(loss):
            out.add(term.scored.form.effect)
    return frozenset(out)


def _spreads(found: Study) -> bool:
    """Return whether refitted numbers spread what the twin as given leaves in a few places.

    A brake that drags once bends them, so that the simulation is off everywhere; usually it was
    right, as the median tells.
    """
    rows = found.library.weighing.rows
    given, refitted = (
        float(np.median(np.abs(left[rows]))) for left in (found.table.target_nm, found.refitted_nm)
    )
    return given < _USUALLY * refitted


def _is_told(form: Form, numbers: Mapping[str, Parameter]) -> bool:
    """Return whether a law stays named: by itself, or as a number that is surely not as given."""
    if form.effect in SHOWN:
        return True
    sizes = {name: numbers[name] for name in form.linear if name in numbers}
    is_known = any(size.ci95 is not None for size in sizes.values())
    refuted = any(leaves_out_right(name, size) for name, size in sizes.items())
    return form.effect in OWN_NUMBERS and (refuted or not is_known)


def may_be_the_unnamed(library: Library, model: Model) -> bool:
    """Return whether what is left could have made every law of a model, none of which need be.

    With its shape held, a law's size reaches over nothing beside what has no name. Such laws share
    out what follows nothing that was recorded: friction after a rest as a spot, and as one-sided.

    Parameters
    ----------
    library : Library
    model : Model
        Fitted to the library.
    """
    columns = library.model([term.candidate for term in model.terms])
    weighted = model.residual_nm * library.weighing.weight
    reach = reach_of(library.candidates, library.weighing, columns, weighted, named_effects(model))
    low, high = model.coefficients + reach.below, model.coefficients + reach.above
    none = (low <= 0.0) & (high >= 0.0)
    return bool(model.terms) and all(none[place].all() for place in model.slices())


def own_numbers(told: Study) -> frozenset[str]:
    """Return what of the twin's own numbers is told beside a mismatch without a name.

    Parameters
    ----------
    told : Study
        Without the laws that are not named.
    """
    terms = (term.scored.form.effect for term in told.choice.terms)
    return frozenset((*terms, *(number.effect for number in told.numbers)))


def unproven(proven: Holdout, floors: float = 1.0, claimed: float = 0.0) -> bool:
    """Return whether unseen data hold far more than noise beside what was found.

    What has no memory may be noise that is louder in motion, up to so much more than at rest: blows
    of a gear's teeth have none, either. But not where laws that explain most of what was learnt
    from take away less than half of it there: the best of many paths of an arm is luck.

    Parameters
    ----------
    proven : Holdout
    floors : float
        How many times the floor the noise is.
    claimed : float
        Which share of the mismatch the laws explain that were found.
    """
    ratio = proven.floor_ratio / floors
    unseen = proven.source == UNSEEN  # parts left out in turn are no recordings
    if unseen and claimed >= _MOST and proven.taken_share(floors) < _HALF:
        return True
    return (unseen and ratio > LOUDER) or (ratio > _UNPROVEN and not proven.white)


def _no_better(verdict: Verdict, proven: Holdout) -> bool:
    """Return whether unseen recordings are no better, where nothing else says what is noise."""
    settled = verdict in ("explained", "tied") and proven.source == UNSEEN
    return settled and not proven.floor_ratio > 0.0 and proven.improvement_percent <= 0.0


def taken_back(verdict: Verdict, findings: Sequence[Finding], proven: Holdout) -> tuple[str, ...]:
    """Return why laws that would explain all are not told after all; nothing where they stand.

    They are taken back where unseen data were nearly noise without them, and are clearly worse with
    them: then what they were fitted to is not what the joint does. Where unseen data have a
    mismatch of their own, a law may be right, and its numbers not: friction drifts on. A law that
    explains a part of what was fitted, and makes unseen data far worse, has neither; nor has one
    beside which unseen recordings are far worse than with the numbers alone. Where no noise floor
    is known, unseen recordings are all that speaks for a law: they have to be better with it.

    Parameters
    ----------
    verdict : Verdict
    findings : sequence of Finding
    proven : Holdout
    """
    laws = [NAMES[f.effect] for f in findings if f.form != OWN_NUMBER and f.energy_share > 0.0]
    interval = proven.improvement_ci95_percent
    before, after = proven.baseline.rmse_nm, proven.extended.rmse_nm
    if laws and _no_better(verdict, proven):
        return (
            f"{' and '.join(laws)} would carry what was fitted, and was taken back: on "
            f"{proven.source} the error stayed {torque(after)}, and noise is not known here",
        )
    refitted, in_part = proven.refitted.rmse_nm, verdict == "partly-explained"
    if laws and in_part and proven.source == UNSEEN and after > _FAR_WORSE * refitted:
        return (
            f"{' and '.join(laws)} would carry a part of what was fitted, and was taken back: on "
            f"{proven.source} the error is {torque(after)}, and {torque(refitted)} with the "
            "simulation's numbers alone refitted",
        )
    if not laws or interval is None or interval[1] >= 0.0:
        return ()
    in_part = in_part and after > _FAR_WORSE * before
    whole = verdict in ("explained", "tied") and after > _WORSE * before and not unproven(proven)
    if not in_part and not whole:
        return ()
    return (
        f"{' and '.join(laws)} would carry what was fitted, and was taken back: on {proven.source} "
        f"the error rose from {torque(before)} to {torque(after)}",
    )
