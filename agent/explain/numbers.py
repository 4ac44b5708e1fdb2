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

from agent.explain.evidence import heldout, moments
from agent.explain.materiality import least_gain
from agent.explain.model import Model
from agent.explain.plain_refits import plain_moves
from agent.explain.reach import reach_of
from agent.explain.search import Candidate, Library, basis_of
from agent.explain.shares import above_noise, unseen_nm2
from agent.explain.table import BASE
from agent.identify.result import Floats, Parameter
from agent.physics.twin import Twin

MATERIAL = 0.04  # of what the twin as given leaves: less is a number's ordinary uncertainty
_SAME_MOVE = 0.6  # of the move beside the effects
_BENT = 0.25  # of that move: a fit that ends so close to the number as given is where it is from
_ALIKE = 1.05  # one factor for all explains the error as well, within five percent
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


def wrong_numbers(
    library: Library, twin: Twin, model: Model, terms: Sequence[Candidate], floor_nm: float
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
    """
    given = _errors(library, np.zeros((library.target.shape[0], 0)))
    refitted = _errors(library, library.base)
    material = max(MATERIAL * float(given.sum()), least_gain(library, given, terms))
    if float(given.sum() - refitted.sum()) < material:
        return ()
    factor = _one_factor(library, twin, given, refitted, material, floor_nm)
    if factor is not None:
        return (factor,)
    carried = [BASE[i] for i in np.flatnonzero(_carried(library))]
    beside = np.concatenate(
        [np.zeros((library.target.shape[0], 0)), *(t.columns for t in terms)], axis=1
    )
    whole = _errors(library, np.concatenate((library.base, beside), axis=1))
    by_itself = plain_moves(library, twin)
    out = []
    for effect, names in _GROUPS.items():
        held = [i for i, name in enumerate(carried) if name not in names]
        if len(held) == len(carried):
            continue
        alone = _errors(library, library.base[:, held]) - refitted
        loss = _errors(library, np.concatenate((library.base[:, held], beside), axis=1)) - whole
        if min(float(alone.sum()), float(loss.sum())) < material or not _lasting(loss):
            continue
        if not _agrees(twin, model, by_itself, names) or not _refuted(twin, model, names):
            continue
        kept = np.concatenate((library.base[:, held], beside), axis=1)
        share = _share(library, kept, np.concatenate((library.base, beside), axis=1), floor_nm)
        out.append(WrongNumber(effect, share, _extras(twin, model, names)))
    return tuple(sorted(out, key=lambda w: -w.energy_share))


def _agrees(
    twin: Twin, model: Model, by_itself: Sequence[Mapping[str, float]], names: Sequence[str]
) -> bool:
    """Return whether a number is as wrong without the effects as it is beside them.

    Where most of the move appears only beside the effects, or only in one kind of fit, the number
    had been bent by their absence: the twin had it right for its own structure.
    """
    for name in names:
        beside = model.base[name].value - float(getattr(twin, name))
        if beside == 0.0:
            continue
        in_band, *others = (alone[name] / beside for alone in by_itself if name in alone)
        # Noise of the velocity may bend a fit to raw samples anywhere: what counts is whether it
        # ends where the twin stands.
        if in_band > _SAME_MOVE and all(abs(other) > _BENT for other in others):
            return True
    return False


def _refuted(twin: Twin, model: Model, names: Sequence[str]) -> bool:
    """Return whether a number as given lies outside of what the recordings bear."""
    intervals = [(float(getattr(twin, name)), model.base[name].ci95) for name in names]
    return any(ci is not None and not ci[0] <= given <= ci[1] for given, ci in intervals)


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
    return float(loss.sum()) > 2.0 * float(np.std(loss)) * float(np.sqrt(loss.shape[0]))


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


def _one_factor(
    library: Library,
    twin: Twin,
    given: Floats,
    refitted: Floats,
    material: float,
    floor_nm: float,
) -> WrongNumber | None:
    """Return the torque constant's error, where one factor explains what all numbers explain."""
    table = library.scene.table
    numbers = np.array([getattr(twin, name) for name in BASE])
    if np.count_nonzero(numbers[_carried(library)]) < 3:
        return None
    scale = library.weighing.weighted(table.base @ numbers)[:, np.newaxis]
    one = _errors(library, scale)
    gained = float(given.sum() - one.sum())
    if float(one.sum()) > _ALIKE * float(refitted.sum()) or gained < material:
        return None
    basis = basis_of(scale)
    left = library.target - basis @ (basis.T @ library.target)
    moved = float(scale[:, 0] @ library.target) / float(scale[:, 0] @ scale[:, 0])
    reach = reach_of(
        library.candidates, library.weighing, scale, left, frozenset({"torque-constant-error"})
    )
    low, high = (1.0 + moved + float(end[0]) for end in (reach.below, reach.above))
    share = _share(library, np.zeros((library.target.shape[0], 0)), scale, floor_nm)
    # The reported torque is the true one over the factor.
    factor = Parameter(1.0 / (1.0 + moved), (1.0 / high, 1.0 / low))
    return WrongNumber("torque-constant-error", share, {"factor": factor})
