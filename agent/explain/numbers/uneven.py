"""The interval of a number along which the squared error is uneven.

Where an arm bounces in its gap, the error over the half gap has many small valleys, and is some
percent above the noise at the true one: a few bounces that no mean of paths foretells. A likelihood
takes each of them for knowledge of the gap. But bounces that one gap foretells by luck another does
not, here and there in the recordings: all else is fitted again at each gap, and of two gaps one is
worse where it is so by more than its blocks differ by chance (Vuong, Econometrica 57 (1989) 307).
A cycle that is driven again bounces again: whole recordings, and what is alike in all of them, may
differ by chance as well, and the greatest of the three chances counts. Nor is the number known more
finely than the form itself takes it: a gap's is the mean of some that differ by a few percent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.candidate import basis_of
from agent.explain.choosing.descent import Movable, descended, movable
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.choosing.valleys import scene_beside
from agent.explain.forms.form import Form, Point
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats, Parameter
from agent.identify.uncertainty import student_975

_FACTORS = (1.03, 1.07, 1.12, 1.19, 1.28, 1.4, 1.6, 2.0, 2.6)
_ROUNDS = 5
_FEWEST = 3  # groups of blocks: of fewer nobody knows by how much they differ
_OF_MANY = 1.6  # of a normal's 97.5 % quantile: its 99.9 %, as the best is one of many trials
_SURE = 2  # trials in a row that are worse: one may be in a bad valley of the others


@dataclass(frozen=True)
class _Trial:
    """All else fitted at one value of the number: where, and what every block is left, (b,)."""

    value: float
    point: Point
    blocks: Floats

    @property
    def error(self) -> float:
        return float(self.blocks.sum())


def compared(
    library: Library,
    terms: Sequence[Term],
    index: int,
    number: int,
    at_least: tuple[float, float] | None = None,
) -> Parameter:
    """Return a non-linear number with the interval that a comparison by blocks gives it.

    Parameters
    ----------
    library : Library
    terms : sequence of Term
    index, number : int
        Which term, and which of its non-linear numbers, above zero. The term's other numbers, all
        coefficients and the twin's numbers are fitted again at every trial.
    at_least : (float, float), optional
        An interval that is known already; the number's is no narrower.
    """
    term = terms[index]
    form, start = term.scored.form, term.candidate.point
    value = float(start[number])
    others = library.model([t.candidate for i, t in enumerate(terms) if i != index])
    grid = np.array([c.point for c in library.candidates if c.form is form])
    numbers = [m for m in movable(0, form, library.scene, grid) if m.place != number]
    best = here = _trial(library, form, start, value, others)
    scene = scene_beside(library, [t.candidate for i, t in enumerate(terms) if i != index])
    groups, ends = _groups(library), []
    for side in (-1.0, 1.0):
        trials, worse = [here], 0
        for factor in _FACTORS:
            at = value * factor**side
            trial = _best_at(library, scene, form, numbers, number, at, trials, others)
            trials.append(trial)
            best = min(best, trial, key=lambda each: each.error)
            worse = worse + 1 if _worse(trial, best, groups) > 0.0 else 0
            if worse == _SURE:
                break
        ends.append(trials)
    low, high = (_end(trials, best, groups) for trials in ends)
    if not (math.isfinite(low) and math.isfinite(high)):
        return Parameter.not_identified("the squared error hardly depends on it", value)
    known = at_least or (value, value)
    resolved = start[form.nonlinear.index(form.uneven[form.nonlinear[number]])] * value
    below = math.hypot(value - min(low, known[0]), resolved)
    above = math.hypot(max(high, known[1]) - value, resolved)
    return Parameter(value, (value - below, value + above))


def _best_at(
    library: Library,
    scene: Scene,
    form: Form,
    numbers: Sequence[Movable],
    number: int,
    value: float,
    before: Sequence[_Trial],
    others: Floats,
) -> _Trial:
    """Return the best fit at a value: from the last one's other numbers, and from new ones."""
    last = list(before[-1].point)
    last[number] = value
    starts = [tuple(last)]
    if form.elsewhere is not None:
        anew = form.elsewhere(scene, tuple(last), False)
        here = [point for point in anew if point[number] == value and point != starts[0]]
        starts += sorted(here, key=lambda p: _trial(library, form, p, value, others).error)[:1]
    trials = []
    for start in starts:
        (point,) = descended(
            (start,),
            numbers,
            lambda _, at: library.columns(form, at),
            others,
            library.target,
            lambda _, own: form.allows(own),
            _ROUNDS,
        )
        trials.append(_trial(library, form, point, value, others))
    return min(trials, key=lambda each: each.error)


def _trial(library: Library, form: Form, point: Point, value: float, others: Floats) -> _Trial:
    basis = basis_of(np.concatenate((others, library.columns(form, point)), axis=1))
    left = library.target - basis @ (basis.T @ library.target)
    return _Trial(value, point, np.add.reduceat(left**2, library.weighing.starts))


def _groups(library: Library) -> list[NDArray[np.int64]]:
    """Return the blocks by themselves, by recording, and by when in its recording each began."""
    weighing, table = library.weighing, library.scene.table
    began = table.rows["time_s"][weighing.rows[weighing.starts]]
    run = weighing.run[weighing.starts]
    for each in np.unique(run):
        began[run == each] -= began[run == each].min()
    length_s = max(float(np.median(np.abs(np.diff(began)))), 1e-9)
    kinds = np.arange(run.shape[0]), run, np.floor(began / length_s + 0.5)
    numbers = [np.unique(kind, return_inverse=True)[1].reshape(-1) for kind in kinds]
    return [kind for kind in numbers if int(kind.max()) + 1 >= _FEWEST]


def _worse(trial: _Trial, best: _Trial, groups: Sequence[NDArray[np.int64]]) -> float:
    """Return by how much more a trial leaves than chance among the blocks; above zero is worse."""
    more = trial.blocks - best.blocks
    chance = 0.0
    for kind, group in enumerate(groups):
        each = np.bincount(group, more)
        count = each.shape[0]
        spread = float(np.std(each, ddof=1)) * math.sqrt(count)
        chance = max(chance, (1.0 if kind else _OF_MANY) * student_975(count - 1.0) * spread)
    return float(np.sum(more)) - chance


def _end(trials: Sequence[_Trial], best: _Trial, groups: Sequence[NDArray[np.int64]]) -> float:
    """Return where trials, from the middle outwards, become worse; not finite where they do not."""
    worse = [_worse(trial, best, groups) for trial in trials]
    inside = max((k for k, by in enumerate(worse) if by <= 0.0), default=0)
    if inside + 1 == len(trials):
        return math.nan
    near, far = worse[inside], worse[inside + 1]
    part = near / (near - far) if near < 0.0 else 0.0
    inner, outer = trials[inside].value, trials[inside + 1].value
    return float(inner * (outer / inner) ** part)
