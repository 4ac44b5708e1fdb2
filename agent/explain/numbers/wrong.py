"""A wrong number is no missing physics: which of the twin's own numbers the recordings refute.

The twin's structure, refitted, must remove a material share of what the twin as given leaves; then
a number is wrong when holding it, all else refitted, costs a material share again, with and without
the effects that were found. A twin whose numbers were fitted without the missing physics passes:
its numbers are biased, not wrong, and refitting its structure alone gains nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.materiality import FAR, least_gain
from agent.explain.choosing.search import Library
from agent.explain.choosing.shares import above_noise, sliding_nm2, unseen_nm2
from agent.explain.numbers.alike import OffAlike, off_alike
from agent.explain.numbers.factor import Factor, factor_column, may_be_one_factor, one_factor
from agent.explain.numbers.model import Model
from agent.explain.numbers.plain_refits import (
    earlier_moves,
    moves_through_reversals,
    plain_moves,
)
from agent.explain.numbers.refuted import (
    Case,
    are_refuted,
    is_needed,
    is_wrong,
    stands_out,
)
from agent.explain.numbers.varied import varied_through_given
from agent.explain.numbers.warm_constant import right_at_degc
from agent.explain.rows.table import BASE
from agent.identify.result import Floats, Parameter
from agent.physics.rigid_body import GRAVITY
from agent.physics.twin import Twin

_SLIGHT = 0.0075  # of a number: what a drive knows of its torque is known no better
_BESIDE_LAWS = 0.015  # of a number: so much a law bends whose shape is not quite the joint's
MATERIAL = 0.04  # of what the twin as given leaves: less is a number's ordinary uncertainty
_EVEN, _COINCIDENCE = 0.5, 0.25  # of one number for another; of two that are off alike by chance
_WEIGHT = "gravity-imbalance"
_CONSTANT = ("torque-offset", "direction-asymmetry")
_GROUPS: Mapping[str, tuple[str, ...]] = {
    "inertia-error": ("inertia_kg_m2",),
    "wrong-number": ("coulomb_nm", "viscous_nm_s_per_rad"),
    "gravity-imbalance": GRAVITY,
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

    `energy_share` is of what the twin as given leaves above the floor, on unseen blocks;
    `alternatives` are effects that explain as much, with their probabilities.
    """

    effect: str
    energy_share: float
    parameters: Mapping[str, Parameter]
    alternatives: Mapping[str, float] = field(default_factory=dict)


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
    given = library.errors_with(np.zeros((library.target.shape[0], 0)))
    refitted = library.errors_with(library.base)
    material = max(MATERIAL * float(given.sum()), least_gain(library, given, terms))
    # Beside a law a number is asked for by itself; one way alone friction's are a constant's.
    together = not terms or library.scene.one_way
    if together and float(given.sum() - refitted.sum()) < material:
        return ()
    found = _found(library, twin, model, terms, floor_nm, material, taken_for)
    found = tuple(_one_way(library, wrong) for wrong in found)
    if found and _hardly_shows(library, floor_nm):
        found = tuple(wrong for wrong in found if not _is_slight(wrong, twin, _SLIGHT))
    return tuple(w for w in found if not (terms and _is_lost(library, w, twin, floor_nm)))


def _found(
    library: Library,
    twin: Twin,
    model: Model,
    terms: Sequence[Candidate],
    floor_nm: float,
    material: float,
    taken_for: frozenset[str],
) -> tuple[WrongNumber, ...]:
    """Return the twin's numbers that the recordings refute, however little they are off."""
    beside = np.concatenate(
        [np.zeros((library.target.shape[0], 0)), *(t.columns for t in terms)], axis=1
    )
    varied = varied_through_given(library, twin, model)
    carried = [BASE[i] for i in np.flatnonzero(library.scene.table.carried)]
    open_numbers = library.base[:, [name in varied for name in carried]]
    named = frozenset(t.form.effect for t in terms)
    constant = partial(one_factor, library, twin, beside, open_numbers, material, named)
    factor = constant()
    if factor is not None:
        return _constant(library, model, factor, floor_nm)
    earlier = earlier_moves(library, twin) if terms else ()  # without a law nothing is bent
    turning = moves_through_reversals(library, twin) if terms else {}
    by_itself = plain_moves(library, twin)
    library = replace(library, base=library.base_beside(terms))
    case = Case(library, twin, model, beside, by_itself, earlier, turning, floor_nm)
    groups = {effect: names for effect, names in _GROUPS.items() if effect not in taken_for}
    judged = {e: tuple(n for n in names if n not in varied) for e, names in groups.items()}
    refuted = {e: names for e, names in judged.items() if is_wrong(case, names, material)}
    if refuted:
        factor = constant(case.columns([name for own in refuted.values() for name in own]))
    if factor is not None:
        return _constant(library, model, factor, floor_nm)
    alike = off_alike(twin, model, [name for name in carried if name not in varied])
    if alike is not None and (refuted or (not alike.but and stands_out(case, case.carried))):
        together = _alike(case, alike)
        if together:
            return together
    besides = [names for effect, names in refuted.items() if effect != _WEIGHT]
    if _WEIGHT in refuted and any(is_needed(case, names) for names in besides):
        free = np.concatenate((open_numbers, case.columns(_GROUPS[_WEIGHT])), axis=1)
        factor = one_factor(library, twin, beside, free, material, named)
        sure = factor is not None and not factor.instead  # else a number or two are as likely
        constant_too = _constant(library, model, factor, floor_nm) if factor and sure else ()
        if constant_too:
            weight = _wrong(case, refuted[_WEIGHT], _WEIGHT, factor_of(constant_too))
            return tuple(_sharing([*constant_too, weight]))
    out = _sharing([_wrong(case, names, effect) for effect, names in refuted.items()])
    if not out and not terms:
        return _sorted(_wrong_together(case, material, groups))
    needed = tuple(
        w
        for at, w in enumerate(_sorted(out))
        if (at == 0 and not terms) or is_needed(case, judged[w.effect])
    )
    every = {e for e, names in groups.items() if not set(names).isdisjoint(case.carried)}
    if not terms and every == {w.effect for w in needed} and may_be_one_factor(library, twin):
        other = {"torque-constant-error": _COINCIDENCE}
        return (replace(needed[0], alternatives=other), *needed[1:])
    return needed


def _alike(case: Case, alike: OffAlike) -> tuple[WrongNumber, ...]:
    """Return the torque constant's error, and the number that it does not make; nothing if warm."""
    constant = _constant(case.library, case.model, Factor(alike.factor), case.floor_nm)
    effect = next((e for e, names in _GROUPS.items() if set(alike.but) & set(names)), None)
    if not constant or effect is None:
        return constant
    beside = _wrong(case, alike.but, effect, factor_of(constant))
    return _sorted(_sharing([*constant, beside]))


def _one_way(library: Library, wrong: WrongNumber) -> WrongNumber:
    """Return a wrong number beside what is the same where the joint slides one way alone.

    Coulomb friction is a constant there, as an offset is, and friction that differs by direction.
    """
    if not library.scene.one_way or _CONTRACT["coulomb_nm"] not in wrong.parameters:
        return wrong
    others = (*wrong.alternatives, *_CONSTANT)
    return replace(wrong, alternatives=dict.fromkeys(others, 1.0 / (1.0 + len(others))))


def _hardly_shows(library: Library, floor_nm: float) -> bool:
    """Return whether what refitting the twin's numbers removes would not stand out of the noise.

    Where no noise floor was to be had, all that the refitted twin leaves may be noise.
    """
    nothing = np.zeros((library.target.shape[0], 0))
    refitted = unseen_nm2(library, library.base)
    noise = floor_nm**2 if floor_nm > 0.0 else refitted
    return noise + unseen_nm2(library, nothing) - refitted <= FAR**2 * noise


def _is_lost(library: Library, wrong: WrongNumber, twin: Twin, floor_nm: float) -> bool:
    """Return whether beside laws a number is off by no more than they bend, and hardly shows."""
    if not floor_nm > 0.0 or not _is_slight(wrong, twin, _BESIDE_LAWS):
        return False
    given = unseen_nm2(library, np.zeros((library.target.shape[0], 0)))
    return floor_nm**2 + wrong.energy_share * given <= (FAR * floor_nm) ** 2


def _is_slight(wrong: WrongNumber, twin: Twin, slight: float) -> bool:
    """Return whether a wrong number is off by less than so much of itself."""
    moved = {name: p.value for name, p in wrong.parameters.items()}
    if "factor" in moved:
        return abs(moved["factor"] - 1.0) < slight
    if wrong.effect == "gravity-imbalance":
        whole = math.hypot(twin.gravity_sin_nm, twin.gravity_cos_nm)
        return math.hypot(*moved.values()) < slight * whole
    given = {extra: float(getattr(twin, name)) for name, extra in _CONTRACT.items()}
    return all(abs(value) < slight * abs(given[name]) for name, value in moved.items())


def told_again(numbers: Sequence[WrongNumber], twin: Twin, model: Model) -> tuple[WrongNumber, ...]:
    """Return wrong numbers with the intervals that a model has now; a factor's is its own."""
    out, factor = [], factor_of(numbers)
    for wrong in numbers:
        names = [name for name, extra in _CONTRACT.items() if extra in wrong.parameters]
        extras = _extras(twin, model, names, factor)
        out.append(replace(wrong, parameters={**wrong.parameters, **extras}))
    return tuple(out)


def _constant(
    library: Library, model: Model, factor: Factor, floor_nm: float
) -> tuple[WrongNumber, ...]:
    """Return the torque constant's error, with its share; nothing where warmth alone makes it."""
    if right_at_degc(library, model) is not None:
        return ()
    nothing = np.zeros((library.target.shape[0], 0))
    share = _share(library, nothing, factor_column(library), floor_nm)
    chance = _EVEN if len(factor.instead) == 1 else _COINCIDENCE
    first = factor.instead[:1]
    instead = {e: chance for n in first for e, names in _GROUPS.items() if n in names}
    parameters = {"factor": factor.parameter}
    return (WrongNumber("torque-constant-error", share, parameters, instead),)


def _sorted(found: Sequence[WrongNumber]) -> tuple[WrongNumber, ...]:
    return tuple(sorted(found, key=lambda wrong: -wrong.energy_share))


def _wrong(case: Case, names: Sequence[str], effect: str, factor: float = 1.0) -> WrongNumber:
    """Return a wrong number with the share of the mismatch that its move removes.

    With all other numbers and effects as the answer says them, as an effect's share is: what they
    would take over in its absence is not theirs. Beside a wrong torque constant's `factor` a number
    is wrong by what that does not make of it.
    """
    library = case.library
    moves = case.move(names) - (1.0 / factor - 1.0) * _given(case.twin, names, case.carried)
    own = case.columns(names) @ np.nan_to_num(moves)
    every = np.concatenate((case.columns(case.carried), case.beside), axis=1)
    nothing = np.zeros((library.target.shape[0], 0))
    above = above_noise(unseen_nm2(library, nothing), unseen_nm2(library, every), case.floor_nm)
    share = sliding_nm2(library, own) / above if above > 0.0 else 0.0
    return WrongNumber(effect, share, _extras(case.twin, case.model, names, factor))


def _given(twin: Twin, names: Sequence[str], carried: Sequence[str]) -> Floats:
    """Return what the twin says of some numbers, those that are excited."""
    return np.array([float(getattr(twin, name)) for name in carried if name in names])


def factor_of(numbers: Sequence[WrongNumber]) -> float:
    """Return the factor of a wrong torque constant among some numbers; 1 where there is none."""
    return next((n.parameters["factor"].value for n in numbers if "factor" in n.parameters), 1.0)


def _sharing(found: Sequence[WrongNumber]) -> list[WrongNumber]:
    """Return wrong numbers with shares of no more than the whole: one may work against another."""
    whole = max(1.0, math.fsum(wrong.energy_share for wrong in found))
    return [replace(wrong, energy_share=wrong.energy_share / whole) for wrong in found]


def _wrong_together(
    case: Case, material: float, of: Mapping[str, Sequence[str]]
) -> list[WrongNumber]:
    """Return the fewest groups of numbers that, freed, do as well as all, where none must be wrong.

    Groups whose torque is alike on these recordings each do without the other, and still the twin
    as given is refuted: then the one that does most by itself stands for what they share.
    """
    library = case.library
    nothing = np.zeros((library.target.shape[0], 0))
    if unseen_nm2(library, nothing) < (FAR * case.floor_nm) ** 2:
        return []
    best = float(library.errors_with(library.base).sum())
    freed: list[str] = []
    effects: list[str] = []
    while True:
        left = float(library.errors_with(case.columns(freed)).sum())
        if left - best < material:
            break
        groups = {
            effect: [*freed, *names]
            for effect, names in of.items()
            if effect not in effects and any(name in case.carried for name in names)
        }
        if not groups:
            return []  # what is wrong is none of these
        errors = {e: float(library.errors_with(case.columns(n)).sum()) for e, n in groups.items()}
        following = min(errors, key=lambda effect: errors[effect])
        effects.append(following)
        freed = groups[following]
    if not effects or not are_refuted(case, case.carried):
        return []
    return [
        WrongNumber(
            effect,
            _share(library, nothing, case.columns(_GROUPS[effect]), case.floor_nm),
            _extras(case.twin, case.model, _GROUPS[effect]),
        )
        for effect in effects
    ]


def _share(library: Library, kept: Floats, whole: Floats, floor_nm: float) -> float:
    """Return the share of what the twin as given leaves that a number's move removes, 0 to 1."""
    given = unseen_nm2(library, np.zeros((library.target.shape[0], 0)))
    after = unseen_nm2(library, whole)
    removed = unseen_nm2(library, kept) - after
    above = above_noise(given, after, floor_nm)
    return min(max(removed / above, 0.0), 1.0) if above > 0.0 else 0.0


def _extras(
    twin: Twin, model: Model, names: Sequence[str], factor: float = 1.0
) -> dict[str, Parameter]:
    """Return what numbers have more than the twin says times what a constant's factor makes."""
    out = {}
    for name in names:
        found = model.base[name]
        if found.ci95 is None:
            continue
        given = float(getattr(twin, name)) / factor
        out[_CONTRACT[name]] = Parameter(
            found.value - given, (found.ci95[0] - given, found.ci95[1] - given)
        )
    return out
