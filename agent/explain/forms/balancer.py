"""A balancer's spring: what it pulls beside a sine, which gravity's own numbers take."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.forms.cable import FORMS as HOSES
from agent.explain.forms.form import Form, Point, stack
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import GRAVITY_AT
from agent.identify.result import Floats
from agent.physics.balancer import balancer_share

_SHORTEST_STROKE = 1.0  # rad of the arm: on less it is a spring that stiffens
_ROWS = 2000  # at most, to look at
_RATIOS = (0.25, 0.4, 0.55, 0.7, 0.8, 0.88)
_CENTERS = 48  # around the turn
_FOLLOWED = 3  # places: there are many valleys, of a spring that pushes and of one that pulls
LEAST_RATIO, MOST_RATIO = 0.2, 0.9  # nearer to none it is a sine, nearer to one a step
_OF_ITS_OWN = 1e-6  # of its energy: what is all but a sine is gravity's
_STEP = (0.08, 0.1)


def _pull(scene: Scene, point: Point) -> Floats:
    """Return the pull of a force that does not change with its length, shape (N, 1)."""
    return stack(balancer_share(scene.arm_rad, *point))


def _pull_of_a_coil(scene: Scene, point: Point) -> Floats:
    """Return the same, and the pull of a force that grows with its length, shape (N, 2)."""
    return np.concatenate((_pull(scene, point), np.sin(scene.arm_rad - point[1])[:, None]), axis=1)


def _levers(scene: Scene) -> Sequence[Point]:
    """Return ratio and dead center of the constant forces that a residual resembles most.

    Beside a weight that is refitted, or that may stand beside it in the model.
    """
    beside_weight = _places(scene, with_gravity=True, with_sine=False)
    if any(scene.table.carried[GRAVITY_AT]):
        return beside_weight
    alone = _places(scene, with_gravity=False, with_sine=False)
    return tuple(dict.fromkeys((*alone, *beside_weight)))


def _levers_of_a_coil(scene: Scene) -> Sequence[Point]:
    """Return the same of a force with stiffness; nothing where gravity takes that itself."""
    if any(scene.table.carried[GRAVITY_AT]):
        return ()
    stiff, plain = (_places(scene, with_gravity=False, with_sine=sine) for sine in (True, False))
    return tuple(dict.fromkeys((*stiff, *plain)))


def _places(scene: Scene, *, with_gravity: bool, with_sine: bool) -> Sequence[Point]:
    """Return ratio and dead center, rad of the arm, of what the residual resembles most.

    Beside the twin's other numbers: a motion that goes fast at some angles makes friction of them.

    Parameters
    ----------
    scene : Scene
    with_gravity : bool
        Whether gravity is refitted beside it.
    with_sine : bool
        Whether the spring has a stiffness.
    """
    table = scene.table
    lower, upper = scene.stroke_arm_rad()
    rows = np.flatnonzero(table.sliding)
    if upper - lower < _SHORTEST_STROKE or not rows.size:
        return ()
    rows = rows[:: math.ceil(rows.size / _ROWS)]
    beside = table.carried.copy()
    beside[GRAVITY_AT] = with_gravity
    basis = np.linalg.qr(table.base[np.ix_(rows, beside)])[0]

    def own(columns: Floats) -> Floats:
        return np.asarray(columns - (columns @ basis) @ basis.T)

    arm, left = scene.arm_rows()[rows], own(scene.residual_nm[rows])
    centers = 0.5 * (lower + upper) + 2.0 * math.pi * (np.arange(_CENTERS) / _CENTERS - 0.5)
    sine = np.zeros((_CENTERS, rows.size))
    if with_sine:
        sine = own(np.sin(arm - centers[:, np.newaxis]))
        sine /= np.linalg.norm(sine, axis=-1, keepdims=True)
    score = np.empty((len(_RATIOS), _CENTERS))
    for at, ratio in enumerate(_RATIOS):
        pull = balancer_share(arm, ratio, centers[:, np.newaxis])
        alone = own(pull)
        alone -= np.sum(alone * sine, axis=-1, keepdims=True) * sine
        energy, least = np.sum(alone**2, axis=-1), _OF_ITS_OWN * np.sum(pull**2, axis=-1)
        score[at] = np.where(energy > least, (alone @ left) ** 2 / np.maximum(energy, least), 0.0)
    score += (sine @ left) ** 2
    best_ratio, best = np.argmax(score, axis=0), np.max(score, axis=0)
    peaks = (best >= np.roll(best, 1)) & (best > np.roll(best, -1))
    strongest = np.argsort(np.where(peaks, -best, np.inf))[: min(_FOLLOWED, int(peaks.sum()))]
    return tuple((_RATIOS[best_ratio[i]], float(centers[i])) for i in strongest)


def _step(scene: Scene) -> Point:
    del scene
    return _STEP


def _limits(scene: Scene) -> Sequence[tuple[float, float]]:
    lower, upper = scene.stroke_arm_rad()
    middle = 0.5 * (lower + upper)
    return (LEAST_RATIO, MOST_RATIO), (middle - 1.5 * np.pi, middle + 1.5 * np.pi)


_LEVERS = ("lever_ratio", "dead_center_arm_rad")
_HOSES = tuple(form.name for form in HOSES)
FORCE = Form(
    "cable-force",
    "a balancer's spring",
    ("balancer_nm",),
    _pull,
    _LEVERS,
    _levers,
    step=_step,
    limits=_limits,
    needs=("position_rad",),
    contains=("gravity-imbalance", "torque-offset", "direction-asymmetry"),
    refines=_HOSES,
    from_residual=True,
    only_clearly=True,
)
COIL = replace(
    FORCE,
    name="a balancer's spring with stiffness",
    linear=("balancer_nm", "balancer_stiffness_nm"),
    columns=_pull_of_a_coil,
    grid=_levers_of_a_coil,
    signs=(0, 1),
    refines=(*_HOSES, FORCE.name),
)
BALANCERS: tuple[Form, ...] = (FORCE, COIL)
