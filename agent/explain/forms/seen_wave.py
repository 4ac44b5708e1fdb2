"""A gear that wobbles, whose arm an encoder shows: the shaft's torque by the slope of its wave.

A gear whose ratio wobbles, by w(q) on the motor's angle q, passes the shaft's torque on by
1 + dw/dq. The arm's own motion, wave and swing, is measured; what is left is that torque times the
slope, which a ripple that grows with the torque would copy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from agent.explain.forms.form import Form, Point, stack
from agent.explain.forms.orders import ORDER
from agent.explain.forms.seen_arm import arm_inertia, shaft_nm, shown_gear, waves_apart
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_NEAR = 0.005  # of an order


def _columns(scene: Scene, point: Point) -> Floats:
    (order,) = point
    cosine, sine = scene.wave(order).T
    shaft = order * shaft_nm(scene)
    return stack(-sine * shaft, cosine * shaft)


def _orders(scene: Scene) -> Sequence[Point]:
    """Return the orders of waves between the encoders of a gear that gives way, as it is seen."""
    return () if shown_gear(scene) is None else tuple((order,) for order in waves_apart(scene))


def _step(scene: Scene) -> Point:
    del scene
    return (_NEAR,)


def _to_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    return ({**values, "arm_inertia_kg_m2": arm_inertia(scene), "encoder_late_s": 0.0},)


WAVE = Form(
    "kinematic-error",
    "the wave between the encoders",
    ("cos_rad", "sin_rad"),
    _columns,
    (ORDER,),
    _orders,
    step=_step,
    needs=("position_rad", "position_arm_rad"),
    to_twin=_to_twin,
    from_residual=True,
)
SHOWN = frozenset({"kinematic-error", "resolver-error"})
"""What is a wave between the encoders; no torque's ripple is."""
