"""From a coarse grid towards the point whose column the residual resembles most."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

Point = tuple[float, ...]

_FIRST, _LAST = 0.2, 0.02  # of a number: the search's widest and its finest step
_STARTS = 2  # coarse points that are followed: the best one may lie in the wrong valley


def downhill(
    scene: Scene,
    column: Callable[[Scene, Point], Floats],
    coarse: Sequence[Point],
    limits: Sequence[tuple[float, float]],
    trials: int,
    *,
    worth: float = 0.0,
) -> tuple[Point, ...]:
    """Return where a pattern search leads from the best of some points, the best end first.

    Every number is moved by the same share, up and down, for as long as that helps; then the share
    is halved (Hooke and Jeeves, J. ACM 8 (1961) 212).

    Parameters
    ----------
    scene : Scene
    column : callable
        (scene, point) to one full-rate column, shape (N, 1).
    coarse : sequence of tuple of float
        A number that is zero is not moved.
    limits : sequence of (float, float)
        Between which every number stays.
    trials : int
        How often a column may be computed from each of them.
    worth : float
        Share of what is left that the best of these points must account for, or none is returned.
    """
    rows = scene.table.used
    base = scene.table.base[rows]
    size = np.sqrt(np.mean(base**2, axis=0)) if base.size else np.zeros(0)
    basis = np.linalg.qr(base[:, size > 1e-12] / size[size > 1e-12])[0]

    def apart(values: Floats) -> Floats:
        return np.asarray(values - basis @ (basis.T @ values))

    target = apart(scene.residual_nm[rows])

    def likeness(point: Point) -> float:
        if not all(low <= x <= high for x, (low, high) in zip(point, limits, strict=True)):
            return 0.0
        own = apart(scene.table.band(column(scene, point)[:, 0])[rows])
        energy = float(own @ own)
        along = float(own @ target)
        return along**2 / energy if energy > 0.0 and along > 0.0 else 0.0

    if not coarse or not rows.any():
        return ()
    scored = sorted(((likeness(point), point) for point in coarse), key=lambda pair: -pair[0])
    if scored[0][0] < worth * float(target @ target):
        return ()
    found = [_followed(likeness, *start, trials) for start in scored[:_STARTS]]
    return tuple(point for _, point in sorted(found, key=lambda pair: -pair[0]))


def _followed(
    likeness: Callable[[Point], float], best: float, at: Point, trials: int
) -> tuple[float, Point]:
    """Return the likeness and the point where a search from one point ends."""
    step = _FIRST
    while step >= _LAST and trials > 0:
        moved = False
        for index in np.flatnonzero(at).tolist():
            for factor in (1.0 + step, 1.0 / (1.0 + step)):
                trial = tuple(x * factor if i == index else x for i, x in enumerate(at))
                trials -= 1
                value = likeness(trial)
                if value > best:
                    best, at, moved = value, trial, True
                    break
        step = step if moved else 0.5 * step
    return best, at
