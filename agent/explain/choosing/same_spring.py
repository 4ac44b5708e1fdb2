"""The spring that a wave shakes: the motor's own motion winds it as well.

A wobble behind a soft gear shakes the arm on the gear's spring, and so does all that the joint
drives. A wave that was found alone has a spring that makes up for the rest: above the true one,
more damped, and one that a misread angle has as well. Beside a soft gear of its own, with the
numbers of both free, the two springs meet where they are one; two laws that nothing ties do not
agree to a few percent by accident.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from agent.explain.choosing.candidate import Candidate, Scored
from agent.explain.choosing.entry import accident_of
from agent.explain.choosing.rivals import DECISIVE, Term, behind_of
from agent.explain.choosing.search import Library
from agent.explain.choosing.together import both_moved
from agent.explain.forms.form import Form
from agent.explain.forms.hidden_arm import inertia_of
from agent.explain.forms.order import ARM_SHARES, ON_A_SPRING, SHARE
from agent.explain.rows.evidence import effective_size, solve
from agent.identify.result import Floats
from agent.physics.effects.library import CARRIED

_DAMPED = 0.05  # of critical: where the soft gear's search begins
_ROUNDS = 3  # of moving all numbers together
_ALIKE = 0.05  # of their frequency: so near are two springs one
_ONE_ARM = 0.15  # of the joint's inertia, apart: so near are two arms one
_AS_DAMPED = 0.3  # of the larger damping, apart
_HZ, _DAMPING = "antiresonance_hz", "damping_ratio"
_SPRING = "one spring"


def with_their_spring(
    library: Library, terms: Sequence[Term], current: Floats
) -> tuple[list[Term], Floats] | None:
    """Return a model with the soft gear that its waves shake, and what it leaves; None for none.

    Parameters
    ----------
    library : Library
    terms : sequence of Term
        The model so far.
    current : ndarray, shape (b,)
        What it leaves of unseen blocks, squared.
    """
    shaken = [term.candidate for term in terms if term.scored.form.name in ON_A_SPRING]
    if not shaken or any(term.scored.form.effect in CARRIED for term in terms):
        return None
    gears = (c.form for c in library.candidates if _is_soft_gear(c.form))
    form = next((gear for gear in gears if gear.name == _SPRING), None)
    if form is None:
        return None
    begin = library.candidate(form, (float(np.median([_number(c, _HZ) for c in shaken])), _DAMPED))
    moved = list(terms)
    spring = Scored(begin, np.ones(1), 0.0, current)
    for _ in range(_ROUNDS):
        moved, spring = both_moved(library, moved, spring)
    own = [t.candidate for t in moved if t.scored.form.name in ON_A_SPRING]
    alike = all(one_spring(wave, spring.candidate) for wave in own)
    if not alike or not form.allows(spring.coefficients):
        return None
    columns = [*(t.candidate for t in moved), spring.candidate]
    size = effective_size(library.scene.table, library.weighing, library.residual(columns))
    if behind_of(spring.blocks, current, size) < DECISIVE:
        return None
    low, high = ARM_SHARES
    if not low < arm_of(library, columns)[SHARE] < high:
        return None  # next to none of the joint, or all of it, is no arm behind a gear
    accident = accident_of(library, moved, current, spring)
    if accident is None:
        return None
    return [*moved, Term(spring, accident)], spring.blocks


def arm_of(library: Library, terms: Sequence[Candidate]) -> Mapping[str, float]:
    """Return the one arm that a model's soft gear carries, by the names of a wave's numbers.

    Nothing without a soft gear beside a wave that shakes it.

    Parameters
    ----------
    library : Library
    terms : sequence of Candidate
        The whole model, the waves in it: without them a gear's inertia is another.
    """
    gear = next((term for term in terms if _is_soft_gear(term.form)), None)
    if gear is None or not any(is_one_arm(gear, term) for term in terms):
        return {}
    model = library.model(terms)
    numbers = solve(model.T @ model, model.T @ library.target)
    later = sum(term.columns.shape[1] for term in terms[terms.index(gear) :])
    share = float(numbers[model.shape[1] - later]) / inertia_of(library.scene)
    known = dict(zip(gear.form.nonlinear, gear.point, strict=True))
    return {**known, SHARE: min(max(share, ARM_SHARES[0]), ARM_SHARES[1])}


def on_one_spring(
    library: Library,
    others: Sequence[Candidate],
    ranked: Sequence[Scored],
    arm: Mapping[str, float],
) -> list[Scored]:
    """Return newcomers, waves among them on the spring and arm that the model has already.

    A joint has one arm, and what shakes it shakes it on the spring that the motion winds. With one
    of its own a misread angle stands for a wobble that it does not copy.

    Parameters
    ----------
    library : Library
    others : sequence of Candidate
        The model without what the newcomers may stand for.
    ranked : sequence of Scored
        Beside it, the best on unseen data first.
    arm : mapping of str to float
        See `arm_of`; nothing where there is none.
    """
    if not arm or not any(_is_soft_gear(other.form) for other in others):
        return list(ranked)
    out = []
    for scored in ranked:
        own = scored.candidate
        numbers = dict(zip(own.form.nonlinear, own.point, strict=True))
        # Of a wobble the arm is known only as a product with its angle.
        asked = {n: v for n, v in arm.items() if n != SHARE or not own.form.as_product}
        if own.form.name not in ON_A_SPRING or _is_of(numbers, asked):
            out.append(scored)
            continue
        point = tuple(asked.get(name, value) for name, value in numbers.items())
        there = replace(library, candidates=(library.candidate(own.form, point),))
        out += there.rank(others, refined=False)
    return sorted(out, key=lambda scored: scored.error)


def but_its_waves(
    own: Candidate, others: Sequence[Candidate], ranked: Sequence[Scored]
) -> list[Scored]:
    """Return what may stand in a law's place: for a soft gear, not a wave that it is shaken by."""
    if not is_shaken(own, others):
        return list(ranked)
    return [scored for scored in ranked if scored.form.effect in CARRIED]


def is_shaken(own: Candidate, others: Sequence[Candidate]) -> bool:
    """Return whether a law is a soft gear whose spring a wave among others says as well."""
    return _is_soft_gear(own.form) and any(is_one_arm(own, other) for other in others)


def one_spring(one: Candidate, other: Candidate) -> bool:
    """Return whether two laws, each with a spring, swing on the same one."""
    near = abs(_number(one, _HZ) - _number(other, _HZ)) <= _ALIKE * _number(other, _HZ)
    ours, theirs = _number(one, _DAMPING), _number(other, _DAMPING)
    return near and abs(ours - theirs) <= _AS_DAMPED * max(ours, theirs)


def is_one_arm(one: Candidate, other: Candidate) -> bool:
    """Return whether of two laws a wave shakes an arm, and the other is the gear's same spring."""
    if one.form.name not in ON_A_SPRING:
        one, other = other, one
    return one.form.name in ON_A_SPRING and _is_soft_gear(other.form) and one_spring(one, other)


def _is_of(wave: Mapping[str, float], arm: Mapping[str, float]) -> bool:
    """Return whether a wave's numbers are those of an arm."""
    near = abs(wave[_HZ] - arm[_HZ]) <= _ALIKE * arm[_HZ]
    return near and abs(wave[SHARE] - arm.get(SHARE, wave[SHARE])) <= _ONE_ARM


def _is_soft_gear(form: Form) -> bool:
    return form.effect in CARRIED and {_HZ, _DAMPING} <= set(form.nonlinear)


def _number(candidate: Candidate, name: str) -> float:
    return float(candidate.point[candidate.form.nonlinear.index(name)])
