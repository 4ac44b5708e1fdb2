"""Effects beside a late torque, looked for in step with it.

A torque that is 25 ms later than the motion has a wave of the motor's angle in another phase at
every speed: no wave fits, and two or three of several kinds stand for it. Once the delay is known,
every other law is taken as late as it is, and all are chosen anew beside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.candidate import Candidate, Scored
from agent.explain.choosing.choice import Choice, choose
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import DELAY, Library
from agent.explain.forms.order import waves_of
from agent.explain.forms.orders import ORDER, strong_orders
from agent.explain.forms.signal import CLOSELY_S, REACH_S, nearest_delay, turn_s, turning_round
from agent.explain.numbers.polish import polished
from agent.explain.numbers.renewed import left_nm, retaken, with_new_grids
from agent.explain.rows.evidence import solve, weigh
from agent.explain.rows.lag import earlier_by_stretch
from agent.explain.rows.slow_motion import by_slow_motion, slowly
from agent.explain.rows.table import BASE, without_edges
from agent.identify.result import Floats
from agent.physics.effects.library import CARRIED

_ROUNDS = 3
_ORDERS = 3
_LAG_SHARES = (0.4, 0.8)  # of a delay, that a low-pass may have
_SHORTEST_LAG = 0.1  # of the one that was found first
_CLEARLY = 0.02  # of what is left: for less a delay is one
_SETTLED = 0.03  # of a delay: moved by less, it leaves every law where it is


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
        delay = _delay(best)
        if delay is None:
            break
        # Shorter ones move no wave far: there one column for all that is late does, and follows
        # every number that is moved after it.
        if abs(float(delay.scored.coefficients[0])) < turn_s(library.scene.table):
            break
        others = [term for term in best.terms if term is not delay]
        late_s, lag_s, theta = _found_late(found, others, float(delay.scored.coefficients[0]))
        if abs(late_s - found.scene.late_s) < max(_SETTLED * abs(late_s), CLOSELY_S):
            break
        moved = _moved(found, late_s, lag_s, theta)
        own = moved.candidate(delay.scored.form, (late_s,))
        begun = [replace(delay, scored=replace(delay.scored, candidate=own))]
        again = choose(with_new_grids(moved, [own]), rivals=False, begun=begun, held=True)
        if _delay(again) is None or left_share(again) > left_share(best):
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
    delay, before = _delay(choice), library.scene
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
    if library.scene.late_s or _delay(choice) is not None:
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
    return None if _delay(again) is None else (moved, again)


def _delay(choice: Choice) -> Term | None:
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
    target = weighing.weighted(table.target_nm + carried_nm)
    each = [(piece.rows, piece.period_s * piece.stride) for piece in table.pieces]
    on_time = table.band(raw)

    def fit(late_s: float, apart: NDArray[np.bool_], lag_s: float = 0.0) -> tuple[float, Floats]:
        late = table.band(replace(scene, late_s=late_s, lag_s=lag_s).as_late(raw))
        return _least(weighing.weighted(late)[apart], target[apart])

    def slow_fit(late_s: float, apart: NDArray[np.bool_]) -> tuple[float, Floats]:
        # What is slow is shifted well enough from row to row.
        late = weighing.weighted(earlier_by_stretch(on_time, each, -late_s))
        both = slowly(table, weighing, np.column_stack((late, target)) * apart[:, np.newaxis])
        return _least(both[:, :-1], both[:, -1])

    def seen_at(late_s: float) -> NDArray[np.bool_]:
        return without_edges(table, table.creep_rad_s, late_s).used[weighing.rows]

    # A wave of the band fits again a turn later: each valley is looked into, the deepest followed.
    apart, step_s = seen_at(near_s), turn_s(table)
    steps = math.floor(REACH_S / step_s)
    valleys = [near_s + k * step_s for k in range(-steps, steps + 1)]
    late_s = min(valleys, key=partial(_error, fit, apart))
    apart = seen_at(late_s)
    late_s = nearest_delay(partial(_error, fit, apart), late_s, min(step_s, REACH_S))
    slowest = partial(_error, slow_fit, seen_at(late_s))
    ends = [nearest_delay(slowest, at_s, min(step_s, REACH_S)) for at_s in (late_s, near_s)]
    late_s = min(ends, key=slowest)
    late_s, lag_s = _smoothed(partial(fit, apart=apart), late_s, min(step_s, REACH_S))
    theta = scene.as_given.copy()
    theta[carried] = fit(late_s, apart, lag_s)[1][: carried.size]
    return late_s, lag_s, theta


def _smoothed(
    fit: Callable[..., tuple[float, Floats]], late_s: float, reach_s: float
) -> tuple[float, float]:
    """Return a delay, and what a low-pass has of it: nothing where that leaves hardly less.

    Far below its corner a low-pass is a delay as long as its time constant; nearer to it what is
    fast is less late, and smaller.
    """
    plain = fit(late_s)[0]
    if late_s <= 0.0:  # the motion is late, and not what was filtered
        return late_s, 0.0
    best = plain, late_s, 0.0
    for share in _LAG_SHARES:
        late = nearest_delay(partial(_error_behind, fit, share), late_s, reach_s)
        if late > 0.0:
            best = min(best, (fit(late, lag_s=share * late)[0], late, share * late))
    left, late, lag_s = best
    if left >= (1.0 - _CLEARLY) * plain:
        return late_s, 0.0
    return _together(fit, late, lag_s)


def _together(
    fit: Callable[..., tuple[float, Floats]], late_s: float, lag_s: float
) -> tuple[float, float]:
    """Return where both lead together: one lengthens as the other gets shorter."""
    from scipy.optimize import minimize

    def error(parts: Floats) -> float:
        dead, lag = (float(part) for part in parts)
        return fit(dead + lag, lag_s=lag)[0]

    begun = np.array([late_s - lag_s, lag_s])
    found = minimize(
        error,
        begun,
        method="Nelder-Mead",
        bounds=[(-math.inf, math.inf), (_SHORTEST_LAG * lag_s, math.inf)],
        options={"xatol": CLOSELY_S, "fatol": 1e-4 * error(begun)},
    )
    dead, lag = (float(part) for part in found.x)
    return dead + lag, lag


def _error_behind(fit: Callable[..., tuple[float, Floats]], share: float, late_s: float) -> float:
    # Where the torque is early nothing was filtered: a low-pass that foretells runs away.
    return fit(late_s, lag_s=share * max(late_s, 0.0))[0]


def _least(columns: Floats, target: Floats) -> tuple[float, Floats]:
    """Return the least sum of squares, and the weights of the columns that leave it."""
    theta = solve(columns.T @ columns, columns.T @ target)
    left = target - columns @ theta
    return float(left @ left), theta


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


def _error(
    fit: Callable[[float, NDArray[np.bool_]], tuple[float, Floats]],
    rows: NDArray[np.bool_],
    late_s: float,
) -> float:
    return fit(late_s, rows)[0]


def _moved(library: Library, late_s: float, lag_s: float, theta: Floats) -> Library:
    """Return a library with every law but the delay itself as late as the torque.

    Where the torque starts and turns round are edges as much as where the motion does.
    """
    scene = library.scene
    table = without_edges(scene.table, scene.table.creep_rad_s, late_s)
    scene = replace(scene, table=table, theta=theta, late_s=late_s, lag_s=lag_s)
    forms = tuple(dict.fromkeys(c.form for c in library.candidates))
    return Library.of(scene, weigh(table, left_nm(library, ())), forms)
