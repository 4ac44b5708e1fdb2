"""Laws that copy what is not theirs: a fall that is a step, presliding before the joint turns.

And a soft gear that is not soft: one that swings well above the band is rigid in it. What such a
form has left is an arm whose friction yields before it slips, which is presliding, and what a
filter, a lag or a coarse encoder makes of every acceleration.

Friction falls with speed as a film builds up, over a range of speeds. With an exponent as high as
the search goes all of the fall is at one speed, as where oil begins to churn there. Where slow
speeds are passed through alone, within a few samples of a start, the exponent is hardly known and
may end there as well: a fall is a step where a bell-shaped one leaves clearly more.

Friction yields after a reversal. Just before one the joint is as slow; what a law of slow speeds
leaves there a spring that has long slipped may take, through the filter, which knows no direction.
And until the first start or reversal that was recorded nobody knows how far friction has yielded: a
law that is at work nowhere but there has guessed it.

What the first moments after a start or reversal miss, which are not compared, reaches beyond them
through the filter. Where a robot starts and stops at the same places, cycle for cycle, a wave of
high order fits that, and so does a fall of friction close to standstill: a law of the position or
of the speed is at work elsewhere, too.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library
from agent.explain.forms.seen_arm import SEEN
from agent.explain.rows.strata import after_a_turn
from agent.explain.rows.table import Table
from agent.identify.result import Floats

_AS_HIGH = 0.98  # of the highest exponent
_BELL, _PLACES = 2.0, np.geomspace(0.5, 1.6, 13)  # exponent, and where its fall may be instead
_LOST = 0.05  # of what the law removes: what a bell misses of a step, and more
_RIGID = 1.6  # times the band: every true spring of the scored cases swings below 0.7
_ELSEWHERE = (
    frozenset(
        {"torque-ripple", "position-dependent-friction", "kinematic-error", "resolver-error"}
    ),
    frozenset({"stribeck", "viscous-nonlinear"}),
)
_BESIDE = 0.9  # of what it removes; true laws of recordings that hardly do but start have up to 0.7
_REACH = 1.0  # periods of the cutoff: so far what an edge misses reaches
_SEEN = 0.1  # of what it removes: less of it after reversals shows no friction that yields


def misfits(library: Library, choice: Choice) -> set[tuple[str, str]]:
    """Return effect and form of the laws that are not what they were found by.

    Of an arm's friction, and of friction that yields, all forms: what one of them copies, the next
    one would.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    """
    out = set()
    forms = {candidate.form for candidate in library.candidates}
    for term in choice.candidates:
        if _is_a_step(library, choice, term):
            out.add((term.form.effect, term.form.name))
        if _is_rigid(library, term) or _is_not_after_reversals(library, choice, term):
            alike = (form for form in (term.form, *forms) if form.effect == term.form.effect)
            out |= {(form.effect, form.name) for form in alike}
        for kind in _ELSEWHERE:
            if term.form.effect in kind and _is_beside_edges_alone(library, choice, term):
                out |= {(f.effect, f.name) for f in (term.form, *forms) if f.effect in kind}
    return out


def _is_beside_edges_alone(library: Library, choice: Choice, term: Candidate) -> bool:
    """Return whether a law removes what rows beside those that are left out miss, and no more."""
    beside = _beside_edges(library.scene.table)[library.weighing.rows]
    removed = _removed(library, choice, term)
    return float(np.sum(removed[beside])) > _BESIDE * float(np.sum(removed))


def _beside_edges(table: Table) -> NDArray[np.bool_]:
    """Return which rows lie within the filter's reach of rows that are not compared, shape (n,)."""
    out = np.zeros(table.sliding.shape[0], dtype=np.bool_)
    for piece in table.pieces:
        reach = math.ceil(_REACH / (piece.cutoff_hz * piece.period_s * piece.stride))
        edge = ~table.sliding[piece.rows]
        out[piece.rows] = np.convolve(edge, np.ones(2 * reach + 1), "same") > 0.5
    return out


def _removed(library: Library, choice: Choice, term: Candidate) -> Floats:
    """Return the squared residual that a law removes beside the others, shape (m,)."""
    terms = choice.candidates
    without = library.residual([other for other in terms if other is not term])
    return np.asarray(without**2 - library.residual(terms) ** 2)


def _is_a_step(library: Library, choice: Choice, term: Candidate) -> bool:
    """Return whether friction falls at one speed alone, and not over a range of speeds."""
    if term.form.effect != "stribeck" or term.form.limits is None:
        return False
    place = term.form.nonlinear.index("exponent")
    if term.point[place] < _AS_HIGH * term.form.limits(library.scene)[place][1]:
        return False
    others = [other for other in choice.candidates if other is not term]
    speed = term.form.nonlinear.index("stribeck_velocity_rad_s")

    def left_by(factor: float) -> float:
        point = list(term.point)
        point[speed], point[place] = factor * point[speed], _BELL
        return float(library.errors([*others, library.candidate(term.form, tuple(point))]).sum())

    step = float(library.errors([*others, term]).sum())
    removed = float(library.errors(others).sum()) - step
    return min(map(left_by, _PLACES)) - step > _LOST * removed


def _is_rigid(library: Library, term: Candidate) -> bool:
    """Return whether a soft gear's spring does not give way in the band that is compared."""
    if term.form.effect != "joint-flexibility" or term.form.name == SEEN:
        return False
    swing_hz = term.point[term.form.nonlinear.index("antiresonance_hz")]
    return swing_hz >= _RIGID * library.scene.table.cutoff_hz


def _is_not_after_reversals(library: Library, choice: Choice, term: Candidate) -> bool:
    """Return whether hardly any of what presliding removes comes after a start or reversal."""
    if term.form.effect != "presliding-hysteresis":
        return False
    removed = _removed(library, choice, term)
    after = after_a_turn(library.scene.table.rows, library.scene.table.pieces)
    return float(np.sum(removed[after[library.weighing.rows]])) < _SEEN * float(np.sum(removed))
