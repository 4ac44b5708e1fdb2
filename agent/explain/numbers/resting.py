"""Laws that rest on the twin's own numbers, taken again at the numbers found beside them.

A load is made of inertia and gravity, a reversal's spring yields at the Coulomb level. The search
takes these from the twin's refitted structure, which the missing physics has bent; what that does
to such a law's own numbers is undone here, once the model is known. Where the bent numbers would
predict another torque, everything is ranked again; where they only make a law's number another one,
as an inertia 6 % low makes a misread angle 6 % too large, the law alone is taken at the new ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.choice import Choice, settled
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.numbers.in_step import late_beside
from agent.explain.numbers.polish import polished
from agent.explain.numbers.renewed import retaken
from agent.explain.numbers.whole import (
    ageing_beside,
    grown,
    held_beside,
    known_beside,
    sliding_beside,
    yields_beside,
)
from agent.explain.rows.evidence import solve
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_ROUNDS = 2
_MOVED = 0.02  # of the predicted torque: less changes no law that is made of it
_SAME = 0.002  # of what a law adds: less makes none of its numbers another one
_ARM_ALONE = ("arm_inertia_kg_m2",)  # the numbers of an arm's law, but for what it swings by
_LEAST_ARM = 0.05  # of the inertia
_BEARS_A_LOAD = frozenset(
    {
        "kinematic-error",
        "resolver-error",  # bears none, but its rival does
        "load-dependent-friction",
        "joint-flexibility",
        "backlash",
    }
)


def settled_beside(library: Library, choice: Choice) -> tuple[Library, Choice]:
    """Settle a choice with every law that rests on own numbers at the model's numbers.

    Parameters
    ----------
    library : Library
        With the refitted twin's numbers.
    choice : Choice
        Not settled yet.

    Returns
    -------
    library : Library
        The same where no term rests on own numbers, or these hardly moved.
    choice : Choice
        Settled, with what could stand in each term's place as well.
    """
    for _ in range(_ROUNDS):
        before, theta = library.scene, library.scene.theta
        held = before.held
        if any(term.scored.form.rests_on_numbers for term in choice.terms):
            theta = numbers_beside(library, choice.candidates)
        if any(term.scored.form.effect in _BEARS_A_LOAD for term in choice.terms):
            held = held_beside(library, choice.candidates)
        scene = replace(
            library.scene,
            held=held,
            beside=known_beside(library, choice.candidates),
            sliding=sliding_beside(library, choice.candidates),
            ageing=ageing_beside(library, choice.candidates),
            yields_rad=yields_beside(choice.candidates),
        )
        if moved_far(library, theta) or grown(library.scene, scene):
            library = taken_at(replace(library, scene=scene), theta)
        elif choice.settled:
            break
        terms = [retaken(library, term, before) for term in choice.terms]
        chosen, full = settled(library, terms)
        choice = replace(choice, terms=tuple(chosen), full=full, settled=True)
        together = polished(library, choice)
        # Where one law takes over what another stands for, that one goes below zero.
        if is_possible(library, together.candidates) or not is_possible(library, choice.candidates):
            choice = together
    return at_own_numbers(*late_beside(library, choice))


def at_own_numbers(library: Library, choice: Choice) -> tuple[Library, Choice]:
    """Return a model whose laws rest on the twin's numbers as the model itself has them.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.

    Returns
    -------
    library : Library
        With those numbers from now on; its candidates stay as they were made.
    choice : Choice
        The same effects, and rivals as they were ranked.
    """
    for _ in range(_ROUNDS):
        if not any(term.scored.form.rests_on_numbers for term in choice.terms):
            break
        theta = numbers_beside(library, choice.candidates)
        if not (theta[:3] >= 0.0).all():
            break
        share = arm_share_beside(library, choice.candidates)
        scene = replace(library.scene, theta=theta, arm_share=share, closely=True)
        again = on_scene(library, scene)
        terms = tuple(retaken(again, term, library.scene) for term in choice.terms)
        if all(map(_same, choice.terms, terms)):
            break
        moved = polished(again, replace(choice, terms=terms))
        if not is_possible(again, moved.candidates):
            break
        library, choice = again, moved
    return library, choice


def _same(before: Term, after: Term) -> bool:
    """Return whether a law adds the torque that it added, to a part of it that no number shows."""
    own = before.scored.coefficients
    was = before.candidate.columns @ own
    shift = after.candidate.columns @ own - was
    return float(shift @ shift) <= _SAME**2 * float(was @ was)


def on_scene(library: Library, scene: Scene) -> Library:
    """Return a library on another scene of the same motion, its candidates as they were made.

    What was asked for of laws that are made of none of the twin's numbers is known there as well,
    and made once more, if it must be, on the scene that it was made on.
    """
    known = {k: c for k, c in library.known.items() if not k[0].rests_on_numbers}
    return replace(library, scene=scene, known=known)


def is_possible(library: Library, terms: Sequence[Candidate]) -> bool:
    """Return whether inertia, viscous and Coulomb friction beside some terms are not below zero."""
    return bool((numbers_beside(library, terms)[:3] >= 0.0).all())


def numbers_beside(library: Library, terms: Sequence[Candidate]) -> Floats:
    """Return the twin's numbers as fitted beside some terms, shape (5,)."""
    columns = library.model(terms)
    moves = solve(columns.T @ columns, columns.T @ library.target)
    theta = library.scene.as_given.copy()
    theta[library.scene.table.carried] += moves[: library.base.shape[1]]
    return theta


def arm_share_beside(library: Library, terms: Sequence[Candidate]) -> float:
    """Return the arm's share of the inertia as fitted with some terms, if one of them is an arm."""
    arms = [at for at, term in enumerate(terms) if term.form.linear == _ARM_ALONE]
    if not arms:
        return library.scene.arm_share
    columns = library.model(terms)
    widths = [library.base.shape[1], *(term.columns.shape[1] for term in terms)]
    at = sum(widths[: arms[0] + 1])
    inertia = float(solve(columns.T @ columns, columns.T @ library.target)[at])
    whole = max(float(numbers_beside(library, terms)[0]), 1e-300)
    return min(max(inertia / whole, _LEAST_ARM), 1.0)


def moved_far(library: Library, theta: Floats) -> bool:
    """Return whether numbers predict another torque than those that the laws were taken at."""
    scene, weighing = library.scene, library.weighing
    before, moved = (
        weighing.weighted(scene.table.base @ numbers)
        for numbers in (scene.theta, theta - scene.theta)
    )
    return float(moved @ moved) > _MOVED**2 * float(before @ before)


def taken_at(library: Library, theta: Floats) -> Library:
    """Return a library whose laws, the same as before, rest on other numbers of the twin."""
    moved = on_scene(library, replace(library.scene, theta=theta))
    points = (
        (c.form, c.form.carried_over(library.scene, moved.scene, c.point))
        for c in library.candidates
    )
    return replace(moved, candidates=tuple(moved.candidate(*point) for point in points))
