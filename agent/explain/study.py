"""Everything that a verdict is drawn from: the mismatch located, named and modelled."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Cell, Floor
from agent.explain.choosing.afloat import afloat
from agent.explain.choosing.band import only_in_a_band
from agent.explain.choosing.choice import Choice, choose
from agent.explain.choosing.heard import heard
from agent.explain.choosing.materiality import least_gain, noise_energy, worth
from agent.explain.choosing.misfits import misfits
from agent.explain.choosing.only_fast import only_fast
from agent.explain.choosing.search import Library
from agent.explain.choosing.unlevered import unlevered
from agent.explain.forms.arm_encoder import seen_by_the_arm
from agent.explain.forms.balancer import BALANCERS, COIL
from agent.explain.forms.form import Form
from agent.explain.forms.library import judgeable
from agent.explain.left import Left
from agent.explain.location.deficiency import deficiency_map
from agent.explain.numbers.alike import off_alike
from agent.explain.numbers.anew import chosen_anew
from agent.explain.numbers.balanced import spring_does_without
from agent.explain.numbers.borne_out import below_zero, borne_out
from agent.explain.numbers.explained_before import least_beside_effects
from agent.explain.numbers.heavier import heavier_than_the_joint
from agent.explain.numbers.hidden import reaching_over_the_unnamed
from agent.explain.numbers.instead import with_laws_instead
from agent.explain.numbers.intervals import with_intervals
from agent.explain.numbers.model import Model, extended_twin, fit_model, predicted
from agent.explain.numbers.resting import settled_beside
from agent.explain.numbers.short_stroke import (
    PAYLOAD,
    gravity_in_question,
    in_its_place,
    in_question,
    is_the_factors_weight,
    weight_is_worth_a_name,
    without_gravity,
)
from agent.explain.numbers.smoothing import only_smooths
from agent.explain.numbers.typical import at_typical
from agent.explain.numbers.unshaken import unshaken
from agent.explain.numbers.written import not_as_found
from agent.explain.numbers.wrong import WrongNumber, factor_of, told_again, wrong_numbers
from agent.explain.rows.evidence import weigh
from agent.explain.rows.floor import noise_floor
from agent.explain.rows.lines import Line, lines_of
from agent.explain.rows.scene import Scene, refit
from agent.explain.rows.table import BASE, Table, without_edges
from agent.explain.rows.usual import usual_blocks
from agent.identify.result import Floats, Parameter
from agent.physics.twin import Effect, Twin, TwinError

_MOST_REFUSALS = 5


@dataclass(frozen=True)
class Study:
    """A mismatch located, named and modelled.

    Parameters
    ----------
    twin, extended : Twin
        As given, and with what was found.
    table : Table
    library : Library
    choice : Choice
    model : Model
    numbers : tuple of WrongNumber
        Which of the twin's own numbers the recordings refute.
    impossible : tuple of WrongNumber
        Those that come out below zero, bent by what has no name.
    floor : Floor
    cells, left_cells : tuple of Cell
        The deficiency map of the refitted twin, and that of the extended one.
    lines : tuple of Line
        What swings at a frequency of its own in what the extended twin leaves.
    refitted_nm : ndarray, shape (n,)
        What the refitted twin leaves at the table's rows.
    not_judged : mapping of str to str
        Effects that these recordings cannot show, and why.
    """

    twin: Twin
    table: Table
    library: Library
    choice: Choice
    model: Model
    extended: Twin
    numbers: tuple[WrongNumber, ...]
    impossible: tuple[WrongNumber, ...]
    floor: Floor
    cells: tuple[Cell, ...]
    left_cells: tuple[Cell, ...]
    lines: tuple[Line, ...]
    refitted_nm: Floats
    not_judged: Mapping[str, str]

    @cached_property
    def left(self) -> Left:
        """Return what the extended twin leaves."""
        rows, residual_nm = self.library.weighing.rows, self.model.residual_nm
        return Left(self.table, rows, residual_nm, self.floor, self.left_cells, self.lines)

    def in_twin(self, form: Form) -> bool:
        """Return whether the extended twin has a law that was found, where a twin can have it.

        A hidden state that its own simulation does not bear out is in none.
        """
        before, now = (
            sum(e.id == form.effect for e in twin.effects) for twin in (self.twin, self.extended)
        )
        return not form.at_edges or now > before

    @cached_property
    def unshaken(self) -> Mapping[int, Mapping[str, Parameter]]:
        """Return numbers that the motion's noise has bent, freed of it, by term."""
        return unshaken(self.library, self.model)

    @property
    def torque_late_s(self) -> float:
        """Return by how much all of the model is later than the motion, and with it its edges."""
        return self.table.torque_late_s or self.library.scene.late_s

    @cached_property
    def apart_from_edges(self) -> NDArray[np.bool_]:
        """Return which of the compared rows are none where the torque starts or turns, (m,)."""
        rows = self.library.weighing.rows
        if self.torque_late_s == self.table.torque_late_s:
            return np.ones(rows.shape, dtype=np.bool_)
        apart = without_edges(self.table, self.table.creep_rad_s, self.torque_late_s)
        return apart.used[rows]


def study(
    twin: Twin, table: Table, among: Container[str] | None = None, *, ask: bool = True
) -> Study:
    """Locate, name and model what a twin leaves of a table.

    Parameters
    ----------
    twin : Twin
    table : Table
        Of recordings that slide.
    among : container of str, optional
        The effects to choose from; all.
    ask : bool
        Whether gravity is put in question where the first recording's stroke is too short for it.
    """
    asked = table
    library, not_judged, refitted, by_spring = _library(twin, table, among, ask=ask)
    lines = lines_of(table, refitted)
    named = _named(library, twin)
    if by_spring and not any(term.scored.form in BALANCERS for term in named[1].terms):
        # The weight was held for a spring that is not there: it is asked about without one.
        library, not_judged, refitted, _ = _library(twin, table, among, ask=ask, springs=False)
        named = _named(library, twin)
    taken_for: frozenset[str] = frozenset()
    if in_question(library) and not in_its_place(*named[:2]):
        if not weight_is_worth_a_name(library):
            taken_for = frozenset({PAYLOAD.effect})
        library, not_judged, refitted, _ = _library(twin, table, among, ask=False)
        named = _named(library, twin)
    cells = deficiency_map(library, lines=lines)
    library, choice, model, extended = _beside_wrong_numbers(*named, twin, taken_for)
    table = library.scene.table
    model = with_intervals(library, model)
    typical = at_typical(library, choice, model)
    if typical is not choice:
        choice, model = typical, with_intervals(library, fit_model(library, twin, typical.terms))
        extended = extended_twin(library, twin, model)
    left = np.zeros(table.used.shape[0])
    left[library.weighing.rows] = model.residual_nm
    if choice.terms:
        lines = lines_of(table, left)
    floor = noise_floor(table, left)
    noise_nm = floor.value_nm if floor.value_nm > 0.0 else 0.0
    numbers = wrong_numbers(library, twin, model, choice.candidates, noise_nm, taken_for=taken_for)
    factor = factor_of(numbers)
    if ask and _weighs_by_the_factor(twin, choice, model, factor):
        return study(twin, asked, among, ask=False)
    if not choice.terms:
        numbers = borne_out(numbers, library, model, noise_nm, cells)
    model = reaching_over_the_unnamed(library, model)
    numbers = told_again(numbers, twin, model)
    impossible = below_zero(numbers, twin, model, noise_nm)
    numbers = tuple(number for number in numbers if number not in impossible)
    if not choice.terms:
        numbers = with_laws_instead(numbers, library)
    return Study(
        twin=twin,
        table=table,
        library=library,
        choice=choice,
        model=model,
        extended=extended,
        numbers=numbers,
        impossible=impossible,
        floor=floor,
        cells=cells,
        left_cells=deficiency_map(library, choice.candidates, lines) if choice.terms else cells,
        lines=lines,
        refitted_nm=refitted,
        not_judged=not_judged,
    )


def _weighs_by_the_factor(twin: Twin, choice: Choice, model: Model, factor: float) -> bool:
    """Return whether a weight that is held as given is off as all other numbers are."""
    forms = [term.scored.form for term in choice.terms]
    if factor != 1.0 and (COIL in forms or is_the_factors_weight(twin, choice, model, factor)):
        return True
    sines = PAYLOAD in forms or COIL in forms
    return sines and off_alike(twin, model, BASE) is not None


def _library(
    twin: Twin,
    table: Table,
    among: Container[str] | None,
    *,
    ask: bool = True,
    springs: bool = True,
) -> tuple[Library, Mapping[str, str], Floats, bool]:
    """Return all candidates, what cannot be judged, and what the twin's refitted numbers leave.

    And whether gravity is held as given because a balancer's spring does without any other.

    Parameters
    ----------
    twin : Twin
    table : Table
    among : container of str, optional
    ask : bool
        Whether gravity is put in question where the first recording's stroke is too short for it.
    springs : bool
        Whether a balancer's spring may be there.
    """
    scene, left = _refitted(twin, table)
    forms, not_judged = seen_by_the_arm(scene, *judgeable(table, twin))
    forms = tuple(f for f in forms if among is None or f.effect in among)
    forms = tuple(f for f in forms if springs or f not in BALANCERS)
    as_given: bool | None = None
    weighing = weigh(table, left)
    usual = weighing.part(usual_blocks(table, weighing))[0]
    if ask:
        held = _refitted(twin, without_gravity(table))
        as_given = spring_does_without(scene, held[0], usual, forms)
        if gravity_in_question(scene, usual, forms) if as_given is None else as_given:
            (scene, left), forms = held, (*forms, PAYLOAD)
    return Library.of(scene, weigh(table, left), forms), not_judged, left, bool(as_given)


def _refitted(twin: Twin, table: Table) -> tuple[Scene, Floats]:
    """Return the table with what the twin's refitted numbers make of it, and what they leave."""
    delta, left = refit(table)
    theta = np.array([getattr(twin, name) for name in BASE]) + delta
    return Scene(table, theta, np.where(table.used, left, 0.0), given=theta - delta), left


def _named(library: Library, twin: Twin) -> tuple[Library, Choice, Model, Twin]:
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
        refused = afloat(library, choice) | misfits(library, choice)
        refused |= only_in_a_band(library, choice) | only_fast(library, choice)
        refused |= unlevered(library, choice) | only_smooths(library, choice)
        if not refused:
            model = fit_model(library, twin, choice.terms)
            refused = heavier_than_the_joint(library, model)
        if not refused:
            try:
                extended = extended_twin(library, twin, model)
                refused = not_as_found(library, twin, model, extended)
            except TwinError:
                refused = _refused(library, twin, model)
                if not refused:
                    raise
        if not refused:
            return library, choice, model, extended
        twice = once & {effect for effect, _ in refused}
        once |= {effect for effect, _ in refused}
        library = _without(library, refused, twice)
        # What the search had not chosen it would not choose once more: another stands in its place.
        forms = [term.scored.form for term in chosen[1].terms]
        again = any((f.effect, f.name) in refused or f.effect in twice for f in forms)
        chosen = None if again else (_without(chosen[0], refused, twice), chosen[1])
    empty = replace(library, candidates=())
    choice = choose(empty)
    model = fit_model(empty, twin, ())
    return empty, choice, model, extended_twin(empty, twin, model)


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


def _beside_wrong_numbers(
    library: Library,
    choice: Choice,
    model: Model,
    extended: Twin,
    twin: Twin,
    taken_for: frozenset[str],
) -> tuple[Library, Choice, Model, Twin]:
    """Leave out effects that are lost in what wrong numbers of the twin's own leave.

    Where all that a simulation lacks is a right number, the joint's small effects are none of the
    mismatch: they stood out of what the refitted twin leaves, which is noise.
    """
    candidates = choice.candidates
    noise_nm = _noise_nm(library, model)
    if candidates and wrong_numbers(
        library, twin, model, candidates, noise_nm, taken_for=taken_for
    ):
        kept = _material(library, choice, twin, beside_wrong_numbers=True)
        if len(kept.terms) < len(choice.terms):
            bare = fit_model(library, twin, kept.terms)
            # Alone, a number may be no more sure than the law that goes: then nothing had a name.
            if kept.terms or _has_a_number(library, twin, bare, taken_for):
                return library, kept, bare, extended_twin(library, twin, bare)
    return library, choice, model, extended


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
