"""What may enter a model: a material gain, no accident of a few blocks, not a term's double.

A term that was found alone may have numbers that make up for what comes next. A spot beside an
offset stands wide for both, so that the offset seems to share out what the spot explains; with
their numbers moved together each has its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from agent.explain.choosing.candidate import Candidate, Scored, basis_of
from agent.explain.choosing.heard import LIKE_A_GAP, heard
from agent.explain.choosing.materiality import least_gain, noise_energy, of_mismatch, worth
from agent.explain.choosing.rivals import WEIGHT, Term
from agent.explain.choosing.search import Library
from agent.explain.choosing.shifts import chance
from agent.explain.choosing.together import both_moved
from agent.explain.forms.balancer import COIL
from agent.explain.forms.gap import is_a_spring
from agent.explain.rows.evidence import solve
from agent.explain.rows.table import GRAVITY_AT
from agent.identify.result import Floats
from agent.physics.effects.library import CARRIED

_ACCIDENT = 0.01
_OF_ITS_OWN = 0.1  # of the mismatch: so much more makes a newcomer an effect, whatever it copies
_SHARED_OUT = 0.2  # of what a term had removed: so little is left to it beside a newcomer
_HEARD = 0.5  # of the gain: what resembles a gap explains that much more where there is none
_FAR_LESS = 2.0  # times as much above the noise: true gaps leave less than what they resemble
_NOISE_KNOWN = 0.1  # of the noise's energy: so well is it known
_MOST_TIMES = 5.0  # the mismatch, in rms: a term of so much more is taken back by another
_REPEATED = frozenset(
    {
        "torque-ripple",
        "kinematic-error",
        "resolver-error",
        "position-dependent-friction",
        "local-fault",
    }
)


class Asked(NamedTuple):
    """What a term has to remove to be worth its name, and what noise alone makes; squared error."""

    gain: float
    noise: float

    @classmethod
    def of(cls, library: Library, plain: Floats, terms: Sequence[Candidate]) -> Asked:
        """Return what is asked in a model of some terms."""
        return cls(least_gain(library, plain, terms), noise_energy(library, terms))


def allowed(ranked: Sequence[Scored], chosen: Sequence[Term]) -> list[Scored]:
    """Leave out effects that are there already, but for those that may come at several places.

    A joint has one arm: where a spring or a gap carries it, the other cannot carry it again. And a
    balancer's stiffness is a sine, as a weight is: one of the two has it.
    """
    there = {t.scored.form.effect for t in chosen}
    if not there.isdisjoint(CARRIED):
        there.update(CARRIED)
    if any(t.scored.form is COIL for t in chosen):
        there.add(WEIGHT)
    if WEIGHT in there:
        ranked = [s for s in ranked if s.form is not COIL]
    return [s for s in ranked if s.form.effect not in there or s.form.effect in _REPEATED]


def least_on_all_rows(
    library: Library, terms: Sequence[Candidate], plain: Floats, current: Floats
) -> float:
    """Return what a form must at least remove of the residual on all rows to be material.

    No fit removes more of unseen data than of the rows that it was made to: what the model loses
    from these to those, a form beside it may give back, and no more.
    """
    left = library.residual(terms)
    needed = of_mismatch(library, plain, noise_energy(library, terms))
    return needed - (float(current.sum()) - float(left @ left))


def _named(
    library: Library,
    ranked: Sequence[Scored],
    best: Scored,
    current: Floats,
    asked: Asked,
) -> Scored | None:
    """Return the next term: the best one if it is material, or a gap whose blows are heard.

    Such a gap stands before what it looks like within the band, unless that explains far more, or
    leaves far less above the noise: a spring that swings close to the band's end is heard, too, and
    a gap of next to no width is that spring.
    """
    without = float(current.sum())
    gain = without - best.error
    named = worth(current, best.blocks, *asked) >= 0.0
    gap = next((s for s in ranked if heard(library.scene, s.form) and s.error < without), None)
    if gap is not None:
        instead = not named or best.form.effect in LIKE_A_GAP
        above = [max(s.error - asked.noise, 0.0) for s in (gap, best)]
        far_less = above[0] > _FAR_LESS * above[1] + _NOISE_KNOWN * asked.noise
        own = library.scene, gap.form, gap.candidate.point
        a_spring = is_a_spring(*own) and best.error < gap.error
        if named and (far_less or a_spring):
            return best
        if instead and without - gap.error > _HEARD * gain:
            return gap
    return best if named else None


def entered(
    library: Library,
    plain: Floats,
    terms: Sequence[Term],
    current: Floats,
    ranked: Sequence[Scored],
    best: Scored,
    asked: Asked,
) -> tuple[list[Term], Scored, float] | None:
    """Return the terms, the newcomer beside them and its chance, or None where none may enter.

    Parameters
    ----------
    library : Library
    plain, current : ndarray
        Squared errors without any term and with the model so far, shape (b,).
    terms : sequence of Term
        The model so far.
    ranked : sequence of Scored
        Newcomers beside it, the best on unseen data first.
    best : Scored
        The one that would be taken.
    asked : Asked
        Of every term.
    """
    named = _named(library, ranked, best, current, asked)
    if named is not None:
        if cancelling(library, [*(t.candidate for t in terms), named.candidate]):
            return None
        accident = accident_of(library, terms, current, named)
        if accident is None:
            return None
        if not _twice(library, plain, terms, current, named):
            return list(terms), named, accident
    if not terms or float(current.sum()) - asked.noise < asked.gain:
        return None
    moved, beside = both_moved(library, terms, named or best)
    if worth(current, beside.blocks, *asked) < 0.0:
        return None
    accident = accident_of(library, moved, current, beside)
    if accident is None or _twice(library, plain, moved, current, beside):
        return None
    if cancelling(library, [*(t.candidate for t in moved), beside.candidate]):
        return None
    return moved, beside, accident


def cancelling(library: Library, terms: Sequence[Candidate]) -> bool:
    """Return whether terms are many times what they explain together, and take each other back.

    Two bumps at one place, a fault's and friction's of the path, make a third shape with twenty
    newton metres against as many, where the mismatch is a few hundredths. What the twin's own
    numbers take of a term does not count.

    Parameters
    ----------
    library : Library
    terms : sequence of Candidate
    """
    if len(terms) < 2:
        return False
    model = library.model(terms)
    own = solve(model.T @ model, model.T @ library.target)
    basis = basis_of(library.base_beside(terms))
    left = library.target - basis @ (basis.T @ library.target)
    begin = model.shape[1] - sum(term.columns.shape[1] for term in terms)
    for term in terms:
        stop = begin + term.columns.shape[1]
        torque = term.columns @ own[begin:stop]
        net = torque - basis @ (basis.T @ torque)
        if float(net @ net) > _MOST_TIMES**2 * float(left @ left):
            return True
        begin = stop
    return False


def accident_of(
    library: Library, terms: Sequence[Term], current: Floats, best: Scored
) -> float | None:
    """Return how often shifted residuals give as much, None where it is an accident's gain."""
    if not steady(current, best.blocks):
        return None
    model = [t.candidate for t in terms]
    accident = chance(library, model, best)
    if accident > _ACCIDENT:  # a slow pass, or an offset's longest one, may hold half of a gain
        accident = chance(library, model, best, blocks_alike=True)
    return accident if accident <= _ACCIDENT else None


def _twice(
    library: Library, plain: Floats, chosen: Sequence[Term], current: Floats, best: Scored
) -> bool:
    """Return whether a weak newcomer only shares out what a term explains already.

    Where it adds little, and one of the terms could nearly be done without beside it, two names
    would stand for one mismatch, whose shape neither has to the last percent. The weight of an arm
    is no second name: it is there, and a number of the twin's, which is asked for as an effect
    only where a hose or an offset may be taken for it.
    """
    if float(current.sum()) - best.error >= _OF_ITS_OWN * float(plain.sum()):
        return False
    weighs = bool(np.any(library.scene.as_given[GRAVITY_AT]))
    if weighs and best.form.effect == WEIGHT:
        return False
    for index in range(len(chosen)):
        if weighs and chosen[index].scored.form.effect == WEIGHT:
            continue
        others = [t.candidate for i, t in enumerate(chosen) if i != index]
        before = float(library.errors(others).sum() - current.sum())
        beside = float(library.errors([*others, best.candidate]).sum()) - best.error
        if beside < _SHARED_OUT * before:
            return True
    return False


def steady(before: Floats, after: Floats) -> bool:
    """Return whether a gain is more than two standard errors over the blocks, shape (b,).

    As squared error, or in proportion to what each block had: where a slow pass lingers at a bump,
    three blocks may hold nine tenths of the squared error, and all others that pass it agree.
    """
    gain = before - after
    most = np.maximum(np.maximum(before, after), np.abs(gain))  # beside 1e6 N m errors are rounded
    return any(
        float(each.sum()) > 2.0 * float(np.std(each)) * math.sqrt(each.shape[0])
        for each in (gain, gain / np.where(most > 0.0, most, 1.0))
    )
