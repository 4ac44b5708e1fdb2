"""On a short stroke gravity is nearly a constant or a line: a hypothesis then, no base number.

Freed with the twin's own numbers it takes up whatever an offset, an asymmetry or a cable adds, and
none of these would ever be seen. Where one of them does as well as gravity, gravity steps back
into the library, and stands beside them as one of their alternatives. Where its part is what the
torque constant is off by, it is a base number again: nothing is told twice.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.choosing.aliases import ALIKE
from agent.explain.choosing.candidate import Candidate, basis_of, gain_of
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.materiality import least_gain
from agent.explain.choosing.rivals import LIKE_A_WEIGHT
from agent.explain.choosing.search import Library
from agent.explain.forms.balancer import BALANCERS
from agent.explain.forms.form import Form, Point
from agent.explain.numbers.factor import one_factor_does
from agent.explain.numbers.model import Model
from agent.explain.numbers.scaled_weight import only_its_size
from agent.explain.rows.evidence import Weighing
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, Table
from agent.identify.result import Floats
from agent.physics.rigid_body import GRAVITY, gravity_columns
from agent.physics.twin import Twin

_ALIKE = 0.98  # of the energy beside the other numbers: on a stroke of radians a cosine is none
_MISSED = 0.05  # of what gravity gains: a look-alike that misses more is none
_BY_THE_FACTOR = 0.01  # of the weight: so near it is off by what the torque constant is
_SHOWS = 0.1  # of what is left on unseen data: a look-alike that leaves so much more is none
_SURELY = 3.0  # standard errors, as between any two laws: what misses so much more is none either


def _payload(scene: Scene, point: Point) -> Floats:
    del point
    return gravity_columns(scene.full("position_rad"), scene.table.gear_ratio)


_OFFSET, _CABLE = "torque-offset", "cable-force"
_STIFFENS = "spring that stiffens"
PAYLOAD = Form(
    "gravity-imbalance",
    "a payload",
    GRAVITY,
    _payload,
    needs=("position_rad",),
)


def gravity_in_question(scene: Scene, weighing: Weighing, forms: Sequence[Form]) -> bool:
    """Return whether what gravity would explain may as well be a constant or a line.

    Not where one factor on all of the torque explains what all numbers do: what gravity moves by is
    the torque constant's then. Nor where only the size of the twin's weight is wrong.

    Parameters
    ----------
    scene : Scene
        With gravity among the numbers that are refitted.
    weighing : Weighing
    forms : sequence of Form
        All that these recordings can show.
    """
    # A balancer's spring copies any weight, as one of its levers is nothing: see `balanced`.
    like = [f for f in forms if f.effect in LIKE_A_WEIGHT and f not in BALANCERS]
    library = Library.of(scene, weighing, like)
    gravity = _gravity_at(library)
    if not gravity:
        return False
    rest = np.delete(library.base, gravity, axis=1)
    hidden = _hidden(library, rest, library.base[:, gravity])
    free = library.errors_with(library.base)
    gained = float((library.errors_with(rest) - free).sum())
    material = least_gain(library, free, ())
    if gained < material or one_factor_does(library, library.base, rest[:, :0], material):
        return False
    if only_its_size(library, library.base[:, gravity], rest):
        return False
    # What surely explains more than gravity does, with as few numbers, need not be like it.
    few = [c for c in library.candidates if len(c.form.linear + c.form.nonlinear) <= len(gravity)]
    for candidate, is_like in (*((c, True) for c in hidden), *((c, False) for c in few)):
        loss = library.errors_with(rest, candidate.columns) - free
        chance = _SURELY * float(np.std(loss)) * float(np.sqrt(loss.shape[0]))
        most = min(chance, _MISSED * gained) if is_like else -chance
        if float(loss.sum()) <= most:
            return True
    return False


def without_gravity(table: Table) -> Table:
    """Return a table in which the twin's gravity is held as it was given."""
    gravity = np.array([name.startswith("gravity") for name in BASE])
    return replace(table, carried=table.carried & ~gravity)


def in_question(library: Library) -> bool:
    """Return whether gravity is one of a library's candidates."""
    return any(candidate.form is PAYLOAD for candidate in library.candidates)


def weight_is_worth_a_name(library: Library) -> bool:
    """Return whether gravity alone removes what a name asks for, though another law removes more.

    A load below the dry friction behind the gear makes that friction, in proportion to the load, a
    copy of the load: the law that was chosen may be the weight's double, and is none of its rivals.
    """
    plain, weight = library.errors([]), [library.candidate(PAYLOAD, ())]
    gained = float((plain - library.errors(weight)).sum())
    return gained >= least_gain(library, plain, weight)


def pulls(choice: Choice) -> bool:
    """Return whether a cable was found."""
    return any(term.scored.form.effect == _CABLE for term in choice.terms)


def in_its_place(library: Library, choice: Choice) -> bool:
    """Return whether something was found of what gravity may be taken for, or gravity itself.

    But not where, beside what else was found, the size of the twin's own weight alone is wrong.
    """
    effects = {term.scored.form.effect for term in choice.terms}
    if effects & set(LIKE_A_WEIGHT):
        return True
    own = [c for c in choice.candidates if c.form is PAYLOAD]
    rest = library.model([c for c in choice.candidates if c.form is not PAYLOAD])
    return bool(own) and not only_its_size(library, own[0].columns, rest)


def gravity_look_alikes(library: Library, twin: Twin, model: Model) -> tuple[str, ...]:
    """Return the effects whose columns copy the gravity that the twin does not know.

    What they miss of it must not show in unseen data: of a weight a hundred times the noise a
    straight spring misses less than a fiftieth, and that is surely no spring.

    Parameters
    ----------
    library : Library
    twin : Twin
        As given.
    model : Model
        With gravity as the recordings ask for it.
    """
    gravity = _gravity_at(library)
    if not gravity:
        return ()
    names = np.array(BASE)[library.scene.table.carried].tolist()
    moved = np.array([model.base[names[i]].value - getattr(twin, names[i]) for i in gravity])
    rest = np.delete(library.base, gravity, axis=1)
    basis = basis_of(rest)
    beside = [term.candidate.columns for term in model.terms]
    if only_its_size(library, library.base[:, gravity], np.concatenate((rest, *beside), axis=1)):
        return ()
    free = library.errors_with(library.base, *beside)
    torque = library.base[:, gravity] @ moved
    torque = torque - basis @ (basis.T @ torque)
    energy = float(torque @ torque)
    out: list[str] = []
    for candidate in library.candidates:
        effect = candidate.form.effect
        # One column each: a form with more would copy more, and not for its own sake.
        if effect not in LIKE_A_WEIGHT or effect in out or len(candidate.form.linear) > 1:
            continue
        if candidate.form in BALANCERS:
            continue
        own = candidate.columns - basis @ (basis.T @ candidate.columns)
        own = basis_of(own, like=candidate.columns)
        if energy > 0.0 and float(np.sum((own.T @ torque) ** 2)) > _ALIKE * energy:
            loss = library.errors_with(rest, candidate.columns, *beside) - free
            chance = _SURELY * float(np.std(loss)) * math.sqrt(loss.shape[0])
            if float(loss.sum()) <= max(chance, _SHOWS * float(free.sum())):
                out.append(effect)
    own_size = _its_size_and_a_constant(library, library.base[:, gravity], twin)
    if own_size is not None and _OFFSET not in out:
        both = library.errors_with(rest, own_size, *beside)
        gained = library.errors_with(rest, own_size[:, :1], *beside) - both
        needed = _SURELY * float(np.std(gained)) * math.sqrt(gained.shape[0])
        # As good, and not only nearly so: a payload's two parts are looked for in their own right.
        if float((both - free).sum()) <= 0.0 and float(gained.sum()) > needed:
            out.append(_OFFSET)
    if _CABLE not in out and pulled_and_offset(library, rest, library.base[:, gravity], beside):
        out.append(_CABLE)
    return tuple(out)


def pulled_and_offset(
    library: Library, rest: Floats, weight: Floats, beside: Sequence[Floats]
) -> bool:
    """Return whether a cable that stiffens and a constant surely do better than any weight.

    A weight has a sine and a cosine, which on a short stroke are nearly a line and a constant: it
    takes all of such a pair, but for what bends the line.

    Parameters
    ----------
    library : Library
    rest : ndarray, shape (m, p)
        Weighted columns of all of the twin's numbers but the weight's.
    weight : ndarray, shape (m, 2)
        Of the weight's.
    beside : sequence of ndarray
        Of the other laws that were found.
    """
    constant = [c for c in library.candidates if c.form.effect == _OFFSET and not c.point]
    cables = [c for c in library.candidates if c.form.name == _STIFFENS]
    if not constant or weight.shape[1] < len(GRAVITY):
        return False
    free = library.errors_with(rest, weight, *beside)
    for cable in cables:
        loss = library.errors_with(rest, cable.columns, constant[0].columns, *beside) - free
        chance = _SURELY * float(np.std(loss)) * math.sqrt(loss.shape[0])
        if float(loss.sum()) < -chance:
            return True
    return False


def _its_size_and_a_constant(library: Library, gravity: Floats, twin: Twin) -> Floats | None:
    """Return the twin's own weight and a constant beside it, shape (m, 2); nothing without one.

    A weight that is off in its size alone, and an offset, are as many numbers as a payload's parts.
    """
    given = np.array([float(getattr(twin, name)) for name in GRAVITY])
    constant = [c for c in library.candidates if c.form.effect == _OFFSET and not c.point]
    if gravity.shape[1] < len(GRAVITY) or not given.any() or not constant:
        return None
    return np.concatenate(((gravity @ given)[:, np.newaxis], constant[0].columns), axis=1)


def _gravity_at(library: Library) -> list[int]:
    """Return where gravity stands among the base columns that are excited."""
    carried = np.array(BASE)[library.scene.table.carried].tolist()
    return [i for i, name in enumerate(carried) if name.startswith("gravity")]


def _hidden(library: Library, rest: Floats, gravity: Floats) -> list[Candidate]:
    """Return the candidates that gravity, freed, takes up whole, and that may be what is there."""
    basis = basis_of(rest)
    left = library.target - basis @ (basis.T @ library.target)
    copy = basis_of(gravity - basis @ (basis.T @ gravity), like=gravity)
    out = []
    for candidate in library.candidates:
        columns = candidate.columns - basis @ (basis.T @ candidate.columns)
        own = basis_of(columns, like=candidate.columns)
        if not own.shape[1] or gain_of(candidate, basis, left) <= 0.0:
            continue
        if float(np.linalg.svd(copy.T @ own, compute_uv=False).min()) ** 2 > ALIKE:
            out.append(candidate)
    return out


def is_the_factors_weight(twin: Twin, choice: Choice, model: Model, factor: float) -> bool:
    """Return whether a weight beside a wrong torque constant is off by that constant alone.

    Held as given while all other numbers follow the constant, it looks like a payload of its own.

    Parameters
    ----------
    twin : Twin
        As given.
    choice : Choice
    model : Model
        Of the choice.
    factor : float
        Real over reported torque.
    """
    own = np.array([getattr(twin, name) for name in GRAVITY])
    for term, found in zip(choice.terms, model.parameters, strict=True):
        if term.candidate.form is PAYLOAD and own.any():
            more = np.array([found[name].value for name in GRAVITY])
            ends = [found[name].ci95 or (math.nan, math.nan) for name in GRAVITY]
            reach = float(np.linalg.norm([high - low for low, high in ends]))
            off = float(np.linalg.norm(more - own * (1.0 / factor - 1.0)))
            return off <= max(_BY_THE_FACTOR * float(np.linalg.norm(own)), reach)
    return False
