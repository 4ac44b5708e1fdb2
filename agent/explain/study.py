"""Everything that a verdict is drawn from: the mismatch located, named and modelled."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Cell, Floor
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library
from agent.explain.forms.arm_encoder import seen_by_the_arm
from agent.explain.forms.balancer import BALANCERS, COIL
from agent.explain.forms.form import Form
from agent.explain.forms.library import judgeable
from agent.explain.left import Left
from agent.explain.location.deficiency import deficiency_map
from agent.explain.named import Named, beside_wrong_numbers, named
from agent.explain.numbers.alike import off_alike
from agent.explain.numbers.balanced import spring_does_without
from agent.explain.numbers.borne_out import below_zero, borne_out
from agent.explain.numbers.held_weight import is_usual
from agent.explain.numbers.hidden import reaching_over_the_unnamed
from agent.explain.numbers.instead import with_a_ripple_instead, with_laws_instead
from agent.explain.numbers.intervals import with_intervals
from agent.explain.numbers.model import Model, extended_twin, fit_model
from agent.explain.numbers.short_stroke import (
    PAYLOAD,
    gravity_in_question,
    in_its_place,
    in_question,
    is_the_factors_weight,
    pulls,
    weight_is_worth_a_name,
    without_gravity,
)
from agent.explain.numbers.typical import at_typical
from agent.explain.numbers.unshaken import unshaken
from agent.explain.numbers.wrong import WrongNumber, factor_of, told_again, wrong_numbers
from agent.explain.rows.evidence import weigh
from agent.explain.rows.floor import noise_floor
from agent.explain.rows.lines import Line, lines_of
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, Table, without_edges
from agent.explain.rows.usual import usual_blocks
from agent.identify.result import Floats, Parameter
from agent.physics.twin import Twin

_LESS = 0.95  # of the mean square: what two answers share is noise


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
    denied : bool
        Whether laws were taken back beside which a part of the mismatch had no name, either.
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
    denied: bool = False

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
    found = named(library, twin)
    if by_spring and not any(t.scored.form in BALANCERS for t in found.choice.terms):
        # The weight was held for a spring that is not there: it is asked about without one.
        library, not_judged, refitted, _ = _library(twin, table, among, ask=ask, springs=False)
        found = named(library, twin)
    taken_for: frozenset[str] = frozenset()
    if in_question(library) and not in_its_place(found.library, found.choice):
        if not weight_is_worth_a_name(library):
            taken_for = frozenset({PAYLOAD.effect})
        library, not_judged, refitted, _ = _library(twin, table, among, ask=False)
        found = named(library, twin)
    elif in_question(library) and (len(found.choice.terms) > 1 or pulls(found.choice)):
        # A cable may have copied a weight and a part of another law, or of an offset, greedily.
        carried = _library(twin, table, among, ask=False)
        again = named(carried[0], twin)
        if _does_better(again, found, twin):
            library, not_judged, refitted, _ = carried
            found = again
    cells = deficiency_map(library, lines=lines)
    found = beside_wrong_numbers(found, twin, taken_for)
    library, choice, extended = found.library, found.choice, found.extended
    table, model = library.scene.table, with_intervals(library, found.model)
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
    numbers = with_a_ripple_instead(numbers, twin)
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


def _does_better(carried: Named, asked: Named, twin: Twin) -> bool:
    """Return whether a weight among the numbers does with fewer laws, and surely leaves less.

    A weight that is off by no more than a twin's usually is counts for none: where a cable was
    found and none is left beside it, as many laws that leave no more will do.
    """
    laws, theirs = len(carried.choice.terms), len(asked.choice.terms)
    left, leaves = (float(np.mean(each.model.residual_nm**2)) for each in (carried, asked))
    if pulls(asked.choice) and not pulls(carried.choice) and is_usual(twin, carried.model):
        return laws <= theirs and left <= leaves
    return laws < theirs and left < _LESS * leaves


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
