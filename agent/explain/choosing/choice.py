"""Which effects a mismatch consists of: one after another, and taken back when no longer needed.

A term enters when shifted residuals hardly ever give as much, when it removes a material share of
the squared error on data that it was not fitted to, and when its gain is no accident of a few
blocks.
Among forms that predict unseen data equally well, the one with fewer numbers stands, and physical
axes stand before time and recording. What predicts as well by another effect is its alternative.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.choosing.candidate import Candidate, Scored
from agent.explain.choosing.heard import LIKE_A_GAP, heard
from agent.explain.choosing.materiality import MATERIAL, least_gain, noise_energy, worth
from agent.explain.choosing.rivals import DECISIVE, Term, log_density_gap, with_rivals
from agent.explain.choosing.same_wave import told_apart
from agent.explain.choosing.search import Library
from agent.explain.choosing.shifts import chance
from agent.explain.choosing.together import newcomer_beside_moved
from agent.explain.choosing.valleys import deepest
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.usual import as_usual, usual_blocks
from agent.identify.result import Floats
from agent.physics.effects.library import CARRIED

_ACCIDENT = 0.01
_MOST_TERMS = 6
_OF_ITS_OWN = 0.1  # of the mismatch: so much more makes a newcomer an effect, whatever it copies
_SHARED_OUT = 0.2  # of what a term had removed: so little is left to it beside a newcomer
_SAME = 0.1  # of log density: columns that copy each other differ by no more
_HEARD = 0.5  # of the gain: what resembles a gap explains that much more where there is none
_AS_MUCH = 0.01  # of the gain: what a special case misses of it is small, however significant
_REPEATED = frozenset(
    {"torque-ripple", "kinematic-error", "position-dependent-friction", "local-fault"}
)


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


def choose(library: Library, *, rivals: bool = True, begun: Sequence[Term] = ()) -> Choice:
    """Choose the effects that a library's target consists of.

    Parameters
    ----------
    library : Library
    rivals : bool
        Whether to look for what could stand in each term's place as well.
    begun : sequence of Term
        What is in the model already, of this library.
    """
    plain = library.errors([])
    chosen = list(begun)
    current = library.errors([t.candidate for t in chosen]) if begun else plain
    while len(chosen) < _MOST_TERMS:
        terms = [t.candidate for t in chosen]
        least = _least_on_all_rows(library, terms, plain, current)
        ranked = _allowed(library.rank(terms, least=least), chosen)
        best = _preferred(library, ranked, float(current.sum()))
        if best is None:
            break
        moved, best = newcomer_beside_moved(library, chosen, ranked, best)
        terms = [t.candidate for t in moved]
        whole = [*terms, best.candidate]
        material, noise = least_gain(library, plain, whole), noise_energy(library, whole)
        best = _newcomer(library, ranked, best, current, material, noise)
        if best is None:
            break
        if not _steady(current, best.blocks):
            break
        accident = chance(library, terms, best)
        if accident > _ACCIDENT:
            break
        if _twice(library, plain, moved, current, best):
            break
        best = deepest(library, [t.candidate for t in moved], best, far=True)
        chosen = [*moved, Term(best, accident)]  # they stay where they were beside one refused
        current = best.blocks
        chosen, current = _pruned(library, chosen, material, noise)
    if rivals:
        chosen, current = settled(library, chosen)
    return Choice(tuple(chosen), plain, current, settled=rivals)


def _newcomer(
    library: Library,
    ranked: Sequence[Scored],
    best: Scored,
    current: Floats,
    material: float,
    noise: float,
) -> Scored | None:
    """Return the next term: the best one if it is material, or a gap whose blows are heard.

    Such a gap stands before what it looks like within the band, unless that explains far more.
    """
    without = float(current.sum())
    gain = without - best.error
    named = worth(current, best.blocks, material, noise) >= 0.0
    gap = next((s for s in ranked if heard(library.scene, s.form) and s.error < without), None)
    if gap is not None:
        instead = not named or best.form.effect in LIKE_A_GAP
        if instead and without - gap.error > _HEARD * gain:
            return gap
    return best if named else None


def _least_on_all_rows(
    library: Library, terms: Sequence[Candidate], plain: Floats, current: Floats
) -> float:
    """Return what a form must at least remove of the residual on all rows to be material.

    No fit removes more of unseen data than of the rows that it was made to: what the model loses
    from these to those, a form beside it may give back, and no more.
    """
    left = library.residual(terms)
    mismatch = as_usual(library.scene.table, library.weighing, plain)
    return MATERIAL * mismatch - (float(current.sum()) - float(left @ left))


def _allowed(ranked: Sequence[Scored], chosen: Sequence[Term]) -> list[Scored]:
    """Leave out effects that are there already, but for those that may come at several places.

    A joint has one arm: where a spring or a gap carries it, the other cannot carry it again.
    """
    there = {t.scored.form.effect for t in chosen}
    if not there.isdisjoint(CARRIED):
        there.update(CARRIED)
    return [s for s in ranked if s.form.effect not in there or s.form.effect in _REPEATED]


def _twice(
    library: Library, plain: Floats, chosen: Sequence[Term], current: Floats, best: Scored
) -> bool:
    """Return whether a weak newcomer only shares out what a term explains already.

    Where it adds little, and one of the terms could nearly be done without beside it, two names
    would stand for one mismatch, whose shape neither has to the last percent.
    """
    if float(current.sum()) - best.error >= _OF_ITS_OWN * float(plain.sum()):
        return False
    for index in range(len(chosen)):
        others = [t.candidate for i, t in enumerate(chosen) if i != index]
        before = float(library.errors(others).sum() - current.sum())
        beside = float(library.errors([*others, best.candidate]).sum()) - best.error
        if beside < _SHARED_OUT * before:
            return True
    return False


def _steady(before: Floats, after: Floats) -> bool:
    """Return whether a gain is more than two standard errors over the blocks, shape (b,).

    As squared error, or in proportion to what each block had: where a slow pass lingers at a bump,
    three blocks may hold nine tenths of the squared error, and all others that pass it agree.
    """
    gain = before - after
    return any(
        float(each.sum()) > 2.0 * float(np.std(each)) * math.sqrt(each.shape[0])
        for each in (gain, gain / np.maximum(np.maximum(before, after), 1e-300))
    )


def _preferred(library: Library, ranked: Sequence[Scored], without: float) -> Scored | None:
    """Return the simplest candidate that is not clearly worse than the best on unseen data.

    Parameters
    ----------
    library : Library
    ranked : sequence of Scored
    without : float
        Squared error on unseen data without any of them.
    """
    if not ranked:
        return None
    best = ranked[0]
    size = effective_size(library.scene.table, library.weighing, library.residual([best.candidate]))
    close = []
    for scored in ranked:
        loss = scored.blocks - best.blocks
        error = float(np.std(loss)) * math.sqrt(loss.shape[0])
        behind = log_density_gap(library, best.blocks, scored.blocks, size)
        missed = float(loss.sum()) / max(without - best.error, 1e-300)
        special = (behind < DECISIVE and scored.form.refined_by(best.form)) or (
            scored.form.effect in best.form.contains and (behind < DECISIVE or missed < _AS_MUCH)
        )
        if behind < _SAME or special or (float(loss.sum()) <= error and behind < 2.0 * DECISIVE):
            close.append(scored)
    # Of laws as simple, the one whose effect can explain most: by its other forms, too.
    of_effect: dict[str, float] = {}
    for scored in ranked:
        of_effect.setdefault(scored.form.effect, scored.error)
    return min(
        close,
        key=lambda s: (s.form.catch_all, s.form.size, of_effect[s.form.effect], s.error),
        default=best,
    )


def _pruned(
    library: Library, chosen: list[Term], material: float, noise: float
) -> tuple[list[Term], Floats]:
    """Take back every term that the others have made immaterial."""
    while True:
        whole = library.errors([t.candidate for t in chosen])
        if len(chosen) < 2:
            return chosen, whole
        losses = []
        for i, term in enumerate(chosen):
            without = library.errors([t.candidate for j, t in enumerate(chosen) if j != i])
            needed = 0.0 if heard(library.scene, term.scored.form) else material
            losses.append(worth(without, whole, needed, noise))
        weakest = int(np.argmin(losses))
        if losses[weakest] >= 0.0:
            return chosen, whole
        del chosen[weakest]


def settled(library: Library, chosen: list[Term]) -> tuple[list[Term], Floats]:
    """Rank every term once more beside all the others, and note what could stand in its place.

    Its own search begins where the last one ended as well: a grid need not lead there again.
    """
    further = not usual_blocks(library.scene.table, library.weighing).all()
    for i in range(len(chosen)):
        others = [t.candidate for j, t in enumerate(chosen) if j != i]
        ranked = library.rank(others, known=[chosen[i].candidate])
        ranked = _allowed(ranked, [t for j, t in enumerate(chosen) if j != i])
        if further:
            # More of the same by another name, where only the later recordings have been.
            there = chosen[i].scored.form.effect
            ranked = [s for s in ranked if there not in s.form.contains]
        if heard(library.scene, chosen[i].scored.form):
            # Nothing else gives blows: no other effect stands in its place.
            ranked = [s for s in ranked if heard(library.scene, s.form)]
        best = _preferred(library, ranked, float(library.errors(others).sum()))
        if best is not None:
            alike = told_apart(library, others, ranked)
            if best.form.effect in alike:
                first = next(iter(alike))
                best = next(s for s in ranked if s.form.effect == first)
            best = deepest(library, others, best)
            chosen[i] = with_rivals(library, others, ranked, best, chosen[i].chance, alike)
    whole = library.errors([t.candidate for t in chosen])
    return chosen, whole
