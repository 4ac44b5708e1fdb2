"""How well the twin's own law of an effect does, where a candidate form knows more than it.

A twin's entry must predict as it says. Where a form has numbers for which the twin's law has no
place, the law's own numbers are fitted in their stead; a law that then removes nothing is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.rows.pieces import known_part
from agent.explain.rows.scene import Scene, refit
from agent.explain.rows.twin_effects import effects_nm
from agent.identify.result import Floats
from agent.physics.twin import Effect, Twin

_WORTH = 0.99  # of the squared residual: a law that leaves more is no better than none
_FAR, _CLOSELY = math.log(4.0), 0.02  # of a number's logarithm


def best_entry(
    scene: Scene, effect: str, entries: Sequence[Mapping[str, float]]
) -> Sequence[Mapping[str, Any]]:
    """Return the entry with which the twin predicts best, or nothing where none helps it.

    Parameters
    ----------
    scene : Scene
    effect : str
        Id of contract section 4.
    entries : sequence of mapping of str to float
        Parameter tables of the twin's law.
    """
    whole = _left(scene, None)
    lefts = [_left(scene, _as_twin(scene, effect, entry)) for entry in entries]
    if not lefts or not min(lefts) < _WORTH * whole:
        return ()
    return (dict(entries[int(np.argmin(lefts))]),)


def nearest(
    scene: Scene,
    effect: str,
    entry_of: Callable[[float], Mapping[str, float]],
    around: float,
    torque_nm: Floats,
) -> Mapping[str, float]:
    """Return the entry whose torque comes nearest to a form's, the twin's numbers free beside both.

    Parameters
    ----------
    scene : Scene
    effect : str
        Id of contract section 4.
    entry_of : callable
        The law's one number, above zero, to its parameter table.
    around : float
        Where it is looked for: from a quarter to four times this.
    torque_nm : ndarray, shape (N,)
        What the form says, at full rate.
    """
    from scipy.optimize import minimize_scalar

    table = scene.table
    rows, carried = table.used, table.carried
    base = table.base[np.ix_(rows, carried)]
    unit = np.linalg.qr(base / np.sqrt(np.mean(base**2, axis=0)))[0]

    def beside(torque: Floats) -> Floats:
        seen = known_part(torque, table.pieces)[rows]
        seen = np.where(np.isfinite(seen), seen, 0.0)
        return np.asarray(seen - unit @ (unit.T @ seen))

    wanted = beside(torque_nm)

    def left(times: float) -> float:
        entry = entry_of(around * math.exp(times))
        return float(np.sum((wanted - beside(_as_twin(scene, effect, entry))) ** 2))

    found = minimize_scalar(
        left, bounds=(-_FAR, _FAR), method="bounded", options={"xatol": _CLOSELY}
    )
    return entry_of(around * math.exp(float(found.x)))


def _as_twin(scene: Scene, effect: str, entry: Mapping[str, float]) -> Floats:
    """Return what the twin's law says at full rate, shape (N,)."""
    table = scene.table
    inertia, viscous, coulomb = (max(float(x), 0.0) for x in scene.theta[:3])
    twin = Twin(
        robot="scene",
        axis=1,
        gear_ratio=table.gear_ratio,
        inertia_kg_m2=inertia,
        coulomb_nm=coulomb,
        viscous_nm_s_per_rad=viscous,
        gravity_sin_nm=float(scene.theta[3]),
        gravity_cos_nm=float(scene.theta[4]),
        effects=(Effect(effect, dict(entry)),),
    )
    return effects_nm(twin, table.runs, table.pieces, table.full)


def _left(scene: Scene, torque_nm: Floats | None) -> float:
    """Return the squared residual that is left beside a torque, the twin's numbers refitted."""
    table = scene.table
    if torque_nm is None:
        return float(np.sum(refit(table)[1][table.used] ** 2))
    known = table.band(torque_nm)
    rest = refit(table, known)[1][table.used]
    return float(np.sum(rest**2)) if np.isfinite(rest).all() else np.inf
