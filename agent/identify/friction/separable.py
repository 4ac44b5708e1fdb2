"""Variable projection of a separable friction law over its whole non-linear domain.

The linear parameters are projected out at every point of a grid over the non-linear ones (the
thesis's extensive search, section 4.4.3); the grid is then laid ever finer around its best point,
until the parameters stand still to six digits. There is no start value that the result could
depend on. The same grids give the exact leave-one-speed-out error and profile-likelihood
intervals, without a linearisation that a curved law would not forgive.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.physics.friction import FrictionLaw

_COARSE = (64, 24)
_FINE = (33, 17)
_LAST = (97, 49)  # a grid's ends are half a step short on the average: here 1 to 2 % of an interval
_ZOOMS = 12
_FILLED = 0.7  # of the grid's width: so much of it the region takes at least


@dataclass(frozen=True)
class GridFit:
    """Weighted least squares at every point of a grid; g grid points, n data, p linear.

    Parameters
    ----------
    nonlinear : ndarray, shape (g, k)
    linear : ndarray, shape (g, p)
    spread : ndarray, shape (g, p)
        Standard deviation of the linear parameters for data of unit weighted variance.
    sse : ndarray, shape (g,)
        Weighted sum of squared residuals.
    residual, leverage : ndarray, shape (g, n)
        Weighted residuals and diagonal of the projection.
    """

    nonlinear: Floats
    linear: Floats
    spread: Floats
    sse: Floats
    residual: Floats
    leverage: Floats

    @property
    def best(self) -> int:
        """Return the grid point of least squares."""
        return int(np.argmin(self.sse))


def project(
    law: FrictionLaw, speed: Floats, friction: Floats, weight: Floats, nonlinear: Floats
) -> GridFit:
    """Solve for the linear parameters at every grid point at once.

    Parameters
    ----------
    law : FrictionLaw
        What is fitted.
    speed, friction, weight : ndarray, shape (n,)
        The curve, and the square roots of the points' weights.
    nonlinear : ndarray, shape (g, k)
        Grid points; (1, 0) for a linear law.
    """
    columns = law.columns(speed, *nonlinear.T)
    columns = np.broadcast_to(columns, (nonlinear.shape[0], *columns.shape[-2:]))
    columns = columns * weight[:, np.newaxis]
    target = friction * weight
    scale = np.sqrt(np.einsum("gij,gij->gj", columns, columns))
    scale = np.where(scale > 0.0, scale, 1.0)
    # Orthogonal triangular, not normal equations: near the domain's edge columns are almost
    # parallel, and squaring their condition number would make the search find noise there.
    basis, triangle = np.linalg.qr(columns / scale[:, np.newaxis, :])
    diagonal = np.abs(np.einsum("gjj->gj", triangle))
    regular = diagonal.min(axis=1) > 1e-7
    triangle = np.where(regular[:, np.newaxis, np.newaxis], triangle, np.eye(triangle.shape[-1]))
    inverse = np.linalg.inv(triangle)
    projected = np.einsum("gij,i->gj", basis, target)
    linear = np.einsum("gij,gj->gi", inverse, projected) / scale
    spread = np.sqrt(np.einsum("gij,gij->gi", inverse, inverse)) / scale
    residual = target - np.einsum("gij,gj->gi", basis, projected)
    sse = np.where(regular, np.einsum("gi,gi->g", residual, residual), np.inf)
    leverage = np.einsum("gij,gij->gi", basis, basis)
    return GridFit(nonlinear, linear, spread, sse, residual, leverage)


def grid_over(law: FrictionLaw, bounds: Floats, sizes: tuple[int, ...]) -> Floats:
    """Return grid points, shape (g, k), even in each parameter or in its logarithm.

    Parameters
    ----------
    law : FrictionLaw
        Says which parameters are logarithmic.
    bounds : ndarray, shape (k, 2)
        Lower and upper end of the grid for each non-linear parameter.
    sizes : tuple of int
        Points along each parameter.
    """
    axes = []
    for entry, (lower, upper), size in zip(law.ranges, bounds, sizes, strict=False):
        spaced = np.geomspace if entry.logarithmic else np.linspace
        axes.append(spaced(lower, upper, size) if upper > lower else np.array([lower]))
    if not axes:
        return np.zeros((1, 0))
    mesh = np.meshgrid(*axes, indexing="ij")
    return np.stack([m.ravel() for m in mesh], axis=-1)


def domain(law: FrictionLaw, speed: Floats, held: Mapping[str, float] | None = None) -> Floats:
    """Return the bounds of the non-linear parameters for these speeds, shape (k, 2).

    A parameter in `held` has both bounds at its value.
    """
    slowest, fastest = float(speed.min()), float(speed.max())
    ends = [
        (held[r.name], held[r.name]) if held and r.name in held else r.bounds(slowest, fastest)
        for r in law.ranges
    ]
    return np.array(ends, dtype=np.float64).reshape(-1, 2)


def search(
    law: FrictionLaw, speed: Floats, friction: Floats, weight: Floats, bounds: Floats
) -> tuple[GridFit, GridFit]:
    """Return the coarse grid over the whole domain, and the finest one around its best point.

    `bounds`, shape (k, 2), is the `domain`.
    """
    coarse = project(law, speed, friction, weight, grid_over(law, bounds, _COARSE))
    if not law.ranges:
        return coarse, coarse
    steps = np.array([_step(law, i, bounds[i], _COARSE[i]) for i in range(len(law.ranges))])
    fine = coarse
    for _ in range(40):
        centre = fine.nonlinear[fine.best]
        around = _around(law, centre, steps, bounds)
        fine = project(law, speed, friction, weight, grid_over(law, around, (7, 7)))
        # Shrunk by less than the grid is fine, so that a curved valley can be followed.
        steps = steps * 0.6
        if steps.max() < 1e-7:
            break
    return coarse, fine


def profile_region(
    law: FrictionLaw,
    speed: Floats,
    friction: Floats,
    weight: Floats,
    bounds: Floats,
    grids: tuple[GridFit, GridFit],
    limit: float,
) -> tuple[GridFit, NDArray[np.bool_]]:
    """Return a grid over the region where the squared error stays below `limit`.

    Also returns, shape (k, 2), whether the region reaches a lower or upper bound of the domain.
    `grids` are the two that `search` returned.
    """
    coarse, fine = grids
    at_bound = np.zeros(bounds.shape, dtype=np.bool_)
    if not law.ranges:
        return fine, at_bound
    inside = coarse.nonlinear[coarse.sse <= limit]
    inside = np.vstack((inside, fine.nonlinear[fine.best]))
    steps = np.array([_step(law, i, bounds[i], _COARSE[i]) for i in range(len(law.ranges))])
    box = _about(law, inside, steps, bounds)
    for _ in range(_ZOOMS):
        points = np.vstack((grid_over(law, box, _FINE), fine.nonlinear[fine.best]))
        region = project(law, speed, friction, weight, points)
        accepted = region.nonlinear[region.sse <= limit]
        steps = np.array([_step(law, i, box[i], _FINE[i]) for i in range(len(law.ranges))])
        closer = _about(law, accepted, steps, bounds)
        # Of a region that a few points of the grid hit, they say how far it reaches at least.
        if not np.any(_widths(law, closer) < _FILLED * _widths(law, box)):
            break
        box = closer
    points = np.vstack((grid_over(law, box, _LAST), fine.nonlinear[fine.best]))
    region = project(law, speed, friction, weight, points)
    accepted = region.nonlinear[region.sse <= limit]
    at_bound[:, 0] = accepted.min(axis=0) <= bounds[:, 0] * (1 + 1e-9)
    at_bound[:, 1] = accepted.max(axis=0) >= bounds[:, 1] * (1 - 1e-9)
    return region, at_bound


def _about(law: FrictionLaw, points: Floats, steps: Floats, bounds: Floats) -> Floats:
    """Return the box of points, shape (m, k), and a step about them, inside the bounds, (k, 2)."""
    lowest = _shift(law, points.min(axis=0), -steps)
    highest = _shift(law, points.max(axis=0), steps)
    return np.clip(np.stack([lowest, highest], axis=-1), bounds[:, :1], bounds[:, 1:])


def _widths(law: FrictionLaw, box: Floats) -> Floats:
    """Return a box's widths, shape (k,), in the logarithm for logarithmic parameters."""
    return np.array([_step(law, i, box[i], 2) for i in range(len(law.ranges))])


def _step(law: FrictionLaw, i: int, bounds: Floats, size: int) -> float:
    """Return one grid step, in the logarithm for a logarithmic parameter."""
    lower, upper = float(bounds[0]), float(bounds[1])
    width = np.log(upper / lower) if law.ranges[i].logarithmic else upper - lower
    return float(width) / (size - 1)


def _shift(law: FrictionLaw, point: Floats, steps: Floats) -> Floats:
    """Move a point by steps, in the logarithm where the parameter is logarithmic."""
    logarithmic = np.array([r.logarithmic for r in law.ranges])
    return np.where(logarithmic, point * np.exp(steps), point + steps)


def _around(law: FrictionLaw, centre: Floats, steps: Floats, bounds: Floats) -> Floats:
    """Return a box of two steps to either side of a point, inside the bounds, shape (k, 2)."""
    box = np.stack([_shift(law, centre, -2 * steps), _shift(law, centre, 2 * steps)], axis=-1)
    return np.clip(box, bounds[:, :1], bounds[:, 1:])
