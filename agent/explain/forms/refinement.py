"""How a grid's best point is moved: by the grid's own spacing, within what physics allows."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.forms.form import Form, Point, Proportional
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_ROUNDS = 5
_FEW = 2  # non-linear numbers: more hang together, and none is followed far by itself
_MOST_STEPS = 6  # one way


@dataclass(frozen=True)
class Step:
    """How far a number is moved at first: in proportion to it, or by itself."""

    size: float
    proportional: bool

    def __call__(self, value: float) -> float:
        """Return the step at a value."""
        return self.size * abs(value) if self.proportional else self.size


def climbed(
    form: Form,
    scene: Scene,
    points: Floats,
    best: Point,
    gain: float,
    gain_at: Callable[[Point], float],
) -> tuple[float, Point]:
    """Move the best point of a grid, one number after the other, ever more finely.

    In the first round a number goes on as long as it helps, within the grid: a coarse grid's best
    point may be several steps from the top.

    Parameters
    ----------
    form : Form
    scene : Scene
    points : ndarray, shape (g, k)
        The grid.
    best : tuple of float
        Its best point.
    gain : float
        There.
    gain_at : callable
        Point to what it gains.

    Returns
    -------
    gain : float
    best : tuple of float
    """
    steps, limits = steps_of(form, scene, points), limits_of(form, scene, points)
    spans = list(zip(points.min(axis=0), points.max(axis=0), strict=True))
    for round_ in range(_ROUNDS):
        far = _MOST_STEPS if round_ == 0 and len(steps) <= _FEW else 1
        for i, step in enumerate(steps):
            for side in (-(0.5 ** (round_ + 1)), 0.5 ** (round_ + 1)):
                for low, high in (limits[i], *(spans[i],) * (far - 1)):
                    at = best[i] + side * step(best[i])
                    trial = (*best[:i], at, *best[i + 1 :])
                    if not low <= at <= high or not (found := gain_at(trial)) > gain:
                        break
                    gain, best = found, trial
    return gain, best


def steps_of(form: Form, scene: Scene, points: Floats) -> Sequence[Step]:
    """Return the first step of every non-linear number; `points`, shape (g, k), is its grid."""
    if form.step is not None:
        return [Step(x, proportional=isinstance(x, Proportional)) for x in form.step(scene)]
    return [_spacing(points[:, i]) for i in range(points.shape[1])]


def limits_of(form: Form, scene: Scene, points: Floats) -> Sequence[tuple[float, float]]:
    """Return how far each non-linear number may be moved; what starts positive stays so."""
    if form.limits is not None:
        return form.limits(scene)
    lowest = points.min(axis=0)
    return [
        (1e-3 * float(low) if low > 0.0 else (0.0 if low == 0.0 else -math.inf), math.inf)
        for low in lowest
    ]


def _spacing(values: Floats) -> Step:
    """Return how far the grid's points are apart, in proportion or in absolute terms."""
    unique = np.unique(values)
    if unique.size < 2:
        return Step(0.0, proportional=False)
    ratio = unique[1:] / unique[:-1] if unique[0] > 0.0 else np.zeros(1)
    steps = np.diff(unique)
    proportional = bool(unique[0] > 0.0 and np.ptp(ratio) < np.ptp(steps / steps.mean()))
    size = float(np.median(ratio)) - 1.0 if proportional else float(np.median(steps))
    return Step(size, proportional=proportional)
