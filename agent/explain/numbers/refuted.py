"""Whether the recordings refute some of the twin's own numbers.

Holding them as given, all else refitted, must cost a material share, with and without the effects
that were found and by no accident of a few blocks; they must be as wrong without the effects as
they are beside them; and lie outside of what the recordings bear.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.choosing.candidate import basis_of
from agent.explain.choosing.rivals import LIKE_A_WEIGHT
from agent.explain.choosing.search import Library
from agent.explain.forms.balancer import BALANCERS
from agent.explain.numbers.intervals import named_effects
from agent.explain.numbers.model import Model
from agent.explain.numbers.reach import reach_of
from agent.explain.numbers.short_stroke import gravity_look_alikes
from agent.explain.rows.table import BASE
from agent.identify.result import Floats
from agent.physics.rigid_body import GRAVITY
from agent.physics.twin import Twin

_FAR_OFF = 0.05  # of a number
_OUTSTANDING = 2.0  # times the noise's energy
_NEEDED = 0.25  # of the noise's energy: less is lost in it where something else was found
_SAME_MOVE = 0.6  # of the move beside the effects
_BENT = 0.25  # of that move: a fit that ends so close to the number as given is where it is from


@dataclass(frozen=True)
class Case:
    """What the twin's numbers are judged by.

    `beside` (m, k) are the effects' columns; `by_itself` the plain refits of the twin's structure,
    `earlier` those to the first recordings alone, `turning` the one with reversals in it.
    """

    library: Library
    twin: Twin
    model: Model
    beside: Floats
    by_itself: Sequence[Mapping[str, float]]
    earlier: Sequence[Mapping[str, float]]
    turning: Mapping[str, float]
    floor_nm: float

    @property
    def carried(self) -> list[str]:
        """Return the names of the numbers that are excited."""
        return [BASE[i] for i in np.flatnonzero(self.library.scene.table.carried)]

    def columns(self, names: Sequence[str]) -> Floats:
        """Return the base columns of some numbers, shape (m, k)."""
        return self.library.base[:, [i for i, n in enumerate(self.carried) if n in names]]

    def move(self, names: Sequence[str]) -> Floats:
        """Return how far the model moves some numbers, shape (k,), in the order of `columns`."""
        moved = (n for n in self.carried if n in names)
        return np.array([self.model.base[n].value - getattr(self.twin, n) for n in moved])


def is_wrong(case: Case, names: Sequence[str], material: float) -> bool:
    """Return whether holding some numbers as given costs a material share, by no accident."""
    held = [name for name in case.carried if name not in names]
    if len(held) == len(case.carried):
        return False
    library, base = case.library, case.columns(held)
    alone = library.errors_with(base) - library.errors_with(library.base)
    loss = loss_of(case, names)
    if _is_far_off(case, names):
        material = min(material, _OUTSTANDING * _noise(case))
    # Without the effects a number need not move as far, and what it is worth goes with the square.
    if float(alone.sum()) < _SAME_MOVE**2 * material:
        return False
    if float(loss.sum()) < material and not (_beside_its_like(case, names) and _shows(case, loss)):
        return False
    if not lasting(loss):
        return False
    return _agrees(case, names) and are_refuted(case, names)


def _beside_its_like(case: Case, names: Sequence[str]) -> bool:
    """Return whether numbers are the weight's beside what looks like one, as far as strokes go.

    Either takes up what the other lacks: however wrong the weight is, holding it costs little.
    """
    like = any(term.scored.form.effect in LIKE_A_WEIGHT for term in case.model.terms)
    return like and set(names) <= set(GRAVITY)


def _beside_a_sine(case: Case, names: Sequence[str]) -> bool:
    """Return whether numbers are the weight's beside a spring, most of which is a sine."""
    sines = any(term.scored.form in BALANCERS for term in case.model.terms)
    return sines and set(names) <= set(GRAVITY)


def _shows(case: Case, loss: Floats) -> bool:
    """Return whether a loss, shape (b,), stands out of the noise, as far as that is known."""
    return float(loss.sum()) >= _noise(case) > 0.0


def _noise(case: Case) -> float:
    """Return the noise's weighted energy at all rows."""
    return case.floor_nm**2 * float(np.sum(case.library.weighing.weight**2))


def _is_far_off(case: Case, names: Sequence[str]) -> bool:
    """Return whether beside a law numbers are off by more than drives and laws are.

    A strong law makes any wrong number a small share of the mismatch, and no more right. Where the
    joint slides one way alone friction's numbers are a constant's: what is said of them asks for
    more.
    """
    one_way = case.library.scene.one_way
    if one_way or not case.model.terms or not case.floor_nm > 0.0:
        return False
    there = [name for name in case.carried if name in names]
    given = np.array([float(getattr(case.twin, name)) for name in there])
    moves = np.abs(case.move(names))
    if set(there) <= set(GRAVITY):
        return float(np.linalg.norm(moves)) > _FAR_OFF * float(np.linalg.norm(given))
    return bool(np.any((moves > _FAR_OFF * np.abs(given)) & (given != 0.0)))


def is_needed(case: Case, names: Sequence[str]) -> bool:
    """Return whether what else was found does not do without a number, nearly.

    Beside other findings a number takes up what their laws' forms leave of them, and the joint's
    small effects. Less than half the noise's amplitude is no reason to say that it is wrong.
    """
    return float(loss_of(case, names).sum()) >= _NEEDED * _noise(case)


def stands_out(case: Case, names: Sequence[str]) -> bool:
    """Return whether beside a law holding some numbers as given costs more than noise makes.

    Whatever they are in a fit without the law.
    """
    loss = loss_of(case, names)
    far = bool(case.model.terms) and float(loss.sum()) >= _OUTSTANDING * _noise(case) > 0.0
    return far and lasting(loss)


def loss_of(case: Case, names: Sequence[str]) -> Floats:
    """Return what holding some numbers as given costs on unseen blocks, shape (b,)."""
    held = case.columns([name for name in case.carried if name not in names])
    kept = np.concatenate((held, case.beside), axis=1)
    whole = np.concatenate((case.library.base, case.beside), axis=1)
    return case.library.errors_with(kept) - case.library.errors_with(whole)


def _agrees(case: Case, names: Sequence[str]) -> bool:
    """Return whether numbers are as wrong without the effects as they are beside them.

    Where most of the move appears only beside the effects, or only in one kind of fit, the numbers
    had been bent by their absence: the twin had them right for its own structure. Moves are
    compared by the torque that they make beside the other numbers. A weight beside a balancer's
    spring, most of which is a sine, may have to move another way than without it: there the twin is
    right for neither structure.
    """
    basis = basis_of(case.columns([name for name in case.carried if name not in names]))
    columns = case.columns(names)
    columns = columns - basis @ (basis.T @ columns)
    torque = columns @ case.move(names)
    energy = float(torque @ torque)
    there = [name for name in case.carried if name in names]
    if energy <= 0.0:
        return False

    def share(fit: Mapping[str, float]) -> float:
        return float(torque @ (columns @ np.array([fit[name] for name in there]))) / energy

    if _beside_a_sine(case, names):
        fits = (f for f in (*case.by_itself, *case.earlier) if all(n in f for n in there))
        moves = (np.array([fit[name] for name in there]) for fit in fits)
        return all(float(np.sum((columns @ move) ** 2)) > _BENT * energy for move in moves)
    in_band, *others = (share(fit) for fit in case.by_itself if all(n in fit for n in there))
    if any(abs(share(fit)) < _BENT for fit in case.earlier if all(n in fit for n in there)):
        return False
    if others and all(name in case.turning for name in there):
        turning = share(case.turning)
        # Or the twin stands between two fits to raw samples that differ by their reversals.
        if abs(turning) < _BENT or turning < 0.0 < others[-1]:
            return False
    # How rows are weighed is anybody's choice: a twin within what that choice makes is a fit's. But
    # noise of the velocity may bend a fit to raw samples anywhere: what counts of that is whether
    # it ends where the twin stands.
    chosen = max((abs(in_band - other) for other in others[:-1]), default=0.0)
    return in_band > _SAME_MOVE and all(abs(o) > max(_BENT, chosen) for o in others)


def are_refuted(case: Case, names: Sequence[str]) -> bool:
    """Return whether numbers as given lie outside of what the recordings bear.

    One by one; or, where their columns are so alike that none is known by itself, together: the
    torque of their common move is one column, and its interval, widened for as many numbers
    (Scheffe, Biometrika 40 (1953) 87), leaves zero out. What on a short stroke stands for gravity
    is no other law then, but the same torque by another name.
    """
    there = [name for name in case.carried if name in names]
    for name in there:
        ci = case.model.base[name].ci95
        if ci is not None and not ci[0] <= float(getattr(case.twin, name)) <= ci[1]:
            return True
    if len(there) < 2:
        return False
    held = case.columns([name for name in case.carried if name not in names])
    torque = case.columns(names) @ case.move(names)
    alike = gravity_look_alikes(case.library, case.twin, case.model)
    known = named_effects(case.model) | frozenset(alike)
    weighing = case.library.weighing
    reach = reach_of(
        case.library.candidates,
        weighing,
        np.concatenate((torque[:, np.newaxis], held, case.beside), axis=1),
        case.model.residual_nm * weighing.weight,
        known,
    )
    return 1.0 + _scheffe(len(there), weighing.starts.shape[0]) * float(reach.below[0]) > 0.0


def _scheffe(count: int, blocks: int) -> float:
    """Return by how much an interval widens that holds for every sum of `count` numbers at once."""
    from scipy.stats import f

    freedom = max(blocks - count, 1)
    return float(np.sqrt(count * f.ppf(0.95, count, freedom) / f.ppf(0.95, 1, freedom)))


def lasting(loss: Floats) -> bool:
    """Return whether blocks agree that a loss is none by accident, two sigmas.

    Or the roots of their losses do: of a number that is far off, as an inertia a hundred times the
    joint's, one hard acceleration makes four fifths of the loss, and every block loses.
    """
    roots = np.sign(loss) * np.sqrt(np.abs(loss))
    needed = 2.0 * float(np.sqrt(loss.shape[0]))
    return any(float(each.sum()) > needed * float(np.std(each)) for each in (loss, roots))
