"""Friction that differs in one band of speeds: no law has a name for it, and none may copy it.

Oil that is churned, or a seal that lifts, changes friction between two speeds and leaves it as it
was below and above. Two falls and a bend copy that in part: a Stribeck law with its highest
friction below the band, a power law with the line beyond. What a Stribeck law has friction fall
from, it has at rest; what differs in a band has come back to the line of Coulomb and viscous
friction before the slowest speed and before the fastest. Where the recordings show that, by what
would decide between two names, no law of the speed has one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from agent.explain.choosing.candidate import Candidate, basis_of, gain_of
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library
from agent.explain.forms.form import Form, Point, stack
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_OF_SPEED = frozenset({"stribeck", "viscous-nonlinear"})
_MIDDLES = np.geomspace(0.08, 0.75, 16)  # of the fastest speed
_WIDTHS = (0.15, 0.22, 0.32, 0.45, 0.65)  # of the middle: a tenth is left at rest of the widest
_OVER = 1.5  # widths: so far from the middle a tenth is left, and that far must have been driven
_MISSED = 0.05  # of the band's gain: no law's form is more exact
_SURELY = 3.0  # standard errors over the blocks


def _bell(scene: Scene, point: Point) -> Floats:
    middle, width = point
    return stack(scene.direction * np.exp(-(((scene.speed - middle) / width) ** 2)))


_BAND = Form("", "a band of speeds", ("band_nm",), _bell, ("middle_rad_s", "width_rad_s"))


def only_in_a_band(library: Library, choice: Choice) -> set[tuple[str, str]]:
    """Return effect and form of every law of speed where a band of speeds plainly does better.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled. Its laws of the speed are held against one band beside all its other laws.

    Returns
    -------
    set of tuple of str
        All laws of the speed that the library has: what one of them copies, the next one would.
        Empty where the choice has none, or the band does not do better.
    """
    laws = [term for term in choice.terms if term.scored.form.effect in _OF_SPEED]
    if not laws:
        return set()
    others = [term.candidate for term in choice.terms if term not in laws]
    band = _best(library, others)
    if band is None or not _does_better(band, choice.full, library.errors(others)):
        return set()
    forms = (candidate.form for candidate in library.candidates)
    return {(form.effect, form.name) for form in forms if form.effect in _OF_SPEED}


def _does_better(band: Floats, laws: Floats, without: Floats) -> bool:
    """Return whether laws miss more of a band's gain than forms do, and surely, shape (b,) each."""
    loss = laws - band
    error = float(np.std(loss)) * math.sqrt(loss.shape[0])
    missed = _MISSED * float((without - band).sum())
    return float(loss.sum()) > max(missed, _SURELY * error)


def _best(library: Library, others: Sequence[Candidate]) -> Floats | None:
    """Return what the band that removes most leaves of unseen blocks, shape (b,).

    None where no band was driven to both of its ends.
    """
    scene = library.scene
    basis, left = basis_of(library.model(others)), library.residual(others)
    driven = []
    for share, wide in product(_MIDDLES, _WIDTHS):
        middle = float(share) * scene.fastest
        width = wide * middle
        if scene.slowest < middle - _OVER * width and middle + _OVER * width < scene.fastest:
            columns = library.columns(_BAND, (middle, width))
            driven.append(Candidate.of(_BAND, (middle, width), columns))
    if not driven:
        return None
    best = max(driven, key=lambda candidate: gain_of(candidate, basis, left))
    moved = replace(library, candidates=tuple(driven)).deeper(best, basis, left)
    return library.errors([*others, moved])
