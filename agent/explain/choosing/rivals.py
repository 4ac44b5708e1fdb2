"""What could stand in a term's place: the best of every other effect that is not clearly worse."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.choosing.candidate import Candidate, Scored, Together, basis_of
from agent.explain.choosing.materiality import noise_energy
from agent.explain.choosing.search import Library
from agent.explain.forms.gap import is_a_spring
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.noise_in_kind import is_noise_in_kind
from agent.identify.result import Floats

WEIGHT = "gravity-imbalance"
_UNDER_LOAD = "load-dependent-friction"
LIKE_A_WEIGHT = ("torque-offset", "direction-asymmetry", "cable-force")
"""What gravity, nearly a constant or a line on a short stroke, is taken for there."""

DECISIVE = 3.0
"""Of log density: a rival that is further behind is out."""

_PLAINLY = 6.0  # of log density: three of a loss's own standard errors
_MISFIT = 3.0  # times what the chosen law's own form leaves above the noise
_NOISE_KNOWN = 0.05  # of its energy

_PER_SHARE = 60.0  # of log density: a twentieth of the gain missed is decisive
_PER_SHARE_OF_WARMTH = 30.0  # or a tenth: no thermometer is where the oil rubs, and each one lags
_PULLS = frozenset({WEIGHT, *LIKE_A_WEIGHT})
_EXACT = frozenset({WEIGHT, "torque-offset", "direction-asymmetry"})  # a sine, and constants
_OF_SPEED = frozenset({"stribeck", "viscous-nonlinear"})
_OF_WAVES = frozenset({"torque-ripple", "kinematic-error", "resolver-error"})
_ARMS = frozenset({"joint-flexibility", "backlash"})
_WARMTH_OR_TIME = frozenset({"temperature-dependent-friction", "friction-drift"})


@dataclass(frozen=True)
class Rival:
    """Another effect in a term's place, how probable it is, and how alike the two are."""

    scored: Scored
    probability: float
    likeness: float


@dataclass(frozen=True)
class Term:
    """One effect of the model, as it was chosen.

    Parameters
    ----------
    scored : Scored
    chance : float
        How often shifted residuals give as much.
    probability : float
        Against its rivals.
    rivals : tuple of Rival
        The most likely first.
    """

    scored: Scored
    chance: float
    probability: float = 1.0
    rivals: tuple[Rival, ...] = ()

    @property
    def candidate(self) -> Candidate:
        """Return the columns in the model."""
        return self.scored.candidate


def with_rivals(
    library: Library,
    others: Sequence[Candidate],
    ranked: Sequence[Scored],
    best: Scored,
    chance: float,
    alike: Mapping[str, Scored],
) -> Term:
    """Return a term with the best form of every other effect that is not clearly worse.

    What is `alike` is compared as it is there: see `told_apart`.
    """
    residual = library.residual([*others, best.candidate])
    size = effective_size(library.scene.table, library.weighing, residual)
    without = library.errors(others)
    noise = noise_energy(library, [*others, best.candidate]) or _as_noise(library, residual)
    # To the chosen one, not to its rival: but for those that have no bearing on which it is.
    tuned = [term for term in others if term.form.nonlinear]
    first_of: dict[str, Scored] = {}
    for scored in ranked:
        if not scored.form.rivals_none:
            first_of.setdefault(scored.form.effect, scored)
    entries = []
    for effect, scored in first_of.items():
        if effect == best.form.effect or best.form.effect in scored.form.contains:
            continue
        if effect == _UNDER_LOAD and best.form.effect in _held_by(library):
            continue
        if is_a_spring(library.scene, scored.form, scored.candidate.point):
            continue
        own, other = best, scored
        if best.form.effect in alike and effect in alike:
            own, other = alike[best.form.effect], alike[effect]
        lost = float(other.blocks.sum() - own.blocks.sum())
        missed = lost / max(float(without.sum() - own.blocks.sum()), 1e-300)
        by_warmth = {effect, best.form.effect} == _WARMTH_OR_TIME
        per_share = _PER_SHARE_OF_WARMTH if by_warmth else _PER_SHARE
        behind = behind_of(own.blocks, other.blocks, size)
        if per_share * missed < behind:
            no_bearing = _without_bearing({effect, best.form.effect})
            bear = [term for term in tuned if term.form.effect not in no_bearing]
            blocks = None if by_warmth else _retuned(library, others, bear, other)
            surely = blocks is not None and _is_plainly_behind(own.blocks, blocks, size)
            exact = WEIGHT in {effect, best.form.effect} and {effect, best.form.effect} <= _EXACT
            misshapen = blocks is not None and _is_misshapen(own.blocks, blocks, noise)
            if not surely or not (exact or misshapen):
                # Few laws' forms are so exact that missing a few percent of the gain refutes one.
                behind = per_share * missed
        entries.append((scored, behind))
    weights = [math.exp(-max(behind, 0.0)) for _, behind in entries]
    total = 1.0 + sum(weights)
    rivals = [
        Rival(scored, weight / total, likeness(library, others, best, scored))
        for (scored, behind), weight in zip(entries, weights, strict=True)
        if behind < DECISIVE
    ]
    rivals.sort(key=lambda r: -r.probability)
    return Term(best, chance, 1.0 / total, tuple(rivals))


def _held_by(library: Library) -> frozenset[str]:
    """Return the effects that a load is made of: friction under it holds their torque itself.

    An arm's weight, always, and what was found that the arm is held against.

    Friction is F + c |l| along the motion. Of a load that swings less than F it may be F and c l:
    a copy of what the load is made of, which it cannot stand for.
    """
    held = library.scene.held
    known = held.known if isinstance(held, Together) else ()
    return frozenset((WEIGHT, *(each.candidate.form.effect for each in known)))


def _without_bearing(effects: set[str]) -> frozenset[str]:
    """Return the effects whose numbers say nothing of which of two others there is.

    Laws of the speed tell no two pulls apart, and waves no two laws of the speed.
    """
    if effects <= _PULLS:
        return _OF_SPEED
    return _OF_WAVES if effects <= _OF_SPEED else frozenset()


def _as_noise(library: Library, residual: Floats) -> float:
    """Return the energy of a weighted residual where it is noise in kind; 0 for any other.

    Where no speed is held there is no floor. What is left beside a law says how exact its form is
    all the same, if it is noise.
    """
    weighing = library.weighing
    left_nm = residual / weighing.weight
    is_noise = is_noise_in_kind(library.scene.table, weighing.rows, left_nm)
    return float(residual @ residual) if is_noise else 0.0


def _retuned(
    library: Library, others: Sequence[Candidate], tuned: Sequence[Candidate], rival: Scored
) -> Floats | None:
    """Return what a rival leaves of unseen blocks, shape (b,), where others are tuned to it.

    None where that would ask for the motion of an arm again and again.
    """
    if any(term.form.effect in _ARMS for term in tuned):
        return None
    if not tuned:
        return rival.blocks
    moved = list(others)
    for index, term in enumerate(moved):
        if any(term is own for own in tuned):
            rest = [*moved[:index], *moved[index + 1 :], rival.candidate]
            basis = basis_of(library.model(rest))
            moved[index] = library.deeper(term, basis, library.residual(rest))
    return np.minimum(library.errors([*moved, rival.candidate]), rival.blocks)


def _is_misshapen(best: Floats, rival: Floats, noise: float) -> bool:
    """Return whether a rival leaves far more above the noise than the chosen law's form does.

    How inexact the laws' forms are in a joint shows in what the chosen one leaves. Where that is
    next to nothing, a rival that plainly leaves something has another curve than the joint.
    """
    left, other = (float(blocks.sum()) - noise for blocks in (best, rival))
    # Of noise that is so much less, both leave as much more.
    unknown = (_MISFIT - 1.0) * _NOISE_KNOWN * noise
    return noise > 0.0 and other > _MISFIT * max(left, 0.0) + unknown


def log_density_gap(best: Floats, other: Floats, size: float) -> float:
    """Return how much log density another model loses on unseen data, at `size` samples."""
    return 0.5 * size * math.log(max(float(other.sum()), 1e-300) / max(float(best.sum()), 1e-300))


def behind_of(best: Floats, rival: Floats, size: float) -> float:
    """Return how much log density a rival loses on unseen data, at `size` samples.

    Or the loss in units of its own uncertainty over the blocks, twice, where that says less.

    Parameters
    ----------
    best, rival : ndarray, shape (b,)
        Squared errors on unseen blocks.
    size : float
    """
    loss = rival - best
    error = float(np.std(loss)) * math.sqrt(loss.shape[0])
    sure = 2.0 * float(loss.sum()) / max(error, 1e-300)
    return min(log_density_gap(best, rival, size), sure)


def _is_plainly_behind(best: Floats, rival: Floats, size: float) -> bool:
    """Return whether a rival surely loses on unseen data: on the whole, or block after block.

    Blocks differ in what they show. A loss in nearly all of them is none by chance, however uneven
    it is, though its mean over them is hardly known.
    """
    count = best.shape[0]
    wins = np.count_nonzero(rival > best)
    signs = 2.0 * (2.0 * wins - count) / math.sqrt(count)
    by_signs = min(log_density_gap(best, rival, size), signs)
    return bool(max(behind_of(best, rival, size), by_signs) >= _PLAINLY)


def likeness(library: Library, others: Sequence[Candidate], found: Scored, rival: Scored) -> float:
    """Return which share of a found effect's torque a rival can copy, beside the model, 0 to 1.

    The squared cosine of the angle between what the effect adds beyond base and other terms and the
    best copy from the rival's columns.
    """
    basis = basis_of(library.model(others))
    added = found.candidate.columns @ found.coefficients
    added = added - basis @ (basis.T @ added)
    copy = rival.candidate.columns
    copy = basis_of(copy - basis @ (basis.T @ copy), like=copy)
    energy = float(added @ added)
    return float(np.sum((copy.T @ added) ** 2)) / energy if energy > 0.0 else 0.0
