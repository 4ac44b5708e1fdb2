"""The numbers of an arm on a spring, freed of what the measured motion's noise makes of them.

The arm is simulated behind the measured motion, whose noise shakes it. Least squares then make
the swing smaller, softer and more damped than it is, so that it is shaken less: the numbers that
predict best behind this noisy motion are not the gear's. What noise of the same size adds to the
columns is simulated, and taken out of the normal equations (corrected least squares; Fuller,
Measurement Error Models, Wiley 1987, chapter 3).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from agent.explain.choosing.search import Library
from agent.explain.forms.form import Form, Point
from agent.explain.forms.hidden_arm import inertia_of
from agent.explain.forms.refinement import limits_of
from agent.explain.numbers.model import Model
from agent.explain.numbers.noisier import Noisier, inertia_at, noisier
from agent.identify.result import Floats, Parameter

_FORMS = ("one spring", "one spring, and an arm with friction")
_SHAKEN = 0.03  # of a swing's energy: less noise in it bends no number beyond its interval
_MOST_SHAKEN = 0.5  # more, and noise is all that is known of it
_TRIALS = 120
_FIRST_MOVE = 0.1
_FARTHEST = 4.0  # times a number, up or down
_HOW_WELL = 0.5  # of the correction, to either side: other laws' numbers stay where noise bent them
UNKNOWN = (
    "the motion's noise shakes the simulated arm so strongly that what predicts these recordings "
    "best says nothing of the gear"
)
"""Why an arm's numbers are not identified, where the noise hides them."""


class _Fit(NamedTuple):
    """What corrected least squares leave at a point, and the coefficients, shape (p,)."""

    left: float
    coefficients: Floats


@dataclass(frozen=True)
class _Shaken:
    """A model with one arm, on the measured motion and on two that are noisier."""

    library: Library
    form: Form
    others: Floats
    behind: tuple[Noisier, ...]
    inertia_at: int

    def columns(self, point: Point) -> tuple[Floats, Floats]:
        """Return all columns, shape (m, p), and the products of their noise, shape (p, p)."""
        own = self.library.columns(self.form, point)[:, 0]
        noise = np.zeros((self.others.shape[1] + 1,) * 2)
        pair = [self.inertia_at, -1] if self.inertia_at >= 0 else [-1]
        for other in self.behind:
            of_arm = other.library.columns(self.form, point)[:, 0] - own
            added = (other.inertia_noise, of_arm) if len(pair) > 1 else (of_arm,)
            both = np.stack(added, axis=-1)
            noise[np.ix_(pair, pair)] += both.T @ both / len(self.behind)
        return np.column_stack((self.others, own)), noise

    def fit(self, point: Point) -> _Fit:
        """Return the corrected fit; without an end where the noise is all that the columns are."""
        columns, noise = self.columns(point)
        target = self.library.target
        gram, moment = columns.T @ columns - noise, columns.T @ target
        size = np.sqrt(np.maximum(np.diag(columns.T @ columns), 1e-300))
        try:
            lower = np.linalg.cholesky(gram / np.outer(size, size))
        except np.linalg.LinAlgError:
            return _Fit(np.inf, np.full(size.shape[0], np.nan))
        half = np.linalg.solve(lower, moment / size)
        theta = np.linalg.solve(lower.T, half) / size
        return _Fit(float(target @ target - half @ half), theta)

    def shaken(self, point: Point) -> float:
        """Return the noise's part of the arm's column beside all others."""
        columns, noise = self.columns(point)
        own, others = columns[:, -1], columns[:, :-1]
        left = own - others @ np.linalg.lstsq(others, own, rcond=None)[0]
        return float(noise[-1, -1] / max(left @ left, 1e-300))


def unshaken(library: Library, model: Model) -> Mapping[int, Mapping[str, Parameter]]:
    """Return what the numbers of an arm on a spring are without the motion's noise, by term.

    Nothing where the noise hardly shakes it, or no arm was found.

    Parameters
    ----------
    library : Library
    model : Model
        Fitted to the library, with intervals.
    """
    out = {}
    for index, term in enumerate(model.terms):
        form = term.scored.form
        if form.effect != "joint-flexibility" or form.name not in _FORMS:
            continue
        case = _case(library, model, index)
        point = term.candidate.point
        share = case.shaken(point)
        if share < _SHAKEN:
            continue
        own = model.parameters[index]
        found = None if share > _MOST_SHAKEN else _corrected(case, point, own)
        out[index] = _not_known(form, own) if found is None else found
    return out


def _case(library: Library, model: Model, index: int) -> _Shaken:
    """Return what one arm is judged by."""
    others = library.model([t.candidate for i, t in enumerate(model.terms) if i != index])
    form = model.terms[index].scored.form
    return _Shaken(library, form, others, noisier(library), inertia_at(library))


def _corrected(
    case: _Shaken, point: Point, own: Mapping[str, Parameter]
) -> Mapping[str, Parameter] | None:
    """Return the numbers that corrected least squares end at; None where they end nowhere."""
    form, scene = case.form, case.library.scene
    grid = np.array([c.point for c in case.library.candidates if c.form is form])
    if not grid.size:
        return None
    limits = limits_of(form, scene, grid)
    end = _end(case, point, limits)
    inertia = float(case.fit(end).coefficients[-1])
    before = own[form.linear[0]].value
    most = min(_FARTHEST * before, inertia_of(scene))
    if not before / _FARTHEST < inertia < most:  # nor where it is no number
        return None
    names = (*form.nonlinear, form.linear[0])
    numbers = zip(names, (*end, inertia), (*limits, (0.0, np.inf)), strict=True)
    return {name: _freed(own[name], value, within) for name, value, within in numbers}


def _end(case: _Shaken, point: Point, limits: Sequence[tuple[float, float]]) -> Point:
    """Return the point at which corrected least squares leave least.

    What is zero stays so: an arm without friction of its own.
    """
    from scipy.optimize import minimize

    free = [k for k, value in enumerate(point) if value > 0.0]
    bounds = [
        (
            math.log(max(min(limits[k][0], point[k]), point[k] / _FARTHEST)),
            math.log(min(max(limits[k][1], point[k]), point[k] * _FARTHEST)),
        )
        for k in free
    ]
    start = np.log(np.array(point)[free])

    def moved(at: Floats) -> Point:
        whole = np.array(point)
        whole[free] = np.exp(at)
        return tuple(whole.tolist())

    def left(at: Floats) -> float:
        return case.fit(moved(at)).left

    options: Any = {  # scipy's stubs know no simplex to begin with
        "maxfev": _TRIALS,
        "xatol": 1e-3,
        "fatol": 1e-5 * max(left(start), 0.0),
        "initial_simplex": start + _FIRST_MOVE * np.vstack((0.0 * start, np.eye(len(free)))),
    }
    return moved(minimize(left, start, method="Nelder-Mead", bounds=bounds, options=options).x)


def _freed(own: Parameter, value: float, within: tuple[float, float]) -> Parameter:
    """Return a number where it is without the noise, known less well for having been moved."""
    if own.ci95 is None:
        return replace(own, value=value)
    moved = _HOW_WELL * abs(value - own.value)
    wider = max(value / own.value, 1.0) if own.value else 1.0
    low, high = (value + wider * (end - own.value) for end in own.ci95)
    return replace(
        own, value=value, ci95=(max(low - moved, within[0]), min(high + moved, within[1]))
    )


def _not_known(form: Form, own: Mapping[str, Parameter]) -> Mapping[str, Parameter]:
    lost = (*form.linear, *form.nonlinear)
    return {name: Parameter.not_identified(UNKNOWN, own[name].value) for name in lost}
