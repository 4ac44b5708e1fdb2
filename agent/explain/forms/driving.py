"""Friction under load that is more where the motor drives the load than where it is driven by it.

What a gear transmits is not the load alone: friction that the motor has to overcome loads the teeth
as well, and friction that holds the load back relieves them. With f = c |l + u f sign(v)|, where u
is 0 for the load, 1 for the motor's torque and 1/2 for the mean of both (as with one efficiency
both ways), f = c |l| / (1 - u c sign(l v)).

No motion tells that from a heavier arm, so that these forms are none to search with: they stand in
for their plain form where the weight is taken as it was given (`numbers/driving.py`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point
from agent.explain.forms.speed import FORMS, borne_nm
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.friction import boundary_share
from agent.physics.friction_static import one_less

EXCESS = "driving_excess"
"""u c at rest: by so much, over the mean, friction is more or less than the load asks for."""

_SLIDING = "sliding_part"
_FRICTION, _OIL = "arm_friction_share", "arm_viscous_share"
_BORNE = ("arm_share", _FRICTION, _OIL)


@dataclass(frozen=True)
class Driving:
    """A plain form, and the same of a gear that its own friction loads.

    Parameters
    ----------
    plain, form : Form
    falls : bool
        Whether it falls with speed.
    """

    plain: Form
    form: Form
    falls: bool

    def begun(self, point: Point) -> Point:
        """Return the plain form's point as the other's, without an excess yet."""
        return (*point, 0.0, 1.0, 0.0) if self.falls else (*point, 0.0)

    def at(self, point: Point, excess: float, coefficients: Floats) -> Point:
        """Return a point with another excess, beside the coefficients that it has, shape (k,)."""
        if not self.falls:
            return (*point[:-1], excess)
        whole = float(coefficients.sum())
        sliding = float(coefficients[0]) / whole if len(coefficients) > 1 and whole > 0.0 else 0.0
        return (*point[:-2], min(max(sliding, 0.0), 1.0), excess)


def _falling(scene: Scene, point: Point) -> Floats:
    arm, velocity, exponent, friction, sliding, excess = point
    load_nm = borne_nm(scene, arm, friction, friction)
    boundary = boundary_share(scene.speed, velocity, exponent)
    per_load = sliding + (1.0 - sliding) * boundary
    own = one_less(excess * per_load, load_nm * scene.direction)
    level = scene.direction * np.abs(load_nm) / own
    return np.stack((level, level * boundary), axis=1)


def _falling_alone(scene: Scene, point: Point) -> Floats:
    return _falling(scene, point)[:, 1:]


def _of(plain: Form) -> Driving:
    falls = "load_velocity_rad_s" in plain.nonlinear
    more = (_FRICTION, _SLIDING, EXCESS) if falls else (EXCESS,)
    borne = sum(name in _BORNE for name in plain.nonlinear)

    def even(scene: Scene, point: Point) -> Floats:
        load_nm = borne_nm(scene, *point[:borne])
        own = one_less(point[-1], load_nm * scene.direction)
        return np.asarray(plain.columns(scene, point[:-1]) / own[:, np.newaxis])

    def limits(scene: Scene) -> Sequence[tuple[float, float]]:
        own = plain.limits(scene) if plain.limits else ()
        return (*own, *((0.0, 1.0) for _ in more))

    def to_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
        numbers = dict(values)
        if numbers.pop(_SLIDING, None) is not None:
            numbers[_OIL] = numbers[_FRICTION]
        return plain.to_twin(scene, numbers)

    falling = _falling if len(plain.linear) > 1 else _falling_alone
    form = replace(
        plain,
        name=f"{plain.name}, more where the motor drives it",
        columns=falling if falls else even,
        nonlinear=(*plain.nonlinear, *more),
        limits=limits,
        kinds=tuple(name for name in more if name != _FRICTION),
        to_twin=to_twin,
    )
    return Driving(plain, form, falls)


DRIVING: Mapping[str, Driving] = {
    plain.name: _of(plain) for plain in FORMS if plain.effect == "load-dependent-friction"
}
"""By the name of the plain form."""
