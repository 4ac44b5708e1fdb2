"""How far a model's numbers may be from the truth: noise, recordings, and what is left out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from agent.explain.choosing.materiality import FAR, noise_energy
from agent.explain.choosing.rivals import WEIGHT, Term
from agent.explain.choosing.search import Library
from agent.explain.forms.form import Form
from agent.explain.forms.refinement import limits_of
from agent.explain.numbers.held_weight import reaching_over_the_weight
from agent.explain.numbers.lag import reaching_over_a_filter
from agent.explain.numbers.model import Model
from agent.explain.numbers.other_pulls import reaching_over_other_pulls
from agent.explain.numbers.profile import profiled
from agent.explain.numbers.reach import Reach, reach_of
from agent.explain.numbers.slopes import derivatives_of
from agent.explain.numbers.uneven import compared
from agent.explain.rows.table import BASE, GRAVITY_AT
from agent.identify.result import Parameter

_TOGETHER = "known only together with a number that the squared error hardly depends on"
_AS_PRODUCT = "known only together with its law's other numbers"
_BOUNCES = "known only where one path of an arm that bounces is foretold"
_WILD = 40.0  # times a number: so wide an interval with zero in it says that nothing is known


def with_intervals(library: Library, model: Model) -> Model:
    """Return a model whose intervals own up to what it leaves out; see `reach`.

    A non-linear number's interval is the profile's, too, where that reaches further.

    Parameters
    ----------
    library : Library
    model : Model
        As it was fitted to the library.
    """
    derivatives, places = derivatives_of(library, model)
    weighted = model.residual_nm * library.weighing.weight
    named = named_effects(model)
    if _weighs_beside(library, model):
        named -= {WEIGHT}
    reach = reach_of(library.candidates, library.weighing, derivatives, weighted, named)
    if WEIGHT not in named:
        reach = reaching_over_the_weight(library, derivatives, weighted, reach)
    carried = library.scene.table.carried
    base = dict(model.base)
    for at, name in enumerate(np.array(BASE)[carried].tolist()):
        base[name] = _widened(base[name], reach, at)
    parameters = []
    for index, (term, own, place) in enumerate(
        zip(model.terms, model.parameters, model.slices(), strict=True)
    ):
        numbers = dict(own)
        for at, name in enumerate(term.scored.form.linear, start=place.start):
            numbers[name] = _widened(numbers[name], reach, at)
        numbers |= _nonlinear(library, model, index, reach, places)
        numbers = only_together(term.scored.form, numbers)
        parameters.append(_but_for_what_is_too_fast(library, term, numbers))
    reaching = reaching_over_a_filter(model, parameters)
    return reaching_over_other_pulls(library, replace(model, base=base, parameters=reaching))


def _weighs_beside(library: Library, model: Model) -> bool:
    """Return whether the arm's weight is held as the twin has it, for what may stand for it.

    Though a hose is told in its place, the weight is there as well, and as well known as the twin's
    other numbers: five percent of it are a third of a hose's stiffness.
    """
    weighs = bool(np.any(library.scene.as_given[GRAVITY_AT]))
    return weighs and all(term.scored.form.effect != WEIGHT for term in model.terms)


def only_together(form: Form, numbers: Mapping[str, Parameter]) -> dict[str, Parameter]:
    """Return a form's numbers without a size that only its product with another number carries.

    Where friction falls evenly as a gearbox warms, how much of it warmth takes away and how soon
    are one slope: neither is known, and an interval from minus nine to seventeen times the number
    is none. Nor is one that reaches below zero where physics does not: the law is there, and its
    size would be nothing. Without a weight a load has no scale, and friction under it is a product.
    Nor, whatever the law, one that is as wide as many times the number, on both sides of zero. A
    wave's sine may be nothing where its cosine is surely not.
    And where a number along which the error is uneven is not known, the others are known at one of
    its values only, each of which has its own.

    Parameters
    ----------
    form : Form
    numbers : mapping of str to Parameter
        With their intervals.
    """
    if any(not numbers[name].identified for name in form.uneven):
        return {name: _with_that(number) for name, number in numbers.items()}
    out = {n: _assumed(form, n, p) for n, p in numbers.items()}
    if form.told_apart_by and form.known_as_product(numbers):
        why = form.known_as_product(numbers)
        return out | {n: Parameter.not_identified(why, numbers[n].value) for n in form.linear}
    loose = not all(numbers[name].identified for name in form.nonlinear)
    for index, name in enumerate(form.linear):
        ci = numbers[name].ci95
        product = form.in_one_product and form.sign(index) > 0
        if ci is None or not _may_be_nothing(numbers, name):
            continue
        if loose or product or ci[1] - ci[0] > _WILD * abs(numbers[name].value):
            reason = _TOGETHER if loose else _AS_PRODUCT
            out[name] = Parameter.not_identified(reason, numbers[name].value)
    return out


def _but_for_what_is_too_fast(
    library: Library, term: Term, numbers: dict[str, Parameter]
) -> dict[str, Parameter]:
    """Return a term's numbers without those that what is compared is too slow to tell."""
    form = term.scored.form
    beyond = form.beyond(library.scene, term.candidate.point) if form.beyond is not None else {}
    return numbers | {
        n: Parameter.not_identified(why, numbers[n].value) for n, why in beyond.items()
    }


def _may_be_nothing(numbers: Mapping[str, Parameter], name: str) -> bool:
    """Return whether a number may be zero, and with it all of the wave of which it is a part."""
    other = {"sin": "cos", "cos": "sin"}
    beside = "_".join(other.get(word, word) for word in name.split("_"))
    ends = (numbers[part].ci95 for part in {name, beside} & numbers.keys())
    return all(ci is None or ci[0] <= 0.0 <= ci[1] for ci in ends)


def _assumed(form: Form, name: str, number: Parameter) -> Parameter:
    """Return a number without an interval where it is known only for one that is assumed."""
    known = name not in form.assumes or not number.identified
    return number if known else Parameter.not_identified(form.assumes[name], number.value)


def _with_that(number: Parameter) -> Parameter:
    """Return a number that is known only together with one that is not."""
    return Parameter.not_identified(_TOGETHER, number.value) if number.identified else number


def named_effects(model: Model) -> frozenset[str]:
    """Return the effects of the model, and those that a reader is told may stand in their place."""
    found = {term.scored.form.effect for term in model.terms}
    rivals = {rival.scored.form.effect for term in model.terms for rival in term.rivals}
    return frozenset(found | rivals)


def _nonlinear(
    library: Library,
    model: Model,
    index: int,
    reach: Reach,
    places: Mapping[tuple[int, int], int],
) -> dict[str, Parameter]:
    """Return a term's non-linear numbers with their intervals, within what physics allows."""
    term = model.terms[index]
    form = term.scored.form
    mean = form.is_a_mean is not None and form.is_a_mean(term.candidate.point)
    dull = tuple(form.roughly) if mean and _more_than_noise(library, model) else ()
    out = {}
    for number, name in enumerate(form.nonlinear):
        if name in form.kinds:
            out[name] = Parameter(float(term.candidate.point[number]), None)
            continue
        within = None
        if (index, number) in places:
            at, value = places[index, number], float(term.candidate.point[number])
            grid = np.array([c.point for c in library.candidates if c.form is form])
            low, high = limits_of(form, library.scene, grid)[number]
            within = (
                max(value + float(reach.below[at]), min(low, value)),
                min(value + float(reach.above[at]), max(high, value)),
            )
        if name in dull:
            out[name] = Parameter.not_identified(_BOUNCES, float(term.candidate.point[number]))
            continue
        interval = compared if name in form.uneven else profiled
        out[name] = _no_finer(interval(library, model.terms, index, number, within), form, name)
    return out


def _no_finer(number: Parameter, form: Form, name: str) -> Parameter:
    """Return a number whose interval is no narrower than the luck of an arm that bounces is."""
    rough = form.roughly.get(name, 0.0) * abs(number.value)
    if number.ci95 is None or not rough:
        return number
    low, high = number.ci95
    below, above = math.hypot(number.value - low, rough), math.hypot(high - number.value, rough)
    return replace(number, ci95=(number.value - below, number.value + above))


def _more_than_noise(library: Library, model: Model) -> bool:
    """Return whether a model leaves so much more than noise that it misses something."""
    noise = noise_energy(library, [t.candidate for t in model.terms])
    left = model.residual_nm * library.weighing.weight
    return float(left @ left) > FAR**2 * noise


def _widened(parameter: Parameter, reach: Reach, at: int) -> Parameter:
    """Return a number with the interval that its reach gives it."""
    if parameter.ci95 is None:
        return parameter
    value = parameter.value
    return replace(parameter, ci95=(value + float(reach.below[at]), value + float(reach.above[at])))
