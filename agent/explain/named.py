"""Effects chosen and fitted, but for those that their own law, the joint or the data refuse."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, replace

import numpy as np

from agent.explain.choosing.afloat import afloat
from agent.explain.choosing.band import only_in_a_band
from agent.explain.choosing.choice import Choice, choose
from agent.explain.choosing.heard import heard
from agent.explain.choosing.materiality import least_gain, noise_energy, worth
from agent.explain.choosing.misfits import misfits
from agent.explain.choosing.only_fast import only_fast
from agent.explain.choosing.search import Library
from agent.explain.choosing.unlevered import unlevered
from agent.explain.numbers.anew import chosen_anew
from agent.explain.numbers.borne_out import borne_out
from agent.explain.numbers.driving import driving
from agent.explain.numbers.even import evened
from agent.explain.numbers.explained_before import least_beside_effects
from agent.explain.numbers.heavier import heavier_than_the_joint
from agent.explain.numbers.intervals import with_intervals
from agent.explain.numbers.model import Model, extended_twin, fit_model, predicted
from agent.explain.numbers.resting import settled_beside
from agent.explain.numbers.smoothing import only_smooths
from agent.explain.numbers.written import not_as_found
from agent.explain.numbers.wrong import wrong_numbers
from agent.explain.rows.floor import noise_floor
from agent.physics.twin import Effect, Twin, TwinError

_MOST_REFUSALS = 5


@dataclass(frozen=True)
class Named:
    """What a mismatch consists of.

    Parameters
    ----------
    library : Library
    choice : Choice
    model : Model
    extended : Twin
        With the chosen effects, and numbers refitted beside them.
    """

    library: Library
    choice: Choice
    model: Model
    extended: Twin

    @classmethod
    def of(cls, library: Library, twin: Twin, choice: Choice) -> Named:
        """Return a choice with its model of a twin."""
        model = fit_model(library, twin, choice.terms)
        return cls(library, choice, model, extended_twin(library, twin, model))


def named(library: Library, twin: Twin) -> Named:
    """Choose and fit effects; a form whose numbers its own law refuses is left out, and again.

    A fit that needs a spring to push instead of pull may describe the data; it is no spring. Nor is
    a gap one that removes noise, a law one that copies another, or an arm heavier than its joint.
    What is refused in its best form and in the next best is not asked for in a third.
    """
    once: set[str] = set()
    chosen: tuple[Library, Choice] | None = None
    for _ in range(_MOST_REFUSALS):
        chosen = chosen or chosen_anew(library)
        library, choice = settled_beside(*chosen)
        choice = _material(library, choice, twin)
        refused = _unlikely(library, choice)
        if not refused:
            even = evened(library, choice)
            if even[1] is not choice:
                library, choice = even[0], _material(*even, twin)
                refused = _unlikely(library, choice)
        if not refused:
            library, choice = driving(library, choice)
        if not refused:
            model = fit_model(library, twin, choice.terms)
            refused = heavier_than_the_joint(library, model)
        if not refused:
            try:
                extended = extended_twin(library, twin, model)
                refused = not_as_found(library, twin, model, extended)
            except TwinError:
                refused = _refused(library, twin, model) or _refused_together(library, twin, choice)
        if not refused:
            return Named(library, choice, model, extended)
        twice = once & {effect for effect, _ in refused}
        once |= {effect for effect, _ in refused}
        library = _without(library, refused, twice)
        # What the search had not chosen it would not choose once more: another stands in its place.
        forms = [term.scored.form for term in chosen[1].terms]
        again = any((f.effect, f.name) in refused or f.effect in twice for f in forms)
        chosen = None if again else (_without(chosen[0], refused, twice), chosen[1])
    empty = replace(library, candidates=())
    return Named.of(empty, twin, choose(empty))


def _unlikely(library: Library, choice: Choice) -> set[tuple[str, str]]:
    """Return effect and form of the laws that the data show to be something else."""
    refused = afloat(library, choice) | misfits(library, choice)
    refused |= only_in_a_band(library, choice) | only_fast(library, choice)
    return refused | unlevered(library, choice) | only_smooths(library, choice)


def _without(
    library: Library, refused: Container[tuple[str, str]], effects: Container[str]
) -> Library:
    """Return a library without some forms, and without all of some effects."""
    kept = (
        c
        for c in library.candidates
        if (c.form.effect, c.form.name) not in refused and c.form.effect not in effects
    )
    return replace(library, candidates=tuple(kept))


def beside_wrong_numbers(found: Named, twin: Twin, taken_for: frozenset[str]) -> Named:
    """Leave out effects that are lost in what wrong numbers of the twin's own leave.

    Where all that a simulation lacks is a right number, the joint's small effects are none of the
    mismatch: they stood out of what the refitted twin leaves, which is noise.

    Parameters
    ----------
    found : Named
    twin : Twin
        As given.
    taken_for : frozenset of str
        Effects that stand for a wrong number here.
    """
    library, choice = found.library, found.choice
    candidates, noise_nm = choice.candidates, _noise_nm(library, found.model)
    if candidates and wrong_numbers(
        library, twin, found.model, candidates, noise_nm, taken_for=taken_for
    ):
        kept = _material(library, choice, twin, beside_wrong_numbers=True)
        if len(kept.terms) < len(choice.terms):
            bare = Named.of(library, twin, kept)
            # Alone, a number may be no more sure than the law that goes: then nothing had a name.
            if kept.terms or _has_a_number(library, twin, bare.model, taken_for):
                return bare
    return found


def _has_a_number(library: Library, twin: Twin, model: Model, taken_for: frozenset[str]) -> bool:
    """Return whether a number of the twin's own is wrong where no law stands beside it."""
    sure, noise_nm = with_intervals(library, model), _noise_nm(library, model)
    found = wrong_numbers(library, twin, sure, (), noise_nm, taken_for=taken_for)
    return bool(borne_out(found, library, sure, noise_nm))


def _noise_nm(library: Library, model: Model) -> float:
    left = np.zeros(library.scene.table.used.shape[0])
    left[library.weighing.rows] = model.residual_nm
    return max(noise_floor(library.scene.table, left).value_nm, 0.0)


def _material(
    library: Library, choice: Choice, twin: Twin, *, beside_wrong_numbers: bool = False
) -> Choice:
    """Leave out terms that remove nothing on unseen data beside the others.

    And those, the weakest first, for which there are not enough blocks to leave one out.
    """
    terms, full = list(choice.terms), choice.full
    least = noise = 0.0
    if terms:
        noise = noise_energy(library, choice.candidates)
        least = least_gain(
            library,
            choice.plain,
            choice.candidates,
            beside_wrong_numbers=beside_wrong_numbers,
        )
        least = max(least, least_beside_effects(library, twin))
    blocks = library.weighing.starts.shape[0]
    while terms:
        losses = [
            worth(
                library.errors([t.candidate for t in terms if t is not term]),
                full,
                0.0 if heard(library.scene, term.scored.form) else least,
                noise,
            )
            for term in terms
        ]
        weakest = int(np.argmin(losses))
        borne = library.model([t.candidate for t in terms]).shape[1] < blocks
        if borne and losses[weakest] >= 0.0:
            break
        del terms[weakest]
        full = library.errors([t.candidate for t in terms])
    return replace(choice, terms=tuple(terms), full=full)


def _refused(library: Library, twin: Twin, model: Model) -> set[tuple[str, str]]:
    """Return effect and form of the terms that a twin does not take with the numbers found."""
    out = set()
    for term, numbers in zip(model.terms, model.parameters, strict=True):
        form = term.scored.form
        values = {name: p.value for name, p in numbers.items()}
        try:
            # Some forms ask the twin's law already while they look for its numbers.
            tables = form.to_twin(library.scene, values)
            effects = tuple(Effect(form.effect, dict(table)) for table in tables)
            predicted(library.scene.table, replace(twin, effects=effects))
        except TwinError:
            out.add((form.effect, form.name))
    return out


def _refused_together(library: Library, twin: Twin, choice: Choice) -> set[tuple[str, str]]:
    """Return effect and form of the law without which a twin takes all others; else of all laws.

    A run-in and a torque constant may each leave some friction, and both none.
    """
    forms = {(t.scored.form.effect, t.scored.form.name) for t in choice.terms}
    for term in reversed(choice.terms):
        rest = [t for t in choice.terms if t is not term]
        try:
            extended = extended_twin(library, twin, fit_model(library, twin, rest))
            predicted(library.scene.table, extended)
        except TwinError:
            continue
        return {(term.scored.form.effect, term.scored.form.name)}
    return forms
