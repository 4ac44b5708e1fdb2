"""Effects beside a late torque, looked for in step with it.

A torque that is 25 ms later than the motion has a wave of the motor's angle in another phase at
every speed: no wave fits, and two or three of several kinds stand for it. Once the delay is known,
every other law is taken as late as it is, and all are chosen anew beside it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.candidate import Candidate, Scored
from agent.explain.choosing.choice import Choice, choose
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.choosing.weighted import DELAY
from agent.explain.forms.order import waves_of
from agent.explain.forms.orders import ORDER, strong_orders
from agent.explain.forms.signal import CLOSELY_S, REACH_S, nearest_delay, turn_s, turning_round
from agent.explain.numbers.low_pass import Late, least, smoothed
from agent.explain.numbers.polish import polished
from agent.explain.numbers.renewed import left_nm, retaken, with_new_grids
from agent.explain.rows.evidence import weigh
from agent.explain.rows.lag import earlier_by_stretch
from agent.explain.rows.slow_motion import by_slow_motion, slowly
from agent.explain.rows.table import BASE, without_edges
from agent.identify.result import Floats
from agent.physics.effects.library import CARRIED

_ROUNDS = 3
_ORDERS = 3
_SETTLED = 0.03  # of a delay: moved by less, it leaves every law where it is
_TURNED = 0.1  # rad, of the fastest wave: a delay that moves it by less leaves the choice as it is


def chosen_in_step(library: Library, choice: Choice) -> tuple[Library, Choice]:
    """Choose anew beside a delay that a choice has, every other law as late as that.

    Parameters
    ----------
    library : Library
    choice : Choice
        Not settled yet.

    Returns
    -------
    library, choice
        The same where nothing is late, or hardly, or being in step leaves no less on unseen data.
    """
    found, best = library, choice
    for _ in range(_ROUNDS):
        delay = delay_of(best)
        if delay is None:
            break
        # Shorter ones move no wave far: there one column for all that is late does, and follows
        # every number that is moved after it.
        if abs(float(delay.scored.coefficients[0])) < turn_s(library.scene.table):
            break
        others = [term for term in best.terms if term is not delay]
        late_s, lag_s, theta = _found_late(found, others, float(delay.scored.coefficients[0]))
        near_s = max(_SETTLED * abs(late_s), CLOSELY_S, _TURNED * turn_s(found.scene.table))
        if abs(late_s - found.scene.late_s) < near_s:
            break
        moved = _moved(found, late_s, lag_s, theta)
        own = moved.candidate(delay.scored.form, (late_s,))
        begun = [replace(delay, scored=replace(delay.scored, candidate=own))]
        again = choose(with_new_grids(moved, [own]), rivals=False, begun=begun, held=True)
        if delay_of(again) is None or left_share(again) > left_share(best):
            break
        found, best = moved, again
    return found, best


def late_beside(library: Library, choice: Choice) -> tuple[Library, Choice]:
    """Return a model that is as late as it asks for itself, all of it.

    The delay in step was found beside the effects as they stood before they were settled; a gap or
    a wobble that has moved since asks for another one.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.

    Returns
    -------
    library, choice
        The same where nothing is late, or hardly, or being in step leaves no less on unseen data.
        Else a library with this delay from now on; its candidates stay as they were made.
    """
    delay, before = delay_of(choice), library.scene
    if delay is None:
        return library, choice
    near_s = float(delay.scored.coefficients[0])
    if abs(near_s) < turn_s(before.table):
        return library, choice
    others = [term for term in choice.terms if term is not delay]
    late_s, lag_s, _ = _found_late(library, others, near_s)
    if abs(late_s) < turn_s(before.table) or abs(late_s - before.late_s) < CLOSELY_S:
        return library, choice
    again = replace(library, scene=replace(before, late_s=late_s, lag_s=lag_s), known={})
    own = again.candidate(delay.scored.form, (late_s,))
    terms = tuple(
        replace(delay, scored=replace(delay.scored, candidate=own))
        if term is delay
        else retaken(again, term, before)
        for term in choice.terms
    )
    moved = polished(again, replace(choice, terms=terms))
    if float(moved.full.sum()) > float(choice.full.sum()):
        return library, choice
    return again, moved


def begun_late(library: Library, choice: Choice) -> tuple[Library, Choice] | None:
    """Return what is found beside a delay that slow motion surely has, and a choice lacks.

    Out of step a wave and a delay may hide each other from a search, and an arm stand for both.

    Parameters
    ----------
    library : Library
    choice : Choice
        Not settled. But for an arm, which may stand for a delay, its terms are begun with as well.

    Returns
    -------
    library, choice
        In step with the delay; None where slow motion has none, or it is of no use.
    """
    if library.scene.late_s or delay_of(choice) is not None:
        return None
    trial = next((c for c in library.candidates if c.form.effect == DELAY), None)
    if trial is None:
        return None
    others = [term.candidate for term in choice.terms]
    table, weighing = library.scene.table, library.weighing
    columns = np.concatenate([trial.columns, library.model(others)], axis=1)
    slow = by_slow_motion(table, weighing, columns, library.target, 0.0)
    if abs(slow.value) < turn_s(table) or not slow.known:
        return None
    kept = [t for t in choice.terms if t.scored.form.effect not in CARRIED]
    late_s, lag_s, theta = _found_late(library, kept, slow.value)
    moved = _moved(library, late_s, lag_s, theta)
    own = moved.candidate(trial.form, (late_s,))
    begun = [Term(Scored(own, np.array([late_s]), 0.0, moved.errors([own])), 0.0)]
    begun += [retaken(moved, term, library.scene) for term in kept]
    moved = with_new_grids(moved, [term.candidate for term in begun])
    again = choose(moved, rivals=False, begun=begun, held=True)
    return None if delay_of(again) is None else (moved, again)


def delay_of(choice: Choice) -> Term | None:
    """Return a choice's delay of the torque, if it has one."""
    return next((term for term in choice.terms if term.scored.form.effect == DELAY), None)


def left_share(choice: Choice) -> float:
    """Return which share of the squared error on unseen data a choice leaves."""
    return float(choice.full.sum()) / float(choice.plain.sum())


def _found_late(
    library: Library, terms: Sequence[Term], near_s: float
) -> tuple[float, float, Floats]:
    """Return the delay that fits best, what a low-pass has of it, and the twin's numbers, (5,).

    The delay's column is made of numbers that an undelayed fit has bent. Here all columns are late,
    so that one number is searched for and nothing leans on a first guess. Nor on the waves that
    were found beside it: one that was fitted out of step with the torque holds the delay where it
    is, so that every order has waves of torque and acceleration beside, in whatever phase.

    Parameters
    ----------
    library : Library
    terms : sequence of Term
        The model but for the delay.
    near_s : float
        As it was found, by as much as `REACH_S` from the delay.
    """
    scene = library.scene
    carried = np.flatnonzero(scene.table.carried)
    parts = [
        turning_round(replace(scene, theta=unit, held=None, beside=(), late_s=0.0))
        for unit in np.eye(len(BASE))[carried]
    ]
    others = [term.candidate for term in terms]
    own = [c.form.columns(scene, c.point) for c in others]
    raw = np.column_stack([*parts, *own, *_waves(library, others)])
    table, weighing = scene.table, library.weighing
    # What is not carried stays as given, on time.
    carried_nm = table.base[:, carried] @ scene.as_given[carried]
    late = Late(library, raw, weighing.weighted(table.target_nm + carried_nm))
    each = [(piece.rows, piece.period_s * piece.stride) for piece in table.pieces]

    def slowly_left(late_s: float, apart: NDArray[np.bool_]) -> float:
        # What is slow is shifted well enough from row to row.
        moved = weighing.weighted(earlier_by_stretch(late.on_time, each, -late_s))
        both = np.column_stack((moved, late.target)) * apart[:, np.newaxis]
        both = slowly(table, weighing, both)
        return least(both[:, :-1], both[:, -1])[0]

    def seen_at(late_s: float) -> NDArray[np.bool_]:
        return without_edges(table, table.creep_rad_s, late_s).used[weighing.rows]

    # A wave of the band fits again a turn later: each valley is looked into, the deepest followed.
    apart, step_s = seen_at(near_s), turn_s(table)
    steps, reach_s = math.floor(REACH_S / step_s), min(step_s, REACH_S)
    valleys = [near_s + k * step_s for k in range(-steps, steps + 1)]
    late_s = min(valleys, key=lambda valley: late.left(valley, apart))
    apart = seen_at(late_s)
    late_s = nearest_delay(partial(late.left, rows=apart), late_s, reach_s)
    slowest = partial(slowly_left, apart=seen_at(late_s))
    ends = [nearest_delay(slowest, at_s, reach_s) for at_s in (late_s, near_s)]
    late_s, lag_s = smoothed(late, min(ends, key=slowest), reach_s, apart)
    theta = scene.as_given.copy()
    theta[carried] = late.fit(late_s, apart, lag_s)[1][: carried.size]
    return late_s, lag_s, theta


def _waves(library: Library, others: Sequence[Candidate]) -> list[Floats]:
    """Return waves of the orders that stand out beside a model but for its delay, (N, 4) each."""
    scene = library.scene
    if not scene.has("position_rad"):
        return []
    beside = replace(scene, residual_nm=scene.on_time(left_nm(library, others)))
    orders = strong_orders(beside, "inertia")[:_ORDERS]
    there = (dict(zip(c.form.nonlinear, c.point, strict=True)).get(ORDER) for c in others)
    wanted = dict.fromkeys((*(order for order in there if order is not None), *orders))
    return [waves_of(scene, order) for order in wanted]


def _moved(library: Library, late_s: float, lag_s: float, theta: Floats) -> Library:
    """Return a library with every law but the delay itself as late as the torque.

    Where the torque starts and turns round are edges as much as where the motion does.
    """
    scene = library.scene
    table = without_edges(scene.table, scene.table.creep_rad_s, late_s)
    scene = replace(scene, table=table, theta=theta, late_s=late_s, lag_s=lag_s)
    forms = tuple(dict.fromkeys(c.form for c in library.candidates))
    return Library.of(scene, weigh(table, left_nm(library, ())), forms)
