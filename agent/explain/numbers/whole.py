"""What a model's effects add to the twin's torque, for the laws that are made of all of it.

A drive that reports its torque late, or clips it, does so with the whole: with what a soft gear or
a cable adds as well. A delay taken from the twin's own torque alone leaves these on time, and bends
their numbers for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.choosing.candidate import Candidate, Known, Together
from agent.explain.choosing.search import Library
from agent.explain.forms.reversal import reach_rad
from agent.explain.rows.ageing import Ageing
from agent.explain.rows.evidence import solve
from agent.explain.rows.scene import Scene
from agent.physics.effects import SLIDING, YIELDING

AGES = "friction-drift"
"""The effect by which time and use change the dry friction, the arm's as well."""

_REPORTED = frozenset({"measurement-delay", "torque-saturation"})
_HOLDS_THE_ARM = frozenset({"cable-force", "gravity-imbalance", "local-fault"})
RUBS = frozenset({"rubbing", "rubbing of another shape", "rubbing, every turn"})
"""Forms of friction at a place: the laws of a load ask for theirs themselves."""

_MOVED = 0.02  # of what is added: less changes no law that is made of it


def known_beside(library: Library, terms: Sequence[Candidate]) -> tuple[Known, ...]:
    """Return the terms that act on the joint, where another acts on what the drive reports."""
    known = _known(library, terms)
    acting = tuple(k for k in known if k.candidate.form.effect not in _REPORTED)
    return acting if len(acting) < len(known) else ()


def _known(library: Library, terms: Sequence[Candidate]) -> tuple[Known, ...]:
    """Return terms with the numbers that they have beside each other."""
    columns = library.model(terms)
    theta = solve(columns.T @ columns, columns.T @ library.target)
    start, known = library.base.shape[1], []
    for term in terms:
        stop = start + term.columns.shape[1]
        known.append(Known(term, theta[start:stop]))
        start = stop
    return tuple(known)


def sliding_beside(library: Library, terms: Sequence[Candidate]) -> tuple[Known, ...]:
    """Return the terms of sliding friction, where another says how all of it yields."""
    if not any(term.form.effect == YIELDING for term in terms):
        return ()
    return tuple(k for k in _known(library, terms) if k.candidate.form.effect in SLIDING)


def ageing_beside(library: Library, terms: Sequence[Candidate]) -> tuple[Ageing, ...]:
    """Return the terms by which time or use change the dry friction, their dry part alone."""
    if not any(term.form.effect == AGES for term in terms):
        return ()
    ageing = (k for k in _known(library, terms) if k.candidate.form.effect == AGES)
    return tuple(_dry_part(known) for known in ageing)


def _dry_part(known: Known) -> Ageing:
    form = known.candidate.form
    is_dry = np.array([float(not name.startswith("viscous")) for name in form.linear])
    dry = replace(known, coefficients=known.coefficients * is_dry)
    values = {n: float(c) for n, c in zip(form.linear, dry.coefficients, strict=True)}
    values |= {n: float(c) for n, c in zip(form.nonlinear, known.candidate.point, strict=True)}
    return Ageing(form.effect, dry, lambda scene: form.to_twin(scene, values))


def yields_beside(terms: Sequence[Candidate]) -> float:
    """Return over which travel some terms say that friction yields, rad; 0 where none says it."""
    found = (reach_rad(term.form, term.point) for term in terms if term.form.effect == YIELDING)
    return next(found, 0.0)


def held_beside(library: Library, terms: Sequence[Candidate]) -> Together | None:
    """Return the torque of the terms that the arm is held against; None without such terms."""
    holding = tuple(
        k
        for k in _known(library, terms)
        if k.candidate.form.effect in _HOLDS_THE_ARM and k.candidate.form.name not in RUBS
    )
    return Together(holding) if holding else None


def grown(scene: Scene, now: Scene) -> bool:
    """Return whether effects add another torque than the laws of the whole were taken at."""
    if bool(scene.beside) != bool(now.beside) or bool(scene.sliding) != bool(now.sliding):
        return True
    if bool(scene.ageing) != bool(now.ageing) or scene.yields_rad != now.yields_rad:
        return True
    if (scene.held is None) != (now.held is None):
        return True
    pairs = [(scene.beside_nm, now.beside_nm)] if now.beside else []
    pairs += [(scene.weight_nm, now.weight_nm)] if now.held is not None else []
    pairs += [(scene.level_share, now.level_share)] if now.sliding else []
    pairs += [(scene.worn_share, now.worn_share)] if now.ageing else []
    return any(float((b - a) @ (b - a)) > _MOVED**2 * float(a @ a) for a, b in pairs)
