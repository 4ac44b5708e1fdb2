"""How well the twin's own law of an effect does, where a candidate form knows more than it.

A twin's entry must predict as it says. Where a form has numbers for which the twin's law has no
place, the law's own numbers are fitted in their stead; a law that then removes nothing is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from agent.explain.rows.beginnings import without_beginnings
from agent.explain.rows.forgetting import forgetting
from agent.explain.rows.pieces import known_part
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import Table
from agent.identify.result import Floats
from agent.physics.effects import CARRIED, YIELDING, along_the_way
from agent.physics.twin import Effect, Twin

_WORTH = 0.99  # of the squared residual: a law that leaves more is no better than none
_ALIKE = 0.25  # of a form's square: a law that misses no more has half of its amplitude and more
_KEPT = 0.5  # of the rows: with fewer, beginnings are compared as well
_FAR, _CLOSELY = math.log(4.0), 0.02  # of a number's logarithm


def best_entry(
    scene: Scene,
    effect: str,
    entries: Sequence[Mapping[str, float]],
    torque_nm: Floats | None = None,
) -> Sequence[Mapping[str, Any]]:
    """Return the entry with which the twin predicts best, or nothing where none helps it.

    Beside effects of the same frequencies one law alone may help nothing, as a soft gear does that
    a wobble shakes: an entry that comes near to what the form says stands then as well. How an arm
    swings as a recording begins nobody knows: where that shows, no law is asked.

    Parameters
    ----------
    scene : Scene
    effect : str
        Id of contract section 4.
    entries : sequence of mapping of str to float
        Parameter tables of the twin's law.
    torque_nm : ndarray, shape (N,), optional
        What the form says, at full rate, where it is one path that the law can follow.
    """
    laws = [_as_twin(scene, effect, entry) for entry in entries]
    apart = _apart_from_beginnings(scene, effect, entries)
    lefts = [_left(scene, apart, law) for law in laws]
    if lefts and min(lefts) < _WORTH * _left(scene, apart, None):
        return (dict(entries[int(np.argmin(lefts))]),)
    if torque_nm is None:
        return ()
    beside = _beside_numbers(apart)
    wanted = beside(torque_nm)
    missed = [float(np.sum((wanted - beside(law)) ** 2)) for law in laws]
    if not missed or not min(missed) < _ALIKE * float(wanted @ wanted):
        return ()
    return (dict(entries[int(np.argmin(missed))]),)


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

    beside = _beside_numbers(scene.table)
    wanted = beside(torque_nm)

    def left(times: float) -> float:
        entry = entry_of(around * math.exp(times))
        return float(np.sum((wanted - beside(_as_twin(scene, effect, entry))) ** 2))

    found = minimize_scalar(
        left, bounds=(-_FAR, _FAR), method="bounded", options={"xatol": _CLOSELY}
    )
    return entry_of(around * math.exp(float(found.x)))


def _apart_from_beginnings(
    scene: Scene, effect: str, entries: Sequence[Mapping[str, float]]
) -> Table:
    """Return a table without the rows at which it is not known how an entry's arm swings.

    The whole of it where little else would be left.
    """
    table = scene.table
    for entry in entries:
        twin = replace(_plain(scene, 0.0), effects=(Effect(effect, dict(entry)),))
        table = without_beginnings(table, forgetting(twin))
    enough = np.count_nonzero(table.used) > _KEPT * np.count_nonzero(scene.table.used)
    return table if enough else scene.table


def _beside_numbers(table: Table) -> Callable[[Floats], Floats]:
    """Return what takes a torque at full rate to what the twin's own numbers leave of it, (m,)."""
    rows, carried = table.used, table.carried
    base = table.base[np.ix_(rows, carried)]
    unit = np.linalg.qr(base / np.sqrt(np.mean(base**2, axis=0)))[0]

    def beside(torque: Floats) -> Floats:
        seen = known_part(torque, table.pieces)[rows]
        seen = np.where(np.isfinite(seen), seen, 0.0)
        return np.asarray(seen - unit @ (unit.T @ seen))

    return beside


def _as_twin(scene: Scene, effect: str, entry: Mapping[str, float]) -> Floats:
    """Return what the twin's law says at full rate, shape (N,).

    That of an arm beside what changes its friction.
    """
    coulomb = max(float(scene.theta[2]), 0.0)
    without: tuple[Effect, ...] = ()
    if effect in CARRIED:
        coulomb = coulomb_nm(scene)
        without = (*_ageing(scene), *_yielding(scene, coulomb))
    twin = _plain(scene, coulomb)
    with_it = replace(twin, effects=(*without, Effect(effect, dict(entry))))
    out = scene.table.effects_nm(with_it)
    if without:
        return np.asarray(out - scene.table.effects_nm(replace(twin, effects=without)))
    return out


def coulomb_nm(scene: Scene) -> float:
    """Return the twin's own Coulomb level, N m, where its law says what time and use add to it.

    A running-in is what is still to come in the form, and what has come since the start in the law.
    """
    coulomb = max(float(scene.theta[2]), 0.0)
    if not scene.ageing:
        return coulomb
    level = coulomb * scene.worn_share
    law = scene.table.effects_nm(replace(_plain(scene, coulomb), effects=_ageing(scene)))
    own = level - along_the_way(law, scene.direction)
    return max(float(np.median(own[scene.direction != 0.0])), 0.0)


def _plain(scene: Scene, coulomb: float) -> Twin:
    inertia, viscous = (max(float(x), 0.0) for x in scene.theta[:2])
    return Twin(
        robot="scene",
        axis=1,
        gear_ratio=scene.table.gear_ratio,
        inertia_kg_m2=inertia,
        coulomb_nm=coulomb,
        viscous_nm_s_per_rad=viscous,
        gravity_sin_nm=float(scene.theta[3]),
        gravity_cos_nm=float(scene.theta[4]),
    )


def _yielding(scene: Scene, coulomb: float) -> tuple[Effect, ...]:
    """Return the twin's effect of friction that was found to yield: the arm's yields with it."""
    if not (scene.yields_rad > 0.0 and coulomb > 0.0):
        return ()
    return (Effect(YIELDING, {"stiffness_nm_per_rad": coulomb / scene.yields_rad}),)


def _ageing(scene: Scene) -> tuple[Effect, ...]:
    """Return the twin's effects of what time and use were found to make of the dry friction."""
    return tuple(
        Effect(known.effect, dict(table)) for known in scene.ageing for table in known.tables(scene)
    )


def _left(scene: Scene, table: Table, torque_nm: Floats | None) -> float:
    """Return the squared residual that is left beside a torque, the twin's numbers refitted.

    And beside a model's other terms: of what they explain a weaker effect is next to nothing.
    """
    known = np.zeros_like(table.target_nm) if scene.others_nm is None else scene.others_nm
    if torque_nm is not None:
        known = known + table.band(scene.as_late(torque_nm))
    rest = refit(table, known)[1][table.used]
    return float(np.sum(rest**2)) if np.isfinite(rest).all() else np.inf
