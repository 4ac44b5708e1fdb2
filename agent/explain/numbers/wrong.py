"""A wrong number is no missing physics: which of the twin's own numbers the recordings refute.

The twin's structure, refitted, must remove a material share of what the twin as given leaves; then
a number is wrong when holding it, all else refitted, costs a material share again, with and without
the effects that were found. A twin whose numbers were fitted without the missing physics passes:
its numbers are biased, not wrong, and refitting its structure alone gains nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.materiality import FAR, least_gain
from agent.explain.choosing.search import Candidate, Library, basis_of
from agent.explain.choosing.shares import above_noise, unseen_nm2
from agent.explain.numbers.factor import factor_column, one_factor
from agent.explain.numbers.intervals import named_effects
from agent.explain.numbers.model import Model
from agent.explain.numbers.plain_refits import earlier_moves, plain_moves
from agent.explain.numbers.reach import reach_of
from agent.explain.numbers.short_stroke import gravity_look_alikes
from agent.explain.numbers.varied import varied_through_given
from agent.explain.rows.evidence import heldout, moments
from agent.explain.rows.table import BASE
from agent.identify.result import Floats, Parameter
from agent.physics.twin import Twin

MATERIAL = 0.04  # of what the twin as given leaves: less is a number's ordinary uncertainty
_NEEDED = 0.25  # of the noise's energy: less is lost in it where something else was found
_SAME_MOVE = 0.6  # of the move beside the effects
_BENT = 0.25  # of that move: a fit that ends so close to the number as given is where it is from
_GROUPS: Mapping[str, tuple[str, ...]] = {
    "inertia-error": ("inertia_kg_m2",),
    "wrong-number": ("coulomb_nm", "viscous_nm_s_per_rad"),
    "gravity-imbalance": ("gravity_sin_nm", "gravity_cos_nm"),
}
_CONTRACT: Mapping[str, str] = {
    "inertia_kg_m2": "inertia_extra_kg_m2",
    "coulomb_nm": "coulomb_extra_nm",
    "viscous_nm_s_per_rad": "viscous_extra_nm_s_per_rad",
    "gravity_sin_nm": "gravity_sin_nm",
    "gravity_cos_nm": "gravity_cos_nm",
}


@dataclass(frozen=True)
class WrongNumber:
    """One effect of the twin's own numbers.

    `energy_share` is of what the twin as given leaves above the floor, on unseen blocks.
    """

    effect: str
    energy_share: float
    parameters: Mapping[str, Parameter]


@dataclass(frozen=True)
class _Case:
    """What the twin's numbers are judged by.

    `beside` (m, k) are the effects' columns; `by_itself` the plain refits of the twin's structure,
    `earlier` those to the first recordings alone.
    """

    library: Library
    twin: Twin
    model: Model
    beside: Floats
    by_itself: Sequence[Mapping[str, float]]
    earlier: Sequence[Mapping[str, float]]
    floor_nm: float

    @property
    def carried(self) -> list[str]:
        """Return the names of the numbers that are excited."""
        return [BASE[i] for i in np.flatnonzero(_carried(self.library))]

    def columns(self, names: Sequence[str]) -> Floats:
        """Return the base columns of some numbers, shape (m, k)."""
        return self.library.base[:, [i for i, n in enumerate(self.carried) if n in names]]

    def move(self, names: Sequence[str]) -> Floats:
        """Return how far the model moves some numbers, shape (k,), in the order of `columns`."""
        moved = (n for n in self.carried if n in names)
        return np.array([self.model.base[n].value - getattr(self.twin, n) for n in moved])


def wrong_numbers(
    library: Library,
    twin: Twin,
    model: Model,
    terms: Sequence[Candidate],
    floor_nm: float,
    *,
    taken_for: frozenset[str] = frozenset(),
) -> tuple[WrongNumber, ...]:
    """Return which of the twin's numbers are not what the recordings say.

    Parameters
    ----------
    library : Library
    twin : Twin
        As given.
    model : Model
        Base and effects fitted together.
    terms : sequence of Candidate
        The effects' columns.
    floor_nm : float
    taken_for : frozenset of str
        Effects that may as well be others, none of which was worth a name: nor are these.
    """
    given = _errors(library, np.zeros((library.target.shape[0], 0)))
    refitted = _errors(library, library.base)
    material = max(MATERIAL * float(given.sum()), least_gain(library, given, terms))
    if float(given.sum() - refitted.sum()) < material:
        return ()
    beside = np.concatenate(
        [np.zeros((library.target.shape[0], 0)), *(t.columns for t in terms)], axis=1
    )
    factor = one_factor(library, twin, beside, material)
    if factor is not None:
        share = _share(
            library, np.zeros((library.target.shape[0], 0)), factor_column(library), floor_nm
        )
        return (WrongNumber("torque-constant-error", share, {"factor": factor}),)
    earlier = earlier_moves(library, twin) if terms else ()  # without a law nothing is bent
    case = _Case(library, twin, model, beside, plain_moves(library, twin), earlier, floor_nm)
    varied = varied_through_given(library, twin, model)
    groups = {effect: names for effect, names in _GROUPS.items() if effect not in taken_for}
    judged = {e: tuple(n for n in names if n not in varied) for e, names in groups.items()}
    refuted = {e: names for e, names in judged.items() if _is_wrong(case, names, material)}
    out = [_wrong(case, effect, refuted) for effect in refuted]
    if not out and not terms:
        return _sorted(_wrong_together(case, material, groups))
    return tuple(
        w
        for at, w in enumerate(_sorted(out))
        if (at == 0 and not terms) or _needed(case, judged[w.effect])
    )


def _is_wrong(case: _Case, names: Sequence[str], material: float) -> bool:
    """Return whether holding some numbers as given costs a material share, by no accident."""
    held = [name for name in case.carried if name not in names]
    if len(held) == len(case.carried):
        return False
    library, base = case.library, case.columns(held)
    alone = _errors(library, base) - _errors(library, library.base)
    loss = _loss(case, names)
    if min(float(alone.sum()), float(loss.sum())) < material or not _lasting(loss):
        return False
    return _agrees(case, names) and _refuted(case, names)


def _sorted(found: Sequence[WrongNumber]) -> tuple[WrongNumber, ...]:
    return tuple(sorted(found, key=lambda wrong: -wrong.energy_share))


def _needed(case: _Case, names: Sequence[str]) -> bool:
    """Return whether what else was found does not do without a number, nearly.

    Beside other findings a number takes up what their laws' forms leave of them, and the joint's
    small effects. Less than half the noise's amplitude is no reason to say that it is wrong.
    """
    weighing = case.library.weighing
    noise = case.floor_nm**2 * float(np.sum(weighing.weight**2))
    return float(_loss(case, names).sum()) >= _NEEDED * noise


def _loss(case: _Case, names: Sequence[str]) -> Floats:
    """Return what holding some numbers as given costs on unseen blocks, shape (b,)."""
    held = case.columns([name for name in case.carried if name not in names])
    kept = np.concatenate((held, case.beside), axis=1)
    whole = np.concatenate((case.library.base, case.beside), axis=1)
    return _errors(case.library, kept) - _errors(case.library, whole)


def _wrong(case: _Case, effect: str, refuted: Mapping[str, Sequence[str]]) -> WrongNumber:
    """Return a wrong number with the share of the mismatch that its move removes.

    Beside other wrong numbers alone, where no effect had bent the rest: what is right stays, or it
    would take up half of what is wrong on a short cycle.
    """
    names = refuted[effect]
    freed = case.carried
    if not case.beside.shape[1]:
        freed = [name for group in refuted.values() for name in group]
    held = case.columns([name for name in freed if name not in names])
    kept = np.concatenate((held, case.beside), axis=1)
    whole = np.concatenate((case.columns(freed), case.beside), axis=1)
    share = _share(case.library, kept, whole, case.floor_nm)
    return WrongNumber(effect, share, _extras(case.twin, case.model, names))


def _wrong_together(
    case: _Case, material: float, of: Mapping[str, Sequence[str]]
) -> list[WrongNumber]:
    """Return the fewest groups of numbers that, freed, do as well as all, where none must be wrong.

    Groups whose torque is alike on these recordings each do without the other, and still the twin
    as given is refuted: then the one that does most by itself stands for what they share.
    """
    library = case.library
    nothing = np.zeros((library.target.shape[0], 0))
    if unseen_nm2(library, nothing) < (FAR * case.floor_nm) ** 2:
        return []
    best = float(_errors(library, library.base).sum())
    freed: list[str] = []
    effects: list[str] = []
    while True:
        left = float(_errors(library, case.columns(freed)).sum())
        groups = {
            effect: [*freed, *names]
            for effect, names in of.items()
            if effect not in effects and any(name in case.carried for name in names)
        }
        if left - best < material or not groups:
            break
        errors = {e: float(_errors(library, case.columns(n)).sum()) for e, n in groups.items()}
        following = min(errors, key=lambda effect: errors[effect])
        effects.append(following)
        freed = groups[following]
    if not effects or not _refuted(case, case.carried):
        return []
    return [
        WrongNumber(
            effect,
            _share(library, nothing, case.columns(_GROUPS[effect]), case.floor_nm),
            _extras(case.twin, case.model, _GROUPS[effect]),
        )
        for effect in effects
    ]


def _agrees(case: _Case, names: Sequence[str]) -> bool:
    """Return whether numbers are as wrong without the effects as they are beside them.

    Where most of the move appears only beside the effects, or only in one kind of fit, the numbers
    had been bent by their absence: the twin had them right for its own structure. Moves are
    compared by the torque that they make beside the other numbers.
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

    in_band, *others = (share(fit) for fit in case.by_itself if all(n in fit for n in there))
    if any(abs(share(fit)) < _BENT for fit in case.earlier if all(n in fit for n in there)):
        return False
    # How rows are weighed is anybody's choice: a twin within what that choice makes is a fit's. But
    # noise of the velocity may bend a fit to raw samples anywhere: what counts of that is whether
    # it ends where the twin stands.
    chosen = max((abs(in_band - other) for other in others[:-1]), default=0.0)
    return in_band > _SAME_MOVE and all(abs(o) > max(_BENT, chosen) for o in others)


def _refuted(case: _Case, names: Sequence[str]) -> bool:
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


def _share(library: Library, kept: Floats, whole: Floats, floor_nm: float) -> float:
    """Return the share of what the twin as given leaves that a number's move removes, 0 to 1."""
    given = unseen_nm2(library, np.zeros((library.target.shape[0], 0)))
    after = unseen_nm2(library, whole)
    removed = unseen_nm2(library, kept) - after
    above = above_noise(given, after, floor_nm)
    return min(max(removed / above, 0.0), 1.0) if above > 0.0 else 0.0


def _errors(library: Library, columns: Floats) -> Floats:
    part = moments(columns, library.target, library.weighing.starts)
    if not columns.shape[1]:
        return part.square
    return heldout(part, library.weighing.fold)


def _carried(library: Library) -> NDArray[np.bool_]:
    return library.scene.table.carried


def _lasting(loss: Floats) -> bool:
    """Return whether blocks agree that a loss is none by accident, two sigmas.

    Or the roots of their losses do: of a number that is far off, as an inertia a hundred times the
    joint's, one hard acceleration makes four fifths of the loss, and every block loses.
    """
    roots = np.sign(loss) * np.sqrt(np.abs(loss))
    needed = 2.0 * float(np.sqrt(loss.shape[0]))
    return any(float(each.sum()) > needed * float(np.std(each)) for each in (loss, roots))


def _extras(twin: Twin, model: Model, names: Sequence[str]) -> dict[str, Parameter]:
    out = {}
    for name in names:
        found = model.base[name]
        if found.ci95 is None:
            continue
        given = float(getattr(twin, name))
        out[_CONTRACT[name]] = Parameter(
            found.value - given, (found.ci95[0] - given, found.ci95[1] - given)
        )
    return out
