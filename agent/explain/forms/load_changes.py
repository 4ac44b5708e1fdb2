"""When the load of the gear changes sides, and whether the residual is restless just then.

A clearance is crossed whenever the torque in the gear changes its sign: at reversals, and wherever
braking, gravity and the arm's own friction balance. These instants depend on the arm's share of the
inertia and of the dry friction alone, so that both are found without simulating anything: the pair
whose instants are followed by the most residual energy.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.scene import Scene, log_grid
from agent.explain.rows.table import BASE
from agent.identify.result import Floats

_SHARES = log_grid(0.1, 1.0, 28)
_FRICTIONS = tuple(float(x) for x in np.linspace(0.0, 1.0, 11))
_CALMED = 2.0  # periods of the cutoff after which an impact's ringing has gone through the filter
_LOUDEST = 0.99  # quantile of the energy that one impact may count for
_FEWEST_ROWS = 30
_APART = 2  # points of the grid between two peaks


def arm_shares(scene: Scene, count: int) -> tuple[tuple[float, float], ...]:
    """Return the arm's likely shares of inertia and of Coulomb friction, the likeliest first.

    Parameters
    ----------
    scene : Scene
    count : int
        The most pairs to return; they are peaks that stand apart.
    """
    restless, length = _restless(scene)
    used = scene.table.used
    if np.count_nonzero(used) <= _FEWEST_ROWS or not restless[used].any():
        return ()
    score = np.array([[_score(scene, restless, length, a, f) for f in _FRICTIONS] for a in _SHARES])
    out: list[tuple[float, float]] = []
    while len(out) < count and score.max() > 0.0:
        i, j = np.unravel_index(int(np.argmax(score)), score.shape)
        out.append((_SHARES[i], _FRICTIONS[j]))
        score[max(i - _APART, 0) : i + _APART + 1, max(j - 1, 0) : j + 2] = 0.0
    return tuple(out)


def _restless(scene: Scene) -> tuple[Floats, NDArray[np.int64]]:
    """Return the fast residual's energy, and how many rows an impact lasts, each (n,)."""
    table = scene.table
    energy = np.zeros(table.used.shape[0])
    length = np.ones(table.used.shape[0], dtype=np.int64)
    for piece in table.pieces:
        rows = max(1, round(_CALMED / (piece.cutoff_hz * piece.period_s * piece.stride)))
        left = np.where(table.used[piece.rows], scene.residual_nm[piece.rows], 0.0)
        level = np.convolve(left, np.full(2 * rows + 1, 1.0 / (2 * rows + 1)), mode="same")
        energy[piece.rows] = (left - level[: left.shape[0]]) ** 2
        length[piece.rows] = rows
    inside = energy[table.used]
    if inside.size:
        energy = np.minimum(energy, np.quantile(inside, _LOUDEST))
    return np.where(table.used, energy, 0.0), length


def _score(
    scene: Scene, energy: Floats, length: NDArray[np.int64], share: float, friction: float
) -> float:
    """Return the excess of energy after the load's changes of side, over its chance scatter."""
    table = scene.table
    weight = np.zeros(len(BASE))
    weight[0], weight[2], weight[3:5] = share, friction, 1.0
    load = table.base @ (weight * scene.theta)
    changes = np.flatnonzero(load[1:] * load[:-1] < 0.0)
    starts = [piece.rows.start for piece in table.pieces]
    changes = changes[~np.isin(changes + 1, starts)]
    marks = np.zeros(load.shape[0] + 1)
    np.add.at(marks, changes, 1.0)
    np.add.at(marks, np.minimum(changes + length[changes], load.shape[0]), -1.0)
    after = (np.cumsum(marks)[:-1] > 0.5) & table.used
    count = int(np.count_nonzero(after))
    if count < _FEWEST_ROWS:
        return 0.0
    inside = energy[table.used]
    excess = float(energy[after].sum()) - count * float(inside.mean())
    return excess / max(float(inside.std()) * math.sqrt(count), 1e-300)
