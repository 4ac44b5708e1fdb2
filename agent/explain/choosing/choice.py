"""Which effects a mismatch consists of: one after another, and taken back when no longer needed.

A term enters when shifted residuals hardly ever give as much, when it removes a material share of
the squared error on data that it was not fitted to, and when its gain is no accident of a few
blocks.
Among forms that predict unseen data equally well, the one with fewer numbers stands, and physical
axes stand before time and recording. What predicts as well by another effect is its alternative.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.choosing.candidate import Candidate, Scored
from agent.explain.choosing.entry import Asked, allowed, entered, least_on_all_rows
from agent.explain.choosing.exchanged import exchanged
from agent.explain.choosing.heard import heard
from agent.explain.choosing.materiality import worth
from agent.explain.choosing.preferred import named_by_reach, named_by_width, preferred
from agent.explain.choosing.rivals import DECISIVE, Term, likeness, log_density_gap, with_rivals
from agent.explain.choosing.same_spring import (
    arm_of,
    but_its_waves,
    is_shaken,
    on_one_spring,
    with_their_spring,
)
from agent.explain.choosing.same_wave import told_apart
from agent.explain.choosing.search import Library
from agent.explain.choosing.together import newcomer_beside_moved
from agent.explain.choosing.valleys import deepest
from agent.explain.forms.form import Form
from agent.explain.forms.seen_wave import SHOWN, WAVE
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.usual import usual_blocks
from agent.identify.result import Floats

_MOST_TERMS = 6
_MOST_ASKED = 4  # effects for a place in the model
_COPY = 0.5  # of a refused effect's torque: what makes so much of it is the same


@dataclass(frozen=True)
class Choice:
    """The terms of a model, and the squared errors on unseen data without and with them.

    Once `settled`, every term was ranked beside all the others and knows its rivals.
    """

    terms: tuple[Term, ...]
    plain: Floats
    full: Floats
    settled: bool = False

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """Return the terms' columns."""
        return tuple(term.candidate for term in self.terms)


def choose(
    library: Library,
    *,
    rivals: bool = True,
    begun: Sequence[Term] = (),
    until: Callable[[Library, Form, Sequence[Candidate]], bool] | None = None,
    held: bool = False,
) -> Choice:
    """Choose the effects that a library's target consists of.

    Parameters
    ----------
    library : Library
    rivals : bool
        Whether to look for what could stand in each term's place as well.
    begun : sequence of Term
        What is in the model already, of this library.
    until : callable, optional
        (library, form that has entered, model) to whether all else is to be looked for in another
        library.
    held : bool
        Whether what is in the model already is taken back only when nothing else enters.
    """
    plain = library.errors([])
    chosen = list(begun)
    kept = frozenset(term.scored.form for term in begun) if held else frozenset()
    current = library.errors([t.candidate for t in chosen]) if begun else plain
    been: list[Counter[Form]] = []
    while len(chosen) < _MOST_TERMS and _forms(chosen) not in been:
        been.append(_forms(chosen))
        terms = [t.candidate for t in chosen]
        least = least_on_all_rows(library, terms, plain, current)
        all_ranked = library.rank(terms, least=least)
        ranked = allowed(all_ranked, chosen)
        best = preferred(library, ranked, float(current.sum()))
        least_left = float(current.sum()) if best is None else best.error
        asked = Asked.of(library, plain, terms)
        better = exchanged(library, chosen, current, all_ranked, least_left, asked)
        if better is not None:
            chosen = better
            current = library.errors([t.candidate for t in chosen])
            continue
        found = _newcomer(library, plain, chosen, current, ranked, best)
        if found is None:
            sprung = with_their_spring(library, chosen, current)
            if sprung is None:
                break
            chosen, current = sprung
            continue
        (moved, best, accident), asked = found
        best = deepest(library, [t.candidate for t in moved], best, far=True)
        chosen = [*moved, Term(best, accident)]  # they stay where they were beside one refused
        current = best.blocks
        chosen, current = _pruned(library, chosen, asked, kept)
        if until is not None and until(library, best.form, [t.candidate for t in chosen]):
            break
    if held and chosen:
        asked = Asked.of(library, plain, [term.candidate for term in chosen])
        chosen, current = _pruned(library, chosen, asked)
    if rivals:
        chosen, current = settled(library, chosen)
    return Choice(tuple(chosen), plain, current, settled=rivals)


def decided(library: Library, choice: Choice, other: Choice) -> bool:
    """Return whether a choice predicts unseen data so much better that the other is out."""
    size = effective_size(library.scene.table, library.weighing, library.residual(other.candidates))
    return log_density_gap(choice.full, other.full, size) >= DECISIVE


def _newcomer(
    library: Library,
    plain: Floats,
    chosen: Sequence[Term],
    current: Floats,
    ranked: Sequence[Scored],
    best: Scored | None,
) -> tuple[tuple[list[Term], Scored, float], Asked] | None:
    """Return the terms, the newcomer and its chance, and what was asked of it; None for none.

    The largest may be an accident by itself, as what few blocks pass, and none beside what comes
    next: others are asked in its place, as long as they are worth a name. Not what copies it, which
    is the same accident by another name.
    """
    beside = [term.candidate for term in chosen]
    for _ in range(_MOST_ASKED):
        if best is None:
            break
        moved, newcomer = newcomer_beside_moved(library, chosen, ranked, best)
        asked = Asked.of(library, plain, [*(t.candidate for t in moved), newcomer.candidate])
        found = entered(library, plain, moved, current, ranked, newcomer, asked)
        if found is not None:
            return found, asked
        if worth(current, newcomer.blocks, *asked) < 0.0:
            break
        refused = {best.form.effect, newcomer.form.effect}
        others = (s for s in ranked if s.form.effect not in refused)
        ranked = [s for s in others if likeness(library, beside, best, s) < _COPY]
        best = preferred(library, ranked, float(current.sum()))
    return None


def _forms(terms: Sequence[Term]) -> Counter[Form]:
    """Return the terms' laws: a search that comes back to the same ones has gone in a circle.

    Where each fold of a newcomer may choose a point of its own, it is worth more than where it
    stands at one: it would enter and be taken back without an end.
    """
    return Counter(term.scored.form for term in terms)


def _pruned(
    library: Library, chosen: list[Term], asked: Asked, kept: Container[Form] = frozenset()
) -> tuple[list[Term], Floats]:
    """Take back every term that the others have made immaterial, but for what is kept.

    And but for a soft gear whose spring a wave beside it says as well, however small its part.
    """
    while True:
        whole = library.errors([t.candidate for t in chosen])
        if len(chosen) < 2:
            return chosen, whole
        losses = []
        for i, term in enumerate(chosen):
            others = [t.candidate for j, t in enumerate(chosen) if j != i]
            needed = 0.0 if heard(library.scene, term.scored.form) else asked.gain
            loss = worth(library.errors(others), whole, needed, asked.noise)
            stays = term.scored.form in kept or is_shaken(term.candidate, others)
            losses.append(max(loss, 0.0) if stays else loss)
        weakest = int(np.argmin(losses))
        if losses[weakest] >= 0.0:
            return chosen, whole
        del chosen[weakest]


def _special_cases(library: Library, found: Candidate) -> list[Candidate]:
    """Return simpler forms of the same effect at the numbers that they share with a found one.

    Their own searches may have ended in a worse valley: a spring that hardly stiffens is one.
    """
    numbers = dict(zip(found.form.nonlinear, found.point, strict=True))
    forms = {c.form for c in library.candidates if c.form.refined_by(found.form)}
    shared = sorted((f for f in forms if numbers.keys() >= set(f.nonlinear)), key=lambda f: f.name)
    return [library.candidate(f, tuple(numbers[n] for n in f.nonlinear)) for f in shared]


def settled(library: Library, chosen: list[Term]) -> tuple[list[Term], Floats]:
    """Rank every term once more beside all the others, and note what could stand in its place.

    Its own search begins where the last one ended as well: a grid need not lead there again.
    """
    further = not usual_blocks(library.scene.table, library.weighing).all()
    for i in range(len(chosen)):
        others = [t.candidate for j, t in enumerate(chosen) if j != i]
        known = [chosen[i].candidate, *_special_cases(library, chosen[i].candidate)]
        arm = arm_of(library, [t.candidate for t in chosen])
        ranked = on_one_spring(library, others, library.rank(others, known=known), arm)
        ranked = but_its_waves(chosen[i].candidate, others, ranked)
        ranked = allowed(ranked, [t for j, t in enumerate(chosen) if j != i])
        if further:
            # More of the same by another name, where only the later recordings have been.
            there = chosen[i].scored.form.effect
            ranked = [s for s in ranked if there not in s.form.contains]
        if heard(library.scene, chosen[i].scored.form):
            # Nothing else gives blows: no other effect stands in its place.
            ranked = [s for s in ranked if heard(library.scene, s.form)]
        if chosen[i].scored.form is WAVE:
            ranked = [s for s in ranked if s.form.effect in SHOWN]
        without = float(library.errors(others).sum())
        best = preferred(library, ranked, without)
        if best is not None:
            best = named_by_width(library, ranked, best)
            best = named_by_reach(library, ranked, best, without)
            alike = told_apart(library, others, ranked, arm)
            if best.form.effect in alike:
                first = next(iter(alike))
                best = next(s for s in ranked if s.form.effect == first)
            best = deepest(library, others, best)
            chosen[i] = with_rivals(library, others, ranked, best, chosen[i].chance, alike)
    whole = library.errors([t.candidate for t in chosen])
    return chosen, whole
