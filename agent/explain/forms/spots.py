"""At which places of the arm a residual stands out: bells of several widths along the stroke."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.friction_place import bump_share

_BINS = 600  # along the stroke: six in the narrowest bell that is looked for
_PEAKS = 3  # of every width
_REACH = 4.0  # widths to either side, where a bell ends
_APART = 2.0  # widths: nearer peaks are one


def strong_places(
    scene: Scene, widths: Sequence[float], *, friction: bool, of_turn: bool = False
) -> tuple[tuple[float, float], ...]:
    """Return centre and width, both rad of the arm, of the bells that the residual resembles most.

    Parameters
    ----------
    scene : Scene
    widths : sequence of float
        Standard deviations of the bells, of the stroke.
    friction : bool
        Whether the torque follows the velocity's sign.
    of_turn : bool
        Whether all turns of the arm are laid over each other; the stroke is then one turn.
    """
    table = scene.table
    rows = table.sliding
    if not scene.has("position_rad") or not rows.any():
        return ()
    lower, upper = (x / table.gear_ratio for x in scene.span("position_rad"))
    where = scene.arm_rows()[rows]
    if of_turn:
        lower, upper = -math.pi, math.pi
        where = where - 2.0 * math.pi * np.round(where / (2.0 * math.pi))
    if upper <= lower:
        return ()
    residual = scene.residual_nm[rows]
    sign = np.sign(table.rows["velocity_rad_s"][rows]) if friction else np.ones_like(residual)
    at = (where - lower) / (upper - lower) * _BINS
    index = np.clip(at.astype(np.int64), 0, _BINS - 1)
    moment = np.asarray(np.bincount(index, sign * residual, _BINS), dtype=np.float64)
    weight = np.asarray(np.bincount(index, sign**2, _BINS), dtype=np.float64)
    out = []
    for width in widths:
        score = _resemblance(moment, weight, width * _BINS)
        for _ in range(_PEAKS):
            best = int(np.argmax(score))
            if score[best] <= 0.0:
                break
            out.append((lower + (best + 0.5) / _BINS * (upper - lower), width * (upper - lower)))
            away = np.abs(np.arange(_BINS) - best)
            score[away < _APART * width * _BINS] = 0.0
    return tuple(out)


def _resemblance(moment: Floats, weight: Floats, width: float) -> Floats:
    """Return the energy that a bell about each bin explains beside a constant next to it, (n,).

    Parameters
    ----------
    moment, weight : ndarray, shape (n,)
        Sums of signed residuals and of rows, by bin.
    width : float
        In bins.
    """
    # A bell that ends beyond both ends of the stroke is cut there: no longer than the bins.
    reach = min(int(np.ceil(_REACH * width)), (weight.shape[0] - 1) // 2)
    away = np.arange(-reach, reach + 1, dtype=np.float64)
    bell = bump_share(away, 0.0, width)
    flat = np.ones_like(bell)
    here = slice(reach, reach + moment.size)  # "same" is as long as a bell that is wider than all
    m1, m0 = (np.convolve(moment, k)[here] for k in (bell, flat))
    g11, g10, g00 = (np.convolve(weight, k)[here] for k in (bell**2, bell, flat))
    own = g11 - g10**2 / np.maximum(g00, 1e-12)
    part = m1 - g10 * m0 / np.maximum(g00, 1e-12)
    return np.asarray(np.where(own > 0.05 * g11, part**2 / np.maximum(own, 1e-12), 0.0))
