"""Which share of the mismatch an effect carries.

In N m squared while the joint slides, every row alike where the first recording was made: what the
refitted twin would leave less if the joint had all effects but this one, over what it leaves above
the noise. With the numbers of all recordings, the twin's and the effects', as the answer says them:
gravity or an offset that is learnt on some places and carried on to the next makes an error of its
own, which no effect has.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from agent.explain.choosing.candidate import Candidate, Known, Together
from agent.explain.choosing.materiality import CLOSE
from agent.explain.choosing.search import Library
from agent.explain.choosing.weighted import DELAY
from agent.explain.rows.evidence import solve, unseen
from agent.explain.rows.scene import Scene
from agent.explain.rows.usual import usual_rows
from agent.identify.result import Floats

_HARDLY = 0.2  # of what all effects remove together
_NEXT_TO_NOTHING = 0.02  # the same of one: others take nearly all of its part
_Adds = TypeVar("_Adds", bound=Callable[[Scene], Floats])


def unseen_nm2(library: Library, columns: Floats) -> float:
    """Return the mean square that a model leaves of unseen rows while sliding, N m squared.

    Parameters
    ----------
    library : Library
    columns : ndarray, shape (m, p)
        Weighted; none for the twin as given.
    """
    return sliding_nm2(library, unseen(columns, library.target, library.weighing))


def sliding_nm2(library: Library, weighted: Floats) -> float:
    """Return the mean square of weighted torques, shape (m,), while sliding, N m squared."""
    weighing = library.weighing
    left = weighted / weighing.weight
    table = library.scene.table
    slides = table.sliding[weighing.rows] & usual_rows(table, weighing.rows)
    return float(np.mean(left[slides] ** 2)) if slides.any() else float(np.mean(left**2))


def shares_of(library: Library, terms: Sequence[Candidate], floor_nm: float) -> tuple[float, ...]:
    """Return the share of the mismatch that each term carries, 0 to 1.

    What the refitted twin leaves, less what it would leave if the joint had all effects but this
    one. What two effects carry together, as both turn with the velocity, is in both shares, and
    what they take from each other in neither. How well the other terms would stand in for the
    missing one, were they fitted anew, is no part of it. Unless they take nearly all of it from
    each other, as a wobble and the soft gear that it shakes may, or others take it all from one:
    then a share is what is left without the effect, the others fitted anew.

    Parameters
    ----------
    library : Library
    terms : sequence of Candidate
    floor_nm : float
        The noise; 0 where it is not known.
    """
    plain = sliding_nm2(library, _refitted(library, library.target))
    model = library.model(terms)
    numbers = solve(model.T @ model, model.T @ library.target)
    full = sliding_nm2(library, library.target - model @ numbers)
    above = above_noise(plain, full, floor_nm)
    own, later = library.base.shape[1], library.base_beside(terms) - library.base
    out = []
    for index, term in enumerate(terms):
        gone = _own_columns(library, terms, index) @ numbers[own:]
        if term.form.effect == DELAY:
            gone = gone + later @ numbers[:own]
        without = sliding_nm2(library, _refitted(library, library.target - gone))
        out.append(min(max((plain - without) / above, 0.0), 1.0) if above > 0.0 else 0.0)
    explained = (plain - full) / above if above > 0.0 else 0.0
    hardly = sum(out) < _HARDLY * explained
    for index, share in enumerate(out):
        if hardly or share < _NEXT_TO_NOTHING * explained:
            others = [term for i, term in enumerate(terms) if i != index]
            without = sliding_nm2(library, library.residual(others))
            out[index] = min(max((without - full) / above, share), 1.0)
    return tuple(out)


def _own_columns(library: Library, terms: Sequence[Candidate], index: int) -> Floats:
    """Return what of all terms' columns goes with one term, zero elsewhere, shape (m, k)."""
    gone = [np.zeros_like(term.columns) for term in terms]
    gone[index] = terms[index].columns
    others = [i for i in range(len(terms)) if i != index]
    for i, on_time in zip(others, without_term(library, terms, index), strict=True):
        gone[i] = terms[i].columns - on_time.columns
    return np.concatenate(gone, axis=1)


def _refitted(library: Library, target: Floats) -> Floats:
    """Return what the twin's own numbers, fitted to a weighted target, leave of it, shape (m,)."""
    base = library.base
    return np.asarray(target - base @ solve(base.T @ base, base.T @ target))


def without_term(library: Library, terms: Sequence[Candidate], index: int) -> list[Candidate]:
    """Return the other terms as they are where one is taken away.

    Beside a late torque every law is taken as late as it is; without the delay they are on time.
    What yields before it slips, and what grows with the load, does so without the friction and the
    load that are gone: so does a drive's delay of all that the joint asks for.

    Parameters
    ----------
    library : Library
    terms : sequence of Candidate
    index : int
        Of the term that is taken away.
    """
    others = [*terms[:index], *terms[index + 1 :]]
    scene = _scene_without(library.scene, terms[index])
    if scene is library.scene:
        return others
    apart = replace(library, scene=scene, known={})
    return [apart.candidate(term.form, term.point) for term in others]


def _scene_without(scene: Scene, term: Candidate) -> Scene:
    """Return what the other laws are made of where one term is taken away."""
    if term.form.effect == DELAY:
        return replace(scene, late_s=0.0, lag_s=0.0) if scene.late_s else scene
    sliding, beside = (_less(known, term) for known in (scene.sliding, scene.beside))
    held = scene.held
    if isinstance(held, Together):
        left = _less(held.known, term)
        held = held if left is held.known else Together(left) if left else None
    if sliding is scene.sliding and beside is scene.beside and held is scene.held:
        return scene
    return replace(scene, sliding=sliding, beside=beside, held=held)


def _less(known: tuple[_Adds, ...], term: Candidate) -> tuple[_Adds, ...]:
    """Return known effects without the one that a term is; they as they are where it is none."""
    alike = {
        index: each.candidate
        for index, each in enumerate(known)
        if isinstance(each, Known) and each.candidate.form.effect == term.form.effect
    }
    own = {index: c.point for index, c in alike.items() if c.form is term.form}
    if own:
        away = {i: float(np.sum(np.abs(np.subtract(p, term.point)))) for i, p in own.items()}
        gone = min(away, key=lambda index: away[index])
    elif len(alike) == 1:  # by another form since, as use was taken for the clock
        (gone,) = alike
    else:
        return known
    return (*known[:gone], *known[gone + 1 :])


def above_noise(before: float, after: float, floor_nm: float) -> float:
    """Return the part of a mean square that is mismatch, N m squared.

    Noise is at least the floor. What a model leaves close above the floor is noise as well: slow
    noise, which no floor measured within half a second contains.

    Parameters
    ----------
    before, after : float
        Mean squares without and with the model, N m squared.
    floor_nm : float
    """
    noise = min(max(after, floor_nm**2), (CLOSE * floor_nm) ** 2) if floor_nm > 0.0 else 0.0
    return max(before - noise, before - after)
