"""Friction under a load, and what pulls at the joint: each at the numbers of the other.

The load that a gear bears is made of the twin's weight, of cables and of payloads, and friction
under it of that load. One after the other they are not found: a cable that is taken beside friction
under the weight alone is worse than none, as that friction is where the weight is and not where the
cable pulls, and an offset, a bump and a tight spot stand for both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.choice import Choice, choose, decided
from agent.explain.choosing.rivals import LIKE_A_WEIGHT, Term
from agent.explain.choosing.search import Library
from agent.explain.choosing.together import together
from agent.explain.numbers.resting import is_possible, numbers_beside, on_scene, taken_at
from agent.explain.numbers.whole import held_beside
from agent.explain.rows.scene import Scene

_LOADED = "load-dependent-friction"
_PULLS = frozenset({"cable-force", "gravity-imbalance"})
_STANDS_IN = _PULLS | {*LIKE_A_WEIGHT, "local-fault", "position-dependent-friction"}
_TRIED = 4  # forms of what pulls
_ROUNDS = 5  # of a load and the friction under it; each comes a third as near as the one before


def chosen_under_its_pull(library: Library, choice: Choice) -> tuple[Library, Choice]:
    """Choose anew where friction under a load and what pulls leave less, found together.

    Parameters
    ----------
    library : Library
    choice : Choice
        Not settled yet.

    Returns
    -------
    library, choice
        The same where no friction under a load was chosen, or nothing that could stand for a pull
        beside it; or where a pull in its place predicts unseen data no better.
    """
    effects = [term.scored.form.effect for term in choice.terms]
    if _LOADED not in effects or _STANDS_IN.isdisjoint(effects):
        return library, choice
    kept = [term for term in choice.terms if term.scored.form.effect not in _STANDS_IN]
    settled = _settled(library, choice)
    found = _pulled(library, settled, [term.candidate for term in kept])
    found = found or _pulled(library, settled, _plainer(library, kept))
    if found is None:
        return library, choice
    scene, terms = found
    moved = taken_at(replace(library, scene=scene), scene.theta)
    begun = [
        replace(term, scored=replace(term.scored, candidate=moved.candidate(c.form, c.point)))
        for term, c in zip(kept, terms, strict=True)
    ]
    again = choose(moved, rivals=False, begun=begun)
    return (moved, again) if decided(library, again, settled) else (library, choice)


def _plainer(library: Library, kept: Sequence[Term]) -> list[Candidate]:
    """Return laws with friction in proportion to the load, as a pull bends what it is taken for.

    Beside an offset in a cable's place friction grows with a power of the load that it has not.
    """
    out = []
    for term in kept:
        form, candidate = term.scored.form, term.candidate
        if form.effect == _LOADED and form.refines:
            others = [other.candidate for other in kept if other is not term]
            plain = (c for c in library.candidates if c.form.name in form.refines)
            own = tuple(c for c in plain if c.form.effect == _LOADED)
            ranked = replace(library, candidates=own).rank(others)
            candidate = ranked[0].candidate if ranked else candidate
        out.append(candidate)
    return out


def _settled(library: Library, choice: Choice) -> Choice:
    """Return a choice's errors as its own laws leave them at each other's numbers.

    What was moved together is compared with what was moved together.
    """
    own, terms = _in_each_other(library, choice.candidates)
    full = own.errors(terms)
    return replace(choice, full=full) if full.sum() < choice.full.sum() else choice


def _pulled(
    library: Library, choice: Choice, beside: Sequence[Candidate]
) -> tuple[Scene, list[Candidate]] | None:
    """Return the scene in which something pulls, and the laws beside it at their numbers there.

    None where a pull in the place of all that may stand for it leaves more than they do.
    """
    pulls = tuple(c for c in library.candidates if c.form.effect in _PULLS)
    ranked = replace(library, candidates=pulls).rank(beside)
    least, found = float(choice.full.sum()), None
    for scored in ranked[:_TRIED]:
        own, terms = _in_each_other(library, [*beside, scored.candidate])
        left = float(own.errors(terms).sum())
        if left < least and is_possible(own, terms):
            least, found = left, (own.scene, terms[:-1])
    return found


def _in_each_other(library: Library, terms: Sequence[Candidate]) -> tuple[Library, list[Candidate]]:
    """Return laws that rest on each other's numbers at those to which all of them lead."""
    found = list(terms)
    for _ in range(_ROUNDS):
        theta = numbers_beside(library, found)
        if not (theta[:3] >= 0.0).all():
            break
        before = library.scene
        scene = replace(before, theta=theta, held=held_beside(library, found))
        library = on_scene(library, scene)
        found = [
            library.candidate(c.form, c.form.carried_over(before, scene, c.point)) for c in found
        ]
        found = together(library, found)
    return library, found
