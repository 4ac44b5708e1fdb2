"""How far a grid's best point may be moved: the grid's own spacing, and what physics allows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.form import Form
from agent.explain.scene import Scene
from agent.identify.result import Floats


@dataclass(frozen=True)
class Step:
    """How far a number is moved at first: in proportion to it, or by itself."""

    size: float
    proportional: bool

    def __call__(self, value: float) -> float:
        """Return the step at a value."""
        return self.size * abs(value) if self.proportional else self.size


def steps_of(form: Form, scene: Scene, points: Floats) -> Sequence[Step]:
    """Return the first step of every non-linear number; `points`, shape (g, k), is its grid."""
    if form.step is not None:
        return [Step(size, proportional=False) for size in form.step(scene)]
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
