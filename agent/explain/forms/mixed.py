"""Columns that are sums of others, which many points of a form share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.forms.form import Columns, Point
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

Part = tuple[Columns, Point]
"""Columns at full rate, as a form's, and the point at which they are taken."""


@dataclass(frozen=True)
class Mixed:
    """A form's columns, mixed of parts: a filter passes each part once, whoever asks for it.

    A cubic about any angle is a sum of four powers, and filtering is most of what a column costs.

    Parameters
    ----------
    parts : callable
        Point to the parts.
    mix : callable
        (scene, point) to the matrix, shape (q, k), that makes k columns of all parts' q.
    """

    parts: Callable[[Point], Sequence[Part]]
    mix: Callable[[Scene, Point], Floats]

    def __call__(self, scene: Scene, point: Point) -> Floats:
        """Return the columns at full rate, shape (N, k)."""
        return self.of([columns(scene, own) for columns, own in self.parts(point)], scene, point)

    def of(self, parts: Sequence[Floats], scene: Scene, point: Point) -> Floats:
        """Return the columns, shape (m, k), of parts at whatever rows, each (m, q_i)."""
        whole = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)
        return np.asarray(whole @ self.mix(scene, point))
