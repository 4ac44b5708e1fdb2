"""Numbers that a law found lets vary: the twin's own may be right for a part of the recordings.

Friction that drifts, changes with temperature or differs between directions has a level for every
hour, temperature and direction. A fit gives the mean. A twin that was right when the joint was new,
or cold, or in one direction, has no wrong number: it lacks the law. A drift may have begun before
it was recorded, and a run-in may end after. A constant torque is friction
that differs between directions by another name, and there only the one or the other direction's
level counts: between the two no motion shows any.

Friction that bends with speed has a slope for every speed: its own, and what is left of the twin's.

Oil's friction is a constant part and one that falls with warmth without an end (Bittencourt and
Gunnarsson 2012). A twin that has the constant part right and knows of no warmth is below the joint
at every temperature: its number, too, is right.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.numbers.model import Model
from agent.explain.rows.table import BASE
from agent.identify.result import Floats
from agent.physics.twin import Twin

_BEYOND = 0.25  # of the range on either side: a twin's number and a law's ends are fits, too
_BEFORE = 1.0  # of it: a drift may have gone on for as long before as it was recorded
_OF_LARGEST = 0.1  # of a column: with less of it, what a number is there is not to be had
_SLOW = 0.01  # of the speed: there a bend has the slope that it begins with
_ENDS = (0.01, 0.99)
_RUNS_IN, _BENDS = "run_in_nm", "viscous-nonlinear"
_NUMBER: Mapping[str, Mapping[str, str]] = {
    "temperature-dependent-friction": {
        "viscous_thermal_nm_s_per_rad": "viscous_nm_s_per_rad",
        "coulomb_nm_per_k": "coulomb_nm",
    },
    "friction-drift": {
        "coulomb_nm_per_h": "coulomb_nm",
        "viscous_nm_s_per_rad_per_h": "viscous_nm_s_per_rad",
        "coulomb_nm_per_operating_h": "coulomb_nm",
        "viscous_nm_s_per_rad_per_operating_h": "viscous_nm_s_per_rad",
        "coulomb_nm_per_1000_turns": "coulomb_nm",
        "viscous_nm_s_per_rad_per_1000_turns": "viscous_nm_s_per_rad",
        "coulomb_step_nm": "coulomb_nm",
        "viscous_step_nm_s_per_rad": "viscous_nm_s_per_rad",
        _RUNS_IN: "coulomb_nm",
    },
    "direction-asymmetry": {
        "coulomb_difference_nm": "coulomb_nm",
        "viscous_difference_nm_s_per_rad": "viscous_nm_s_per_rad",
    },
    "torque-offset": {"torque_offset_nm": "coulomb_nm"},
    _BENDS: dict.fromkeys(("power_nm", "shear_nm", "plateau_nm"), "viscous_nm_s_per_rad"),
}
_DRIFT = "friction-drift"
_TWO_LEVELS = frozenset({"direction-asymmetry", "torque-offset"})
_FALLS = "viscous_thermal_nm_s_per_rad"
_AS_WELL = 1.05  # of the squared error: the law leaves no more with the twin's number as its limit
_DECAYS_PER_STEP = 1.05


def varied_through_given(library: Library, twin: Twin, model: Model) -> frozenset[str]:
    """Return the twin's numbers that the laws found let vary through what the twin says.

    Parameters
    ----------
    library : Library
    twin : Twin
        As given.
    model : Model
        Base and effects fitted together.
    """
    carried = [BASE[i] for i in np.flatnonzero(library.scene.table.carried)]
    out = set()
    for term, place in zip(model.terms, model.slices(), strict=True):
        form = term.scored.form
        numbers = _NUMBER.get(form.effect, {})
        for at, name in enumerate(form.linear):
            number = numbers.get(name)
            if number not in carried:
                continue
            base = library.base[:, carried.index(number)]
            least = _SLOW if form.effect == _BENDS else _OF_LARGEST
            there = np.abs(base) > least * float(np.max(np.abs(base)))
            added = term.candidate.columns[there, at] * model.coefficients[place][at]
            low, high = np.quantile(added / base[there], _ENDS) + model.base[number].value
            given = float(getattr(twin, number))
            grows = form.effect == _DRIFT and _grows(library, there, added / base[there])
            ends = float(low), float(high)
            passes = _passes(*ends, given, form.effect, grows=grows, settles=name == _RUNS_IN)
            if passes or (name == _FALLS and _falls_to_given(library, model, term, number)):
                out.add(number)
    return frozenset(out)


def _falls_to_given(library: Library, model: Model, warm: Term, number: str) -> bool:
    """Return whether a law that falls with warmth does as well with what the twin says for limit.

    Its own numbers, the decay among them, are fitted anew: it has one number less.
    """
    form, scene = warm.scored.form, library.scene
    at = [BASE[i] for i in np.flatnonzero(scene.table.carried)].index(number)
    others = [t.candidate.columns for t in model.terms if t is not warm]
    rest = np.concatenate((np.delete(library.base, at, axis=1), *others), axis=1)

    def error(decay_k: float) -> float:
        falling = library.columns(form, (decay_k,)).copy()
        falling[:, form.linear.index(_FALLS)] += library.base[:, at]
        return float(library.errors_with(rest, falling).sum())

    free = float(library.errors([t.candidate for t in model.terms]).sum())
    grid = [decay_k for (decay_k,) in form.grid(scene)]
    best = min(grid, key=error)
    step = (grid[-1] / grid[0]) ** (0.5 / (len(grid) - 1))
    while step > _DECAYS_PER_STEP:
        best = min((best / step, best, best * step), key=error)
        step = math.sqrt(step)
    return error(best) <= _AS_WELL * free


def _grows(library: Library, there: NDArray[np.bool_], levels: Floats) -> bool:
    """Return whether a law's levels, of some rows, are higher in the last tenth than in the first.

    Parameters
    ----------
    library : Library
    there : ndarray of bool, shape (m,)
        Of the rows, those of the levels.
    levels : ndarray, shape (l,)
    """
    clock = library.scene.table.rows["elapsed_s"][library.weighing.rows][there]
    in_time = levels[np.argsort(clock, kind="stable")]
    tenth = max(1, in_time.shape[0] // 10)
    return bool(np.mean(in_time[-tenth:]) > np.mean(in_time[:tenth]))


def _passes(
    low: float, high: float, given: float, effect: str, *, grows: bool, settles: bool
) -> bool:
    """Return whether what the twin says lies where the law goes, nearly.

    Or, of friction that drifts, where it came from: it may have begun before it was recorded. And
    what settles is where it goes to, which a recording of its way there hardly tells.
    """
    margin = _BEYOND * (high - low)
    if effect in _TWO_LEVELS:
        return min(abs(given - low), abs(given - high)) <= margin
    below = above = margin
    if effect == _DRIFT:
        before = _BEFORE * (high - low)
        below, above = (before, margin) if grows else (margin, before)
        if settles:
            below = above = before
    return low - below <= given <= high + above
