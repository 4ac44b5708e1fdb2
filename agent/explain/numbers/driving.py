"""Friction under load that loads the gear itself, where a heavier arm would do as well.

A gear that loses a share of what it transmits takes more where the motor drives the load than where
the load drives the motor. The mean of both is friction under load; half of their difference turns
with the load, and no motion tells it from a weight (and an inertia) that is larger by so much. The
search has the weight free, and finds a payload, or what looks like one. But a gear's own friction
makes that difference by itself, and of a known size: no more than the friction's square. Where the
twin's weight as given and such a gear leave no more than a weight of any size does, the weight is
taken to be right, and the answer says which payload would do as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from agent.explain.choosing.candidate import Candidate, basis_of
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.materiality import least_gain
from agent.explain.choosing.rivals import LIKE_A_WEIGHT, WEIGHT, Term
from agent.explain.choosing.search import Library
from agent.explain.forms.driving import DRIVING, Driving
from agent.explain.forms.form import Form, Point
from agent.explain.numbers.polish import polished
from agent.explain.numbers.resting import (
    at_own_numbers,
    numbers_beside,
    on_scene,
)
from agent.explain.rows.evidence import solve
from agent.explain.rows.table import BASE
from agent.identify.result import Floats

_LOADED = "load-dependent-friction"
_PULLS = frozenset({WEIGHT, "torque-constant-error", *LIKE_A_WEIGHT})
_ROUNDS, _STEPS = 3, 13
_MOST = 1.15  # of the friction per load: an excess beyond that is none that friction makes
_SURELY = 3.0  # standard errors, as between any two laws
_MISSED, _LITTLE = 0.05, 0.1  # of what the excess gains, and of what is left: less is no loss
_BELOW_ONE = 0.95
_SHARES = (0.0, 0.5, 1.0)  # of the arm's friction, in the load
_NONE = 0.1  # of what there was: so little below zero is none
_WEIGHT_AT = [i for i, name in enumerate(BASE) if name.startswith("gravity")]


@dataclass(frozen=True)
class _Driven:
    """A load's law with its excess, beside a weight as it was given."""

    library: Library
    terms: tuple[Term, ...]
    law: Candidate
    without: Floats  # squared error of every block without the excess, (b,)
    errors: Floats  # and with it


def driving(library: Library, choice: Choice) -> tuple[Library, Choice]:
    """Return a model in which friction loads the gear, if the weight need not be wrong then.

    Parameters
    ----------
    library : Library
        At the numbers of the twin beside the choice.
    choice : Choice
        Settled.

    Returns
    -------
    library : Library
        At the numbers beside what is returned with it.
    choice : Choice
        Friction under load with its excess, and no pull that it makes up for; the very same where
        there is no such friction, or where the weight as given leaves more.
    """
    if not library.scene.as_given[_WEIGHT_AT].any():
        return library, choice
    law = next((t for t in choice.terms if _has_an_excess(t.scored.form)), None)
    if law is None:
        return library, choice
    for apart in _apart(choice.terms, law):
        for plain in _plain_points(library, law):
            others = tuple(t for t in choice.terms if t is not law and t not in apart)
            found = _driven(library, plain, others)
            if found is None or not _does(found, library, choice):
                continue
            ours = _asked_with_it(library, found)
            scored = replace(law.scored, candidate=found.law, coefficients=_own(ours, found))
            terms = tuple(
                replace(law, scored=scored) if t is law else t
                for t in choice.terms
                if t not in apart
            )
            ours, moved = at_own_numbers(ours, polished(ours, replace(choice, terms=terms)))
            if _is_a_joint(ours, moved.candidates) and all(map(_is_allowed, moved.terms)):
                return ours, moved
    return library, choice


def _has_an_excess(form: Form) -> bool:
    return form.effect == _LOADED and form.name in DRIVING


def _is_allowed(term: Term) -> bool:
    return term.scored.form.allows(term.scored.coefficients)


def _plain_points(library: Library, law: Term) -> list[Candidate]:
    """Return a law's own point, and the same of the special case that needs no sliding part."""
    own = law.candidate
    less = [
        c.form
        for c in library.candidates
        if c.form.nonlinear == own.form.nonlinear and c.form.refined_by(own.form)
    ]
    return [own, *(library.candidate(form, own.point) for form in dict.fromkeys(less))]


def _apart(terms: Sequence[Term], law: Term) -> list[tuple[Term, ...]]:
    """Return which other terms such a gear may make up for: all, pulls, fewer of them, none."""
    others = [t for t in terms if t is not law]
    pulls = [t for t in others if t.scored.form.effect in _PULLS]
    some = [few for n in range(len(pulls), -1, -1) for few in combinations(pulls, n)]
    return [tuple(others), *some] if len(others) > len(pulls) else some


def _driven(library: Library, law: Candidate, others: tuple[Term, ...]) -> _Driven | None:
    """Return the best law with an excess beside others, at a weight as given; None without one."""
    driving = DRIVING[law.form.name]
    scene = library.scene
    theta = scene.theta.copy()
    theta[_WEIGHT_AT] = scene.as_given[_WEIGHT_AT]
    ours = on_scene(library, replace(scene, theta=theta))
    held = _rest(ours, [t.candidate for t in others])
    basis = basis_of(held)
    left = ours.target - basis @ (basis.T @ ours.target)
    best = _candidate(ours, driving, driving.begun(law.point))
    without = ours.errors_with(held, best.columns)
    error = math.inf
    for _ in range(_ROUNDS):
        tried = _tried(ours, driving, held, best)
        found = min(tried, key=lambda c: float(ours.errors_with(held, c.columns).sum()))
        points = _points(library, driving, found)
        grid = tuple(replace(found, point=point) for point in points)  # how far apart they are
        found = replace(ours, candidates=grid).deeper(found, basis, left)
        now = float(ours.errors_with(held, found.columns).sum())
        if now >= error:
            break
        best, error = found, now
    if best.point[-1] <= 0.0:
        return None
    errors = ours.errors_with(held, best.columns)
    return _Driven(ours, others, best, without, errors)


def _points(library: Library, driving: Driving, best: Candidate) -> list[Point]:
    """Return the plain form's grid with a law's own excess."""
    more = len(best.point) - len(driving.plain.nonlinear)
    own = best.point[-more:]
    beside = [(share, *own[1:]) for share in _SHARES] if driving.falls else [own]
    plain = (c.point for c in library.candidates if c.form is driving.plain)
    return [(*point, *each) for point in plain for each in beside]


def _asked_with_it(library: Library, found: _Driven) -> Library:
    """Return a library in which whatever is asked of such a load is asked with its excess."""
    driving = next(d for d in DRIVING.values() if d.form is found.law.form)
    kept = [c for c in library.candidates if c.form is not driving.plain]
    points = _points(library, driving, found.law)
    grid = (_candidate(found.library, driving, point) for point in points)
    return replace(found.library, candidates=(*kept, *grid))


def _rest(library: Library, others: Sequence[Candidate]) -> Floats:
    """Return the columns of all but the weight, shape (m, p)."""
    carried = np.flatnonzero(library.scene.table.carried).tolist()
    base = library.base_beside(others)
    kept = [i for i, at in enumerate(carried) if at not in _WEIGHT_AT]
    return np.concatenate([base[:, kept], *(c.columns for c in others)], axis=1)


def _tried(library: Library, driving: Driving, held: Floats, best: Candidate) -> list[Candidate]:
    """Return a law with other excesses: up to what the friction itself makes of them."""
    columns = np.concatenate((held, best.columns), axis=1)
    own = solve(columns.T @ columns, columns.T @ library.target)[held.shape[1] :]
    own = np.maximum(own, 0.0)
    most = min(_MOST * float(own.sum()), _BELOW_ONE)
    points = [driving.at(best.point, float(e), own) for e in np.linspace(0.0, most, _STEPS)]
    return [_candidate(library, driving, point) for point in points]


def _candidate(library: Library, driving: Driving, point: Point) -> Candidate:
    return Candidate.of(driving.form, point, library.columns(driving.form, point))


def _own(library: Library, found: _Driven) -> Floats:
    """Return the law's coefficients beside the others, all numbers free, shape (k,)."""
    columns = library.model([*(t.candidate for t in found.terms), found.law])
    width = found.law.columns.shape[1]
    return np.asarray(solve(columns.T @ columns, columns.T @ library.target)[-width:])


def _does(found: _Driven, library: Library, choice: Choice) -> bool:
    """Return whether a weight as given, and the excess, leave no more than the model does."""
    now = library.errors(choice.candidates)
    gained = float((found.without - found.errors).sum())
    if gained < least_gain(library, choice.plain, choice.candidates):
        return False
    loss = found.errors - now
    chance = _SURELY * float(np.std(loss)) * math.sqrt(loss.shape[0])
    terms = [*(t.candidate for t in found.terms), found.law]
    missed = min(_MISSED * gained, _LITTLE * float(now.sum()))
    return float(loss.sum()) <= max(chance, missed) and _is_a_joint(found.library, terms)


def _is_a_joint(library: Library, terms: Sequence[Candidate]) -> bool:
    """Return whether inertia and friction beside some terms are not clearly below zero.

    Where all dry friction is the load's, or all that grows with speed, none is left beside it.
    """
    usual = np.maximum(library.scene.as_given, library.scene.theta)
    return bool((numbers_beside(library, terms)[:3] >= -_NONE * usual[:3]).all())
