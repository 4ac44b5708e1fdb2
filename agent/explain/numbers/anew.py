"""What strong effects hide: the search once more, beside what it has found.

The first search weighs rows by what the refitted twin leaves, and reads orders and gaps off that. A
strong effect makes a whole stratum count for little, and its waves and edges are taken for those of
a weaker one. An arm's clearance is crossed where its load changes sides, which a cable moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.choosing.beginnings import other_beginning
from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.choice import Choice, choose, decided, settled
from agent.explain.choosing.heard import BACKLASH
from agent.explain.choosing.materiality import A_GOOD_PART, CLOSE, FAR
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.choosing.together import together
from agent.explain.forms.constant import SATURATES
from agent.explain.forms.form import Form
from agent.explain.numbers.in_step import begun_late, chosen_in_step, delay_of, left_share
from agent.explain.numbers.late_velocity import ToldAgainstItError, surely_hides_in
from agent.explain.numbers.pulled import chosen_under_its_pull
from agent.explain.numbers.renewed import left_nm, retaken, with_new_grids
from agent.explain.numbers.resting import (
    arm_share_beside,
    is_possible,
    moved_far,
    numbers_beside,
    on_scene,
    taken_at,
)
from agent.explain.numbers.shaped import chosen_with_its_shape
from agent.explain.numbers.whole import AGES, ageing_beside, grown, held_beside, yields_beside
from agent.explain.rows.evidence import weigh
from agent.explain.rows.floor import noise_floor
from agent.explain.rows.kept import Kept
from agent.explain.rows.scene import Scene
from agent.explain.rows.usual import usual_blocks
from agent.physics.effects import YIELDING

_ROUNDS = 3
_MOST_PROBED = 6
_FRICTION_OF_ARMS = frozenset({AGES, YIELDING})
_SPRUNG = "joint-flexibility"
_LESS = 0.9  # of what is left else, by a delay that is begun with, or an arm followed closely
_LITTLE_MORE = 1.2  # times the squared error
_FAR_OFF = 4.0  # times the squared error: what leaves so much more finds no better one beside it


def chosen_anew(library: Library) -> tuple[Library, Choice]:
    """Choose effects, and look again beside them for as long as that finds others.

    Parameters
    ----------
    library : Library

    Returns
    -------
    library : Library
        The same where nothing else is found beside the first choice.
    choice : Choice
        Not settled yet.
    """
    found, choice = _chosen(library)
    if choice.terms or is_possible(found, ()):
        return _without_time(library, found, choice)
    # Two laws may bend the twin's numbers so far that neither leaves a possible joint alone.
    both, pair = _chosen(replace(library, lenient=True))
    both = replace(both, lenient=False)
    terms, full = settled(both, list(pair.terms))
    if terms and is_possible(both, [term.candidate for term in terms]):
        return both, replace(pair, terms=tuple(terms), full=full)
    return found, choice


def _without_time(library: Library, found: Library, choice: Choice) -> tuple[Library, Choice]:
    """Return what is found where no law of time alone may enter, if that leaves less.

    Such a law follows whatever differs between recordings, and may be the best of all by itself
    where two others make the mismatch; beside it neither is of use. So may iron that saturates,
    which would leave noise: where it does not, what leaves little more without it is likelier.

    Parameters
    ----------
    library, found : Library
        As it was asked, and as it was when it had answered.
    choice : Choice
    """
    for_anything = [c for c in library.candidates if c.form.catch_all]
    if not any(term.scored.form.catch_all for term in choice.terms):
        return found, choice
    if not _more_than_noise(found, choice.candidates, FAR):
        return found, choice

    def left(terms: Sequence[Candidate]) -> float:
        return float(library.errors([library.candidate(c.form, c.point) for c in terms]).sum())

    others = tuple(c for c in library.candidates if not c.form.catch_all)
    first = _first(replace(library, candidates=others))
    if left(first.candidates) > _FAR_OFF * left(choice.candidates):
        return found, choice
    again, pair = _further(replace(library, candidates=others), first)
    saturates = any(term.scored.form.name == SATURATES for term in choice.terms)
    if left(pair.candidates) >= (_LITTLE_MORE if saturates else 1.0) * left(choice.candidates):
        return found, choice
    kept = (again.candidate(c.form, c.point) for c in for_anything)
    return replace(again, candidates=(*again.candidates, *kept)), pair


def _chosen(library: Library) -> tuple[Library, Choice]:
    """Return what is found, or beside a delay that it lacks, if that leaves clearly less."""
    found, choice = _weighed(library)
    if not _more_than_noise(found, choice.candidates):
        return found, choice
    late = begun_late(found, choice)
    if late is None:
        return found, choice
    moved, again = _found_beside(*late)
    better = left_share(again) < _LESS * left_share(choice)
    return (moved, again) if better else (found, choice)


def _weighed(library: Library) -> tuple[Library, Choice]:
    first = _first(library)
    delay, table = delay_of(first), library.scene.table
    if delay is not None and surely_hides_in(float(delay.scored.coefficients[0]), table):
        raise ToldAgainstItError
    found, choice = _further(library, first)
    if not _more_than_noise(found, choice.candidates):
        return found, choice
    most = _takes_most(found, choice.candidates)
    if most is None:
        return found, choice
    # What shows in few rows makes these count for little: by such weights it cannot take as much as
    # is worth a name, however far it stands out. So rows count as they do beside it.
    weighed = _beside(found, [*choice.candidates, most])
    begun = [retaken(weighed, term, found.scene) for term in choice.terms]
    again = choose(weighed, rivals=False, begun=begun, until=_changes_an_arm)
    if _effects(again) == _effects(choice):
        return found, choice
    return _further(weighed, again)


def _takes_most(library: Library, terms: Sequence[Candidate]) -> Candidate | None:
    """Return what takes most beside some terms where all rows count alike; None for too little."""
    rows = library.weighing.rows
    left = {}
    for scored in library.rank(terms)[:_MOST_PROBED]:
        nm = left_nm(library, [*terms, scored.candidate])[rows]
        left[float(nm @ nm)] = scored.candidate
    if not left:
        return None
    least, plain = min(left), left_nm(library, terms)
    floor_nm = max(noise_floor(library.scene.table, plain).value_nm, 0.0)
    before = float(plain[rows] @ plain[rows])
    above = before - floor_nm**2 * rows.shape[0]
    return left[least] if before - least >= A_GOOD_PART * above else None


def _first(library: Library) -> Choice:
    """Return a first choice; with another beginning where that leaves less, and this one much."""
    begun = _asked_about(library)
    choice = choose(library, rivals=False, begun=begun, until=_changes_an_arm)
    if begun or not choice.terms or not _more_than_noise(library, choice.candidates, FAR):
        return choice
    beginning = other_beginning(library, choice)
    if beginning is None:
        return choice
    again = choose(library, rivals=False, begun=[beginning], until=_changes_an_arm)
    return again if decided(library, again, choice) else choice


def _changes_an_arm(library: Library, form: Form, terms: Sequence[Candidate]) -> bool:
    """Return whether arms have other columns beside a form, by what they rub or how they hang.

    As long as what a gap leaves may be there; else the search goes on as it is.
    """
    if form.effect == _SPRUNG:
        return not library.scene.closely and _hangs_otherwise(library, terms)
    if form.effect not in _FRICTION_OF_ARMS:
        return False
    loose = any(c.form.effect == BACKLASH for c in library.candidates)
    return loose and _more_than_noise(library, terms, FAR)


def _hangs_otherwise(library: Library, terms: Sequence[Candidate]) -> bool:
    """Return whether an arm leaves clearly less, followed closely, where it weighs what it weighs.

    It hangs behind the motor by that: of a weight that is a few percent off, or a swing a little
    too fast, what is left is a wave of twice the arm's angle, which a slack hose stands for.
    """
    arms = [c for c in terms if c.form.effect == _SPRUNG]
    theta = numbers_beside(library, terms)
    if not arms or not (theta[:3] >= 0.0).all() or not _more_than_noise(library, terms, FAR):
        return False
    share = arm_share_beside(library, terms)
    closely = replace(library.scene, theta=theta, arm_share=share, closely=True)
    there = on_scene(library, closely)
    moved = together(there, [there.candidate(c.form, c.point) for c in terms])
    return float(there.errors(moved).sum()) < _LESS * float(library.errors(terms).sum())


def _further(library: Library, first: Choice) -> tuple[Library, Choice]:
    """Return what is found in step with a first choice, beside it, and where it pulls."""
    library, choice = _found_beside(*chosen_in_step(library, first))
    pulled, again = chosen_under_its_pull(library, choice)
    if again is not choice:
        library, choice = _found_beside(pulled, again)
    return chosen_with_its_shape(library, choice)


def _found_beside(library: Library, choice: Choice) -> tuple[Library, Choice]:
    """Return a choice with what is found beside it, for as long as that finds others."""
    for _ in range(_ROUNDS):
        if not choice.terms or not _worth_it(library, choice.candidates):
            break
        renewed = _beside(library, choice.candidates)
        begun = [retaken(renewed, term, library.scene) for term in choice.terms]
        again = choose(renewed, rivals=False, begun=begun, until=_changes_an_arm)
        same = _effects(again) == _effects(choice)
        if same and renewed.scene.held is library.scene.held:
            break
        # What was not to be had in step with a delay is not beside the same effects, either.
        refused = same and not library.scene.late_s
        library, choice = (renewed, again) if refused else chosen_in_step(renewed, again)
        if same and not grown(library.scene, _as_beside(library, choice.candidates)):
            break  # what holds the arm is as the laws were taken at: nothing else would be found
    return library, choice


def _asked_about(library: Library) -> list[Term]:
    """Return what the first recordings lack, where others go much further; else nothing.

    There a cable may be far the strongest, and would take an offset with it as where it hangs free.
    """
    usual = usual_blocks(library.scene.table, library.weighing)
    if usual.all():
        return []
    found = choose(library.part(usual), rivals=False)
    return [retaken(library, term, library.scene) for term in found.terms]


def _effects(choice: Choice) -> list[str]:
    return sorted(term.scored.form.effect for term in choice.terms)


def _worth_it(library: Library, terms: Sequence[Candidate]) -> bool:
    """Return whether more than noise is left beside some terms, or heard above the band."""
    if _more_than_noise(library, terms):
        return True
    return library.scene.blows is None and _as_beside(library, terms).blows is not None


def _as_beside(library: Library, terms: Sequence[Candidate]) -> Scene:
    """Return the scene with the twin's numbers, and what holds the arm, as beside some terms."""
    return replace(
        library.scene,
        theta=numbers_beside(library, terms),
        held=held_beside(library, terms),
        ageing=ageing_beside(library, terms),
        yields_rad=yields_beside(terms),
        arm_share=arm_share_beside(library, terms),
    )


def _more_than_noise(library: Library, terms: Sequence[Candidate], times: float = CLOSE) -> bool:
    left = left_nm(library, terms)
    floor_nm = noise_floor(library.scene.table, left).value_nm
    size = float(np.sqrt(np.mean(left[library.weighing.rows] ** 2)))
    return not floor_nm > 0.0 or size > times * floor_nm


def _beside(library: Library, terms: Sequence[Candidate]) -> Library:
    """Return a library whose weights, loads and grids are those beside some terms."""
    left, scene = left_nm(library, terms), library.scene
    beside = _as_beside(library, terms)
    weighing = weigh(scene.table, left)
    ratio = (weighing.weight / library.weighing.weight)[:, np.newaxis]
    renewed = Library(
        replace(scene, residual_nm=left),
        weighing,
        library.target * ratio[:, 0],
        library.base * ratio,
        (),
    )
    for c in (*library.candidates, *terms):
        there = c.kept.at_hand
        own = Kept(renewed.maker(c.form, c.point), None if there is None else there * ratio)
        renewed.known[c.form, c.point] = replace(c, kept=own)
    candidates = tuple(renewed.known[c.form, c.point] for c in library.candidates)
    renewed = replace(renewed, candidates=candidates)
    heard = scene.blows is None and beside.blows is not None
    hangs = not scene.closely and _hangs_otherwise(library, terms)
    moved = hangs or moved_far(library, beside.theta)
    if beside.held is not None or heard or moved or grown(scene, beside):
        closely = scene.closely or hangs
        now = replace(beside, theta=renewed.scene.theta, residual_nm=left, closely=closely)
        renewed = taken_at(replace(renewed, scene=now), beside.theta)
    return with_new_grids(renewed, terms)
