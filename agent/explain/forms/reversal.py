"""Friction that yields before it slips: what a reversal leaves for a while."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, stack
from agent.explain.forms.grid import log_grid
from agent.explain.forms.twin_law import best_entry, nearest
from agent.explain.rows.remembered import remembered
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.friction_dynamic import dahl_share
from agent.physics.presliding import MaxwellSlip

_EFFECT, _DAHL, _LUGRE = "presliding-hysteresis", "Dahl", "bristles with damping (LuGre)"
_DAMPING = "damping_nm_s_per_rad"
_SHARE = "yielding_share"
_NEARLY_ALL = 0.8  # of the dry level
_A_PART = 0.6  # of the dry level: with more, all of it yields, and the form's height errs


def _presliding_grid(scene: Scene) -> Sequence[Point]:
    arm = log_grid(3e-5, 2e-2, 9)
    return tuple((reach * scene.table.gear_ratio,) for reach in arm)


def _presliding(scene: Scene, point: Point) -> Floats:
    """Return a hysteresis of unit height, less the sign it settles to.

    Unit height is Coulomb friction's. What else the joint has of sliding friction hangs on the same
    spring, which then has further to go: as a twin's law has it, and LuGre's.
    """
    if not scene.sliding:
        return stack(hysteresis(scene, point[0]) - scene.direction)
    from agent.physics.kernels import yielding

    level = scene.level_share
    held = remembered(
        scene.table.full,
        scene.table.pieces,
        lambda time, velocity, level, start: yielding(
            time, velocity, level, 1.0 / point[0], 1.0, start * level[0]
        ),
        level,
    )
    return stack(held - level * scene.direction)


def _damped(scene: Scene, point: Point) -> Floats:
    """Return the same, and the damping of what yields by its rate, shape (N, 2).

    ``v y`` with ``y = 1 - F sign(v) / L``: as large as the speed right after a reversal, and gone
    where all of it slides.
    """
    less = _presliding(scene, point)[:, 0]
    level = scene.level_share
    held = less + level * scene.direction
    left = 1.0 - held * scene.direction / level
    return stack(less, scene.full("velocity_rad_s") * left)


def _all_of_it_yields(scene: Scene, point: Point, coefficients: Floats) -> bool:
    """Return whether bristles bear nearly all of the dry friction, as a twin's law has them."""
    del point
    return float(coefficients[0]) >= _NEARLY_ALL * float(scene.theta[2])


def hysteresis(scene: Scene, reach_rad: float) -> Floats:
    """Return Dahl's state on the measured motion, from -1 to 1, shape (N,).

    It keeps what it remembers where samples were lost.
    """
    return remembered(
        scene.table.full,
        scene.table.pieces,
        lambda time, velocity, _, start: dahl_share(time, velocity, reach_rad, start),
    )


def reach_rad(form: Form, point: Point) -> float:
    """Return over which travel friction yields: that of one spring which loses as much, rad.

    Parameters
    ----------
    form : Form
        One of this file's.
    point : tuple of float
    """
    if form.name in (_DAHL, _LUGRE):
        return point[0]
    stiffness, level = MaxwellSlip(point[0], max(point[1], 1.0)).elements()
    yields = stiffness > 0.0
    return float(np.sum(level[yields] ** 2 / stiffness[yields]) / np.sum(level))


def _presliding_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Return the spring that yields at the twin's own dry level, or at a part of it."""
    level = max(float(scene.theta[2]), 0.0)
    if not level > 0.0:
        return ()
    reach, plain = values["reach_rad"], replace(scene, sliding=())
    damped = {_DAMPING: values[_DAMPING]} if _DAMPING in values else {}
    own = np.array([values["height_nm"], values.get(_DAMPING, 0.0)])
    torque = _damped(plain, (reach,)) @ own

    def entry(travel: float) -> Mapping[str, float]:
        return {"stiffness_nm_per_rad": level / travel, **damped}

    # Beside sliding friction the form has the twin's own steps already.
    alone = not scene.sliding
    entries = [nearest(plain, _EFFECT, entry, reach, torque) if alone else entry(reach)]
    entries += [
        {"stiffness_nm_per_rad": share * level / reach, _SHARE: share, **damped}
        for share in _of_the_level(scene, values)
    ]
    return best_entry(plain, _EFFECT, entries)


def _slipping_grid(scene: Scene) -> Sequence[Point]:
    arm = log_grid(3e-5, 5e-2, 9)
    return tuple((travel * scene.table.gear_ratio, p) for travel in arm for p in (1.0, 2.0, 3.5))


def _slipping(scene: Scene, point: Point) -> Floats:
    """Return a chain of slipping springs of unit height, less the sign it settles to, (N, 1)."""
    from agent.physics.kernels import slipping

    stiffness, level = MaxwellSlip(point[0], max(point[1], 1.0)).elements()
    out = remembered(
        scene.table.full,
        scene.table.pieces,
        lambda time, velocity, _, start: slipping(time, velocity, stiffness, level, start),
    )
    return stack(scene.level_share * (out - scene.direction))


def _slipping_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Return the chain that slips at the twin's own dry level, or at a part of it."""
    travel, exponent = values["sliding_travel_rad"], max(values["shape_exponent"], 1.0)
    plain = replace(scene, sliding=())
    torque = values["height_nm"] * _slipping(plain, (travel, exponent))[:, 0]

    def entry(travel: float) -> Mapping[str, float]:
        return {"sliding_travel_rad": travel, "shape_exponent": exponent}

    entries = [nearest(plain, _EFFECT, entry, travel, torque)]
    entries += [{**entry(travel), _SHARE: share} for share in _of_the_level(scene, values)]
    return best_entry(plain, _EFFECT, entries)


def _of_the_level(scene: Scene, values: Mapping[str, float]) -> Sequence[float]:
    """Return which share of the dry level yields, where that is clearly not all of it."""
    level = max(float(scene.theta[2]), 0.0)
    share = max(values["height_nm"], 0.0) / level if level > 0.0 else 1.0
    return (share,) if share < _A_PART else ()


FORMS: tuple[Form, ...] = (
    Form(
        "presliding-hysteresis",
        _DAHL,
        ("height_nm",),
        _presliding,
        ("reach_rad",),
        _presliding_grid,
        (1,),
        at_edges=True,
        to_twin=_presliding_twin,
        rests_on_numbers=True,
    ),
    Form(
        "presliding-hysteresis",
        _LUGRE,
        ("height_nm", _DAMPING),
        _damped,
        ("reach_rad",),
        _presliding_grid,
        (1, 1),
        at_edges=True,
        borne=_all_of_it_yields,
        to_twin=_presliding_twin,
        rests_on_numbers=True,
        refines=(_DAHL,),
        only_clearly=True,
    ),
    Form(
        "presliding-hysteresis",
        "Maxwell slip",
        ("height_nm",),
        _slipping,
        ("sliding_travel_rad", "shape_exponent"),
        _slipping_grid,
        (1,),
        at_edges=True,
        to_twin=_slipping_twin,
        rests_on_numbers=True,
    ),
)
