"""Where a clearance would be crossed, and whether the residual shows it just then.

The teeth part when the torque in the gear changes sides: at reversals, and wherever braking,
gravity and the arm's own friction balance. When they meet again depends on the gap. These instants
follow from three numbers (half gap, the arm's share of the inertia and of the friction), and to a
few percent: an arm that takes off a moment too early lands somewhere else. So many points are
tried, without springs: teeth that part, and that meet without bouncing, take a few operations a
row. Once with an arm whose friction is dry, and once with one that oil brakes as well, by the same
share: a fast one stays with the motor where the other would part from it. A film between the teeth
(oil, or a simulator's damper that knows no gap) drags the arm along, so that they meet later; such
gaps are looked for by themselves, on a coarser grid: what is dragged is less sharp.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.forms.grid import log_grid
from agent.explain.rows.blows import Blows
from agent.explain.rows.pieces import thinned
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

Gap = tuple[float, float, float, float, float]

_GAPS = 16  # a gap half again as wide is crossed at other instants: fewer step over a peak
_SHARES = log_grid(0.1, 0.98, 30)
_FRICTIONS = tuple(float(x) for x in np.linspace(0.0, 1.0, 25))
_CLIMBED = 12  # peaks, at least: the highest point of a grid is seldom on the highest peak
_NEAR_SHARES = np.linspace(-0.08, 0.08, 9)  # of the logarithm
_NEAR_FRICTIONS = np.linspace(-0.06, 0.06, 13)
_FEWEST_ROWS = 30
_APART = 2  # points of the grid between two peaks
_FIRST_STEPS, _HALVINGS = (1.3, 1.04, 0.02, 1.5), 4  # factor, factor, difference, factor
_FILM_PER_S = 40.0  # drags an arm through a gap that takes some tens of milliseconds
_COARSER = 2
_HEARD_GAPS = 24
_LONGEST_S = 1.0 / 120.0  # of a step: teeth are apart for some hundredths of a second
_MOTION = ("acceleration_rad_s2", "velocity_rad_s")  # as the table's base has it


def likely_gaps(
    scene: Scene, smallest: float, widest: float, count: int, with_film: int = 0
) -> tuple[Gap, ...]:
    """Return the likeliest half gaps, the arm's shares of inertia and dry friction, film and oil.

    The film between the teeth by its damping over the arm's inertia, 1/s, and what oil brakes the
    arm by as its share of the viscous friction.

    Parameters
    ----------
    scene : Scene
    smallest, widest : float
        Half gaps between which to look, rad of the motor.
    count : int
        The most points to return; they are peaks that stand apart, the likeliest first.
    with_film : int
        The most points with a film between the teeth, 1/s, that follow.

    Where blows are heard, the likeliest gap with the shares that tell when they come stands in the
    place of the least likely peak, and of those with a film.
    """
    used = scene.table.used
    if np.count_nonzero(used) <= _FEWEST_ROWS or not scene.residual_nm[used].any():
        return ()
    likeness = _likeness(scene)
    gaps = log_grid(smallest, widest, _GAPS)
    axes = gaps, _SHARES, _FRICTIONS, (0.0,)
    peaks = [p for as_oil in (0.0, 1.0) for p in _peaks(likeness, axes, count, as_oil)]
    dry = tuple(gap for _, gap in sorted(peaks, reverse=True)[:count])
    if scene.blows is not None:
        dry = (*dry[: max(count - 1, 1)], _as_heard(likeness, scene.blows, smallest, widest))
    coarse = _SHARES[::_COARSER], _FRICTIONS[::_COARSER]
    filmed = _peaks(likeness, (gaps, *coarse, (_FILM_PER_S,)), with_film)
    return (*dry, *(gap for _, gap in filmed))


def likeliest_arms(
    scene: Scene,
    half_gaps: Sequence[float],
    inertia_share: float | None = None,
    friction_share: float = 0.0,
    oil_share: float = 0.0,
) -> tuple[Gap, ...]:
    """Return the likeliest arm behind each half gap, rad of the motor, as `likely_gaps` does.

    Parameters
    ----------
    scene : Scene
    half_gaps : sequence of float
    inertia_share, friction_share, oil_share : float, optional
        Of an arm near which to look, in finer steps; else all dry arms are looked at.
    """
    used = scene.table.used
    if np.count_nonzero(used) <= _FEWEST_ROWS or not scene.residual_nm[used].any():
        return ()
    shares, frictions = _SHARES, _FRICTIONS
    if inertia_share is not None:
        shares = tuple(inertia_share * np.exp(_NEAR_SHARES))
        frictions = tuple(np.maximum(friction_share + _NEAR_FRICTIONS, 0.0))
    likeness = _likeness(scene)
    axes = half_gaps, shares, frictions, (0.0,), (oil_share,)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(len(half_gaps), -1, 5)
    points[..., 1] = np.minimum(points[..., 1], 1.0)
    scores = likeness(points.reshape(-1, 5)).reshape(points.shape[:2])
    best = points[np.arange(len(half_gaps)), np.argmax(scores, axis=1)]
    return tuple((float(g), float(i), float(f), float(d), float(o)) for g, i, f, d, o in best)


def _as_heard(
    likeness: Callable[[Floats], Floats], blows: Blows, smallest: float, widest: float
) -> Gap:
    """Return the likeliest gap of an arm with the shares that the blows were heard with."""
    gaps = np.array(log_grid(smallest, widest, _HEARD_GAPS))
    points = np.zeros((gaps.shape[0], 5))
    points[:, 0], points[:, 1], points[:, 2] = gaps, blows.arm_share, blows.friction_share
    score = likeness(points)
    top = int(np.argmax(score))
    return _climbed(likeness, points[top], float(score[top]))[1]


def _peaks(
    likeness: Callable[[Floats], Floats],
    axes: Sequence[Sequence[float]],
    count: int,
    as_oil: float = 0.0,
) -> tuple[tuple[float, Gap], ...]:
    """Return likeness and point of the peaks over shares of inertia and friction, best first.

    `as_oil` is the arm's share of the viscous friction over that of the dry.
    """
    if not count:
        return ()
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)[:, :, :, 0]
    grid = np.concatenate((grid, as_oil * grid[..., 2:3]), axis=-1)
    score = likeness(grid.reshape(-1, 5)).reshape(grid.shape[:-1])
    best = score.max(axis=0)
    found: list[tuple[float, Gap]] = []
    while len(found) < max(count, _CLIMBED) and best.max() > 0.0:
        i, j = (int(x) for x in np.unravel_index(int(np.argmax(best)), best.shape))
        found.append(_climbed(likeness, grid[int(np.argmax(score[:, i, j])), i, j], best[i, j]))
        best[max(i - _APART, 0) : i + _APART + 1, max(j - _APART, 0) : j + _APART + 1] = 0.0
    return tuple(sorted(found, reverse=True)[:count])


def _likeness(scene: Scene) -> Callable[[Floats], Floats]:
    """Return the function from points, shape (p, 5), to the residual's energy along each, (p,)."""
    from agent.explain.forms.crossings_kernel import likeness_of

    steps = _steps(scene)
    inertia = max(float(scene.theta[0]), 1e-12)
    viscous, dry = (max(float(x), 0.0) / inertia for x in scene.theta[1:3])
    columns = [np.concatenate(each) for each in zip(*(step.columns for step in steps), strict=True)]
    inertial, velocity, direction, weight, residual = columns
    begins = np.zeros(inertial.shape[0], dtype=np.bool_)
    begins[np.cumsum([0, *(step.columns[0].shape[0] for step in steps)])[:-1]] = True
    period_s = np.concatenate([np.full(s.columns[0].shape[0], s.period_s) for s in steps])
    moved = dry * direction, weight / inertia, viscous * velocity

    def likeness(points: Floats) -> Floats:
        by_arms = np.lexsort(points.T)  # gaps of one arm follow each other, the narrowest first
        out = np.empty(points.shape[0])
        out[by_arms] = likeness_of(inertial, *moved, residual, begins, period_s, points[by_arms])
        return out

    return likeness


@dataclass(frozen=True)
class _Steps:
    """One stretch as its crossings are followed.

    Columns, each shape (m,): acceleration, velocity, direction times what age has made of the dry
    friction, weight, residual.
    """

    period_s: float
    columns: tuple[Floats, ...]


def _steps(scene: Scene) -> list[_Steps]:
    """Return every stretch at its rows, or in finer steps where those are too far apart.

    In a narrow band a row may last as long as the teeth are apart. The residual that shows it is
    smooth, and may be read between its rows.
    """
    table = scene.table
    base, weight = table.base, scene.weight_rows()
    dry = base[:, 2] * thinned(scene.worn_share, table.pieces)
    residual = np.where(table.used, scene.residual_nm, 0.0)
    motion = [table.full[name] for name in _MOTION]
    motion.append(table.full["direction"] * scene.worn_share)
    out = []
    for piece in table.pieces:
        at, rows = piece.full, piece.rows
        stride = max(1, round(_LONGEST_S / piece.period_s))
        if stride >= piece.stride:
            at_rows = (base[rows, 0], base[rows, 1], dry[rows], weight[rows], residual[rows])
            out.append(_Steps(piece.period_s * piece.stride, at_rows))
            continue
        fine = np.arange(0, at.stop - at.start, stride)
        between = np.arange(rows.stop - rows.start) * piece.stride
        left = np.interp(fine, between, residual[rows])
        each = tuple(x[at][::stride] for x in (*motion, scene.weight_nm))
        out.append(_Steps(piece.period_s * stride, (*each, left)))
    return out


def _climbed(likeness: Callable[[Floats], Floats], at: Floats, best: float) -> tuple[float, Gap]:
    """Return the likeness and the point that a search among ever nearer neighbours ends at."""
    gap_factor, share_factor, step, film_factor = _FIRST_STEPS
    as_oil = at[4] / at[2] if at[2] else 0.0
    for _ in range(_HALVINGS):
        films = (1.0 / film_factor, 1.0, film_factor) if at[3] else (1.0,)
        around = np.stack(
            np.meshgrid(
                at[0] * np.array([1.0 / gap_factor, 1.0, gap_factor]),
                np.minimum(at[1] * np.array([1.0 / share_factor, 1.0, share_factor]), 1.0),
                np.maximum(at[2] + np.array([-step, 0.0, step]), 0.0),
                at[3] * np.array(films),
                indexing="ij",
            ),
            axis=-1,
        ).reshape(-1, 4)
        around = np.column_stack((around, as_oil * around[:, 2]))
        values = likeness(around)
        top = int(np.argmax(values))
        if values[top] > best:
            best, at = float(values[top]), around[top]
        gap_factor, share_factor, film_factor = (
            factor**0.5 for factor in (gap_factor, share_factor, film_factor)
        )
        step *= 0.5
    return best, (float(at[0]), float(at[1]), float(at[2]), float(at[3]), float(at[4]))
