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
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library
from agent.explain.rows.strata import after_a_turn

_AS_HIGH = 0.98  # of the highest exponent
_BELL, _PLACES = 2.0, np.geomspace(0.5, 1.6, 13)  # exponent, and where its fall may be instead
_LOST = 0.05  # of what the law removes: what a bell misses of a step, and more
_RIGID = 1.6  # times the band: every true spring of the scored cases swings below 0.7
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
    return out


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
    if term.form.effect != "joint-flexibility":
        return False
    swing_hz = term.point[term.form.nonlinear.index("antiresonance_hz")]
    return swing_hz >= _RIGID * library.scene.table.cutoff_hz


def _is_not_after_reversals(library: Library, choice: Choice, term: Candidate) -> bool:
    """Return whether hardly any of what presliding removes comes after a start or reversal."""
    if term.form.effect != "presliding-hysteresis":
        return False
    terms = choice.candidates
    without = library.residual([other for other in terms if other is not term])
    removed = without**2 - library.residual(terms) ** 2
    after = after_a_turn(library.scene.table.rows, library.scene.table.pieces)
    return float(np.sum(removed[after[library.weighing.rows]])) < _SEEN * float(np.sum(removed))
